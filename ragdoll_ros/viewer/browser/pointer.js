// Sends where the pointer is over the picture, at most ten times a second: x to the right and y up,
// from -1 to 1; nothing when it leaves, or while a button is down.
function listen(send) {
  let last = '', pending = null;
  const later = (text) => {
    if (pending === null) setTimeout(() => {
      if (pending !== last) send(last = pending);
      pending = null;
    }, 100);
    pending = text;
  };
  document.addEventListener('pointermove', (event) => {
    const canvas = window.__viserMutable?.canvas;
    if (event.buttons || event.target !== canvas) return later('');
    const frame = canvas.getBoundingClientRect();
    later([2 * (event.clientX - frame.left) / frame.width - 1,
           1 - 2 * (event.clientY - frame.top) / frame.height].map((x) => x.toFixed(4)).join(' '));
  });
  document.addEventListener('pointerleave', () => later(''));
}

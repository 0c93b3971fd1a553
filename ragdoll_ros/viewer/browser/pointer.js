// Sends where the pointer is over the picture, at most ten times a second: x to the right and y up,
// from -1 to 1; nothing when it leaves, or while a button is down. And 'click' with the origin and
// the direction of the line of sight, m, z up, of a click or a tap, which moves by less than SLOP
// pixels in less than HOLD ms. Viser tells of no tap, and of the camera only later.
function listen(send) {
  const SLOP = 6, HOLD = 500;
  let last = '', pending = null, pressed = null;
  const later = (text) => {
    if (pending === null) setTimeout(() => {
      if (pending !== last) send(last = pending);
      pending = null;
    }, 100);
    pending = text;
  };
  const text = (numbers) => numbers.map((number) => number.toFixed(4)).join(' ');
  const place = (event) => {
    const frame = window.__viserMutable.canvas.getBoundingClientRect();
    return [2 * (event.clientX - frame.left) / frame.width - 1,
            1 - 2 * (event.clientY - frame.top) / frame.height];
  };
  const sight = (event) => {
    const {camera, nodeRefFromName: nodes} = window.__viserMutable;
    // What follows a doll moves the camera between pictures; unproject() would use the last one's.
    camera.updateMatrixWorld();
    const toWorld = nodes[''].matrixWorld.clone().invert();
    const eye = camera.position.clone().applyMatrix4(toWorld);
    const far = camera.position.clone().set(...place(event), 0.5).unproject(camera);
    return [...eye, ...far.applyMatrix4(toWorld).sub(eye).normalize()];
  };
  const isOver = (event) => event.target === window.__viserMutable?.canvas;
  document.addEventListener('pointermove', (event) => {
    later(event.buttons || !isOver(event) ? '' : text(place(event)));
  });
  document.addEventListener('pointerleave', () => later(''));
  // In the capture phase: what grabs a bone stops the event.
  document.addEventListener('pointerdown', (event) => {
    const {clientX, clientY, isPrimary, button, shiftKey, ctrlKey, metaKey} = event;
    const plain = isPrimary && !button && !shiftKey && !ctrlKey && !metaKey;
    pressed = plain && isOver(event) ? {clientX, clientY, since: event.timeStamp} : null;
  }, true);
  document.addEventListener('pointerup', (event) => {
    const start = pressed;
    pressed = null;
    if (start && event.timeStamp - start.since < HOLD && Math.hypot(
      event.clientX - start.clientX, event.clientY - start.clientY) < SLOP)
      send(`click ${text(sight(event))}`);
  }, true);
}

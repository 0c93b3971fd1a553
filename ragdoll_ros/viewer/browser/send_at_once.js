// Has viser send texts, choices and clicks at once. Its client holds all widgets of the panel back
// for 50 ms after each message, or until a busy browser comes to its timers, and then sends the last
// change alone: a click that follows a text, or another click, was lost or displaced it. Sliders and
// colours, which change with each move of the pointer, are still held back.
(function sendAtOnce() {
  const viewer = window.__viserMutable;
  if (!viewer) return setTimeout(sendAtOnce, 50);
  if (viewer.ragdollSendsAtOnce) return;
  viewer.ragdollSendsAtOnce = true;
  const later = window.setTimeout;
  let {sendMessage} = viewer;
  Object.defineProperty(viewer, 'sendMessage', {
    set: (send) => { sendMessage = send; },
    get: () => sendMessage && ((message) => {
      sendMessage(message);
      if (!['string', 'boolean'].includes(typeof message.updates?.value)) return;
      // What viser would do in 50 ms, set right after this, is done once the event is handled.
      window.setTimeout = (done, delay, ...rest) => {
        window.setTimeout = later;
        if (delay !== 50) return later(done, delay, ...rest);
        queueMicrotask(done);
        return 0;
      };
      queueMicrotask(() => { window.setTimeout = later; });
    })});
})();

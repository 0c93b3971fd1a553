// Sends the camera when the size of the picture has changed. Viser does so when the canvas has, but
// then the picture, whose size it sends, may still have the one before.
if (!window.ragdollKnowsSize) (function look(last) {
  window.ragdollKnowsSize = true;
  const viewer = window.__viserMutable, size = `${viewer?.canvas?.width} ${viewer?.canvas?.height}`;
  if (size !== last) viewer?.sendCamera?.();
  requestAnimationFrame(() => look(size));
})('');

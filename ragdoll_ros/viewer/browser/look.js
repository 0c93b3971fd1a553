// Draws contacts and joint limits over the bodies that would hide them.
// Draws colours as they are given, by Khronos' neutral tone mapping (7 in three.js) in place of one
// that imitates film, and shadows with soft edges that start 2 cm from what casts them, or bodies
// would have stripes of their own. Viser has no options for these, and makes its lights anew.
if (!window.ragdollLook) (function apply() {
  window.ragdollLook = true;
  setTimeout(apply, 500);
  const viewer = window.__viserMutable, root = viewer?.scene?.__r3f?.root?.getState();
  if (!root) return;
  root.gl.toneMapping = 7;
  for (const {shadow} of viewer.scene.children) if (shadow) {
    shadow.radius = 4;
    shadow.normalBias = 0.02;
  }
  for (const name of ['contacts', 'forces', 'limits'])
    viewer.nodeRefFromName[`/scene/${name}`]?.traverse((node) => {
      if (!node.material || !node.material.depthTest) return;
      node.material.depthTest = false;
      node.renderOrder = 10;
      node.castShadow = false;
    });
})();

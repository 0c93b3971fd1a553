// Removes viser's orange arrow of a drag, which ends in the plane of the grabbed point; the drag
// targets a point at constant distance from the camera and has a line of its own. Viser has no
// option for it. In a scene of viser only three.js' ArrowHelper has both a line and a cone.
if (!window.ragdollHidesDragArrow) (function remove() {
  window.ragdollHidesDragArrow = true;
  setTimeout(remove, 500);
  const viewer = window.__viserMutable;
  const scene = viewer?.scene;
  for (const node of scene ? [...scene.children] : [])
    if (node.line && node.cone) scene.remove(node);
})();

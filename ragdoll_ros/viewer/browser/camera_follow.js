// Moves the orbit target of the camera with the node named NODE, keeping direction and distance.
// The page does so itself: the server knows the camera late and would undo the user's rotation.
if (!window.ragdollFollowsNode) (function follow(last) {
  window.ragdollFollowsNode = true;
  const viewer = window.__viserMutable;
  const node = viewer?.cameraControl && viewer.nodeRefFromName[NODE];
  let position = null;
  if (node) {
    node.updateWorldMatrix(true, false);
    position = viewer.camera.position.clone().setFromMatrixPosition(node.matrixWorld);
    if (!last || position.distanceTo(last) > 1e-3) viewer.cameraControl.moveTo(...position, true);
  }
  requestAnimationFrame(() => follow(position));
})(null);

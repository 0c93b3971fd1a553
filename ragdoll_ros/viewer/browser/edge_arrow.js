// Shows an arrow at the picture's edge that points to the node named NODE while that is outside.
if (!window.ragdollPointsOutside) (function point(arrow) {
  window.ragdollPointsOutside = true;
  requestAnimationFrame(() => point(arrow));
  const viewer = window.__viserMutable;
  if (!viewer?.camera || !viewer.canvas) return;
  const camera = viewer.camera, canvas = viewer.canvas, node = viewer.nodeRefFromName[NODE];
  if (!arrow) {
    arrow = document.createElement('div');
    arrow.className = 'ragdoll-edge-arrow';
    arrow.setAttribute('role', 'img');
    arrow.setAttribute('aria-label', 'the doll is outside of the picture, this way');
    arrow.textContent = '➤';
    document.body.append(arrow);
  }
  let outside = false;
  if (node) {
    node.updateWorldMatrix(true, false);
    const place = camera.position.clone().setFromMatrixPosition(node.matrixWorld);
    const behind = place.clone().applyMatrix4(camera.matrixWorldInverse).z > 0;
    place.project(camera);
    let [x, y] = behind ? [-place.x, -place.y] : [place.x, place.y];
    outside = behind || Math.max(Math.abs(x), Math.abs(y)) > 1;
    if (outside) {
      const frame = canvas.getBoundingClientRect();
      const most = Math.max(Math.abs(x), Math.abs(y), 1e-6);
      [x, y] = [0.93 * x / most, 0.93 * y / most];
      const angle = Math.atan2(-y * frame.height, x * frame.width);
      arrow.style.left = `${frame.left + (x + 1) / 2 * frame.width}px`;
      arrow.style.top = `${frame.top + (1 - y) / 2 * frame.height}px`;
      arrow.style.transform = `translate(-50%, -50%) rotate(${angle}rad)`;
    }
  }
  arrow.style.display = outside ? '' : 'none';
})(null);

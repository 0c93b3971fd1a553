"""Materials and images on skins, which viser's skinned meshes do not have.

Below each skin stands an invisible mesh with them, which the page reads as any .glb; the page then
lets the skin, which viser moves, be drawn with its materials, texture coordinates and normals.
"""
from __future__ import annotations

DRESS = """(function dress() {
  setTimeout(dress, 200);
  const viewer = window.__viserMutable;
  if (!viewer || !viewer.nodeRefFromName) return;
  for (const name of Object.keys(viewer.nodeRefFromName)) {
    if (!/^.scene.skins.[0-9]+$/.test(name)) continue;
    const node = viewer.nodeRefFromName[name];
    const paint = viewer.nodeRefFromName[name + '/paint'];
    const parts = [];
    if (!node || !paint) continue;
    paint.traverse((each) => { if (each.isMesh) parts.push(each); });
    if (!parts.length) continue;
    node.traverse((skin) => {
      if (!skin.isSkinnedMesh) return;
      const shape = skin.geometry, of = parts[0].geometry.attributes;
      if (skin.material === skin.ragdollPaint && shape === skin.ragdollShape) return;
      if (of.uv) shape.setAttribute('uv', of.uv);
      if (of._normal) shape.setAttribute('normal', of._normal);
      shape.clearGroups();
      let at = 0;
      parts.forEach((part, number) => {
        shape.addGroup(at, part.geometry.index.count, number);
        at += part.geometry.index.count;
        part.material.side = 2;
        part.material.toneMapped = !part.material.isMeshBasicMaterial;
      });
      skin.ragdollShape = shape;
      skin.material = skin.ragdollPaint = parts.map((part) => part.material);
      if (viewer.requestRender) viewer.requestRender();
    });
  }
})();"""
"""JavaScript that a page runs once; it looks for new skins five times a second. Both sides are
drawn: skins have hair and cloth of one layer. Unlit materials (KHR_materials_unlit) keep their
colours, as they are meant to, whatever viser does to the light. Without quotes of the kind of its
attribute."""

PAINT = f"""<img src="data:," style="display:none" onerror="
  if (!window.ragdollDresses) {{
    window.ragdollDresses = true;
    {DRESS}
  }}">"""
"""For the panel of a page that a server serves."""

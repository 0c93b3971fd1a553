// Gives skins the materials, texture coordinates and normals that viser's skinned meshes lack, taken
// from the invisible mesh <skin>/materials, which the page loads as any .glb; looks for new skins
// five times a second. Both sides are drawn, because hair and cloth have one layer. Unlit materials
// (KHR_materials_unlit) keep their colours, so they are not tone-mapped.
if (!window.ragdollMaterials) (function apply() {
  window.ragdollMaterials = true;
  setTimeout(apply, 200);
  const viewer = window.__viserMutable;
  if (!viewer || !viewer.nodeRefFromName) return;
  for (const name of Object.keys(viewer.nodeRefFromName)) {
    if (!/^.scene.skins.[0-9]+$/.test(name)) continue;
    const node = viewer.nodeRefFromName[name];
    const model = viewer.nodeRefFromName[name + '/materials'];
    const parts = [];
    if (!node || !model) continue;
    model.traverse((child) => { if (child.isMesh) parts.push(child); });
    if (!parts.length) continue;
    node.traverse((skin) => {
      if (!skin.isSkinnedMesh) return;
      const geometry = skin.geometry, attributes = parts[0].geometry.attributes;
      if (skin.material === skin.ragdollMaterials && geometry === skin.ragdollGeometry) return;
      if (attributes.uv) geometry.setAttribute('uv', attributes.uv);
      if (attributes._normal) geometry.setAttribute('normal', attributes._normal);
      geometry.clearGroups();
      let start = 0;
      parts.forEach((part, index) => {
        geometry.addGroup(start, part.geometry.index.count, index);
        start += part.geometry.index.count;
        part.material.side = 2;
        part.material.toneMapped = !part.material.isMeshBasicMaterial;
      });
      skin.ragdollGeometry = geometry;
      skin.material = skin.ragdollMaterials = parts.map((part) => part.material);
      if (viewer.requestRender) viewer.requestRender();
    });
  }
})();

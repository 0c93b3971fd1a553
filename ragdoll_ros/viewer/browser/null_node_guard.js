// Keeps a page alive when a skin is removed or the connection is lost: viser 1.1.1 then reads a
// property of a node that is null, where it checks for undefined.
(function guard() {
  const viewer = window.__viserMutable;
  if (!viewer) return setTimeout(guard, 50);
  if (viewer.ragdollGuard) return;
  viewer.ragdollGuard = true;
  viewer.nodeRefFromName = new Proxy(viewer.nodeRefFromName,
                                     {get: (nodes, name) => nodes[name] ?? undefined});
})();

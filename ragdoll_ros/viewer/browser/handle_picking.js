// Gives the pointer to the editor's handles, below the node ROOT, before bodies in front of them:
// handles are drawn on top, but react-three-fiber reports the nearest hit first.
if (!window.ragdollPicksHandles) (function install() {
  window.ragdollPicksHandles = true;
  const viewer = window.__viserMutable, events = viewer?.scene?.__r3f?.root?.getState();
  if (!events) return setTimeout(install, 200);
  const isHandle = (node) => node && (node === viewer.nodeRefFromName[ROOT]
                                      || isHandle(node.parent));
  events.setEvents({filter: (hits) => {
    const handles = hits.filter((hit) => isHandle(hit.object));
    return [...handles, ...hits.filter((hit) => !handles.includes(hit))];
  }});
})();

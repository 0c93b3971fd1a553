"""Handles take the pointer from bodies that stand before them, as they are drawn on top of these.

Viser gives it to the nearest body that listens, whichever is seen.
"""
from __future__ import annotations

from .handles import ROOM

ON_TOP = f"""<img src="data:," style="display:none" onerror="
  if (!window.ragdollOnTop) (function first() {{
    window.ragdollOnTop = true;
    const viewer = window.__viserMutable, events = viewer?.scene?.__r3f?.root?.getState();
    if (!events) return setTimeout(first, 200);
    const isHandle = (node) => node && (node === viewer.nodeRefFromName['{ROOM}']
                                        || isHandle(node.parent));
    events.setEvents({{filter: (hits) => {{
      const handles = hits.filter((hit) => isHandle(hit.object));
      return [...handles, ...hits.filter((hit) => !handles.includes(hit))];
    }}}});
  }})()">"""
"""For the panel: sorts what react-three-fiber found under the pointer before it tells of it."""

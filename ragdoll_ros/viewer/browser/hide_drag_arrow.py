"""Viser's own arrow of a drag, which is taken away.

It points, in orange, at where the pointer is in the plane through the grabbed point; hands pull to
the distance from the eye that the point had, and have a line of their own (`marks.py`). Viser has
no way to go without.
"""
from __future__ import annotations

NO_ARROW = """<img src="data:," style="display:none" onerror="
  if (!window.ragdollArrow) (function remove() {
    window.ragdollArrow = true;
    setTimeout(remove, 500);
    const scene = window.__viserMutable?.scene;
    for (const node of scene ? [...scene.children] : [])
      if (node.line && node.cone) scene.remove(node);
  })()">"""
"""three.js' ArrowHelper, of a line and a cone, is nothing else in a viser scene."""

"""The kinematic tree of a doll as an indented list, in which bones are selected."""
from __future__ import annotations

import html
from collections.abc import Callable, Sequence

import viser

from ...model.scene import Placement, Scene
from ..browser.scripts import add_listener, script, style

INDENT = 0.9
"""em by which a child stands to the right of its parent."""


class BoneTree:
    """In the GUI container that is current.

    ``select`` takes, in viser's thread, the name of a bone that was clicked, and whether the other
    selected bones stay selected.
    """

    def __init__(self, gui: viser.GuiApi, select: Callable[[str, bool], None]) -> None:
        gui.add_html(style('bone_tree.css'))
        add_listener(gui, 'bone tree', 'bone_tree.js', lambda _, event: select(
            event.partition(' ')[2], event.startswith('more ')))
        self._html = gui.add_html('')

    def show(self, scene: Scene, placement: Placement, selected: Sequence[str]) -> None:
        """Show the bones of a doll, each below its parent; mark those that are ``selected``, and
        a root that is fixed.
        """
        rows = [_row(scene.qualified(placement, bone),
                     bone + ' (fixed)' * (placement.fixed_root and depth == 0), depth, selected)
                for bone, depth in depths(placement)]
        content = ('<div class="ragdoll-tree" role="tree" tabindex="0" aria-label="Bones" '
                   f'aria-multiselectable="true">{"".join(rows)}</div>'
                   + script('bone_tree_scroll.js'))
        if content != self._html.content:
            self._html.content = content


def depths(placement: Placement) -> list[tuple[str, int]]:
    """Names of a doll's bones, children right after their parent, and how deep each is."""
    doll = placement.doll
    below: dict[str, list[str]] = {bone.name: [] for bone in doll.bones}
    for joint in doll.joints:
        below[joint.parent].append(joint.child)
    found, waiting = [], [(doll.root.name, 0)]
    while waiting:
        name, depth = waiting.pop()
        found.append((name, depth))
        waiting += [(child, depth + 1) for child in reversed(below[name])]
    return found


def _row(name: str, label: str, depth: int, selected: Sequence[str]) -> str:
    chosen, last = str(name in selected).lower(), ' data-last' * (selected[-1:] == (name,))
    return (f'<div role="treeitem" aria-level="{depth + 1}" aria-selected="{chosen}" '
            f'data-bone="{html.escape(name)}"{last} '
            f'style="padding-left: {0.6 + INDENT * depth:.1f}em">{html.escape(label)}</div>')

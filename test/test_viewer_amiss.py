"""In headless Chromium: what a page says where something is amiss, and what it does not show."""
from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('viser')
from browser import View, chromium, serving, start_of

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.page import DISCONNECTED

SCENE = load_scene('drop')
START = start_of(SCENE)
ARM = SCENE.bone_index('left_forearm')

SAID = """() => {
  const {content, visibility} = getComputedStyle(document.body, '::before');
  return visibility === 'visible' && content !== 'none' ? content.slice(1, -1) : '';
}"""
"""What stands above the picture, as CSS has it; empty for nothing."""

ORANGE = """() => {
  const {scene, canvas} = window.__viserMutable, found = [];
  scene.traverseVisible(node => {
    const color = node.material?.color;
    if (color && color.getHexString() === 'ff8c42') found.push(node.type);
  });
  return found;
}"""
"""What is drawn in the colour of viser's own arrow of a drag."""


def test_software_rendering_a_grab_and_a_lost_viewer():
    """One page: without a GPU, dragged, and left by its viewer, which then comes back."""
    with chromium() as context:
        with serving('--port', '0', '--scene', 'drop') as url:
            view = View(context, url)
            view.wait(lambda: np.isfinite(view.bodies(SCENE)).all())
            view.wait(lambda: abs(view.bodies(SCENE) - START).max() > 0.01)  # once it is seen
            note = view.page.get_by_text('WebGL is running in software mode')
            assert 'check that hardware acceleration is enabled' in note.text_content()
            check_grab(view)
            assert not view.page.evaluate(SAID)
        view.wait(lambda: view.page.evaluate(SAID) == DISCONNECTED)
        with serving('--port', url.rpartition(':')[2], '--scene', 'drop'):
            view.wait(lambda: not view.page.evaluate(SAID))
            view.button('Pause').wait_for()
        assert not view.errors


def check_grab(view):
    """A held bone is pulled by our line alone, which goes with the hand."""
    view.hold_at(SCENE, START)
    arm = START[ARM]
    mouse = view.page.mouse
    mouse.move(*view.pixels([arm])[0])
    mouse.down()
    mouse.move(*view.pixels([np.add(arm, (0, -0.3, 0.4))])[0], steps=5)
    view.wait(lambda: view.has('/scene/hands'))
    view.page.wait_for_timeout(600)  # within which viser would have drawn its arrow
    assert view.page.evaluate(ORANGE) == []
    mouse.up()

"""The first minute with `make run`, in headless Chromium: the fall is seen, a press has a feel."""
from __future__ import annotations

import time

import numpy as np
import pytest
from browser import chromium, opened, serving

from ragdoll_ros.files.scene import load_scene

SCENE = load_scene('drop')
START = np.array([SCENE.dolls[0].bone_pose(bone)[0] for bone in SCENE.bones])

SIZES = {'desk': {'width': 1280, 'height': 800}, 'phone': {'width': 390, 'height': 844}}


@pytest.fixture(scope='module')
def browser(ros):
    with chromium() as context:
        yield context


@pytest.mark.parametrize('size', ['desk', pytest.param('phone', marks=pytest.mark.slow)])
def test_the_first_fall_waits_for_the_first_page(browser, size):
    """3 s without a page: in the first picture all hangs at the start; 3 s later it lies."""
    with serving('--ros-args', '-r', f'__ns:=/{size}', module='ragdoll_ros.ros.run') as url:
        time.sleep(3.0)  # what is waited for is that nothing happens
        with opened(browser, url, SCENE, SIZES[size]) as view:
            assert abs(view.bodies(SCENE) - START).max() < 0.3
            view.wait(lambda: abs(view.bodies(SCENE)[:, 2] - START[:, 2]).min() > 0.1)
            view.button('Again').wait_for()

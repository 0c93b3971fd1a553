"""Results of a pile: costs, penetration, time until all sleep, reason of an abort."""
from __future__ import annotations

import dataclasses
import math

import pytest

pytest.importorskip('mujoco')
pytest.importorskip('numba', reason='numba is not installed: there is no rigid engine')

from ragdoll_ros import load_scene
from ragdoll_ros.accuracy.crowds import pile
from ragdoll_ros.accuracy.crowds.depth import BoneDepth


def course(**placed):
    drop = load_scene('drop')
    scene = dataclasses.replace(drop, dolls=(dataclasses.replace(drop.dolls[0], **placed),))
    return pile.run_pile(scene, BoneDepth(scene), engine='rigid', accuracy='draft')


def test_a_doll_that_lies_down_is_asleep_from_when_it_is():
    made = course(position=(0, 0, 0.12), orientation=(0, 1, 0, 1))
    assert len(made.costs) == 1000 and not made.ended
    assert 0.3 < made.asleep < 5 and made.cpu > 0
    assert max(made.bone_depth, made.ground_depth) < 2e-3 and made.overshoot < math.radians(1)


def test_a_run_that_is_too_fast_is_aborted():
    made = course(position=(0, 0, 5), velocity=(2 * pile.MAX_SPEED, 0, 0))
    assert made.ended == 'diverged, at 0.01 s' and made.asleep == math.inf


def test_a_run_that_takes_too_long_is_aborted(monkeypatch):
    monkeypatch.setattr(pile, 'MAX_WALL_TIME', 0.0)
    assert course().ended == 'aborted after 0 s, at 0.01 s'

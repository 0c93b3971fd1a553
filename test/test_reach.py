"""What bones can reach: compiled, by numpy, and from bounding spheres."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing is compiled')

from samples import MANY, random_state

from ragdoll_ros.model.scene import Ground, height
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.engine.protocol import GROUND
from ragdoll_ros.physics.plain.reach import MARGIN, Reach
from ragdoll_ros.physics.reach import CompiledReach

GROUNDS = {'none': None, 'level': Ground(), 'slope': Ground((.3, -.5, .8), -.7)}
DOLL_OF = np.repeat(range(3), [len(placement.doll.bones) for placement in MANY.dolls])


RADII = np.array([math.hypot(*bone.shape.half_extents) for bone in MANY.bones])


@pytest.mark.parametrize('make', [Reach, CompiledReach])
@pytest.mark.parametrize('ground', ['level', 'slope'])
def test_heights_and_speeds_are_those_of_their_definition(make, ground):
    """Of one bone after another; a bone's farthest point is a radius from its centre."""
    scene = dataclasses.replace(MANY, ground=GROUNDS[ground])
    reach, state, later = make(scene), random_state(scene, 1, .5), random_state(scene, 2, .5)
    heights = [height(*bone, scene.ground) for bone in zip(
        scene.bones, state.positions, state.orientations, strict=True)]
    assert reach.heights(state) == pytest.approx(np.array(heights), abs=1e-13)
    assert reach.clearance(state) == pytest.approx(min(heights), abs=1e-13)
    spins = np.linalg.norm(state.angular_velocities, axis=1)
    sinking = RADII * spins - state.linear_velocities @ scene.ground.normal
    for soon in (.001, .1):
        there = [speed for low, speed in zip(heights, sinking, strict=True)
                 if low < speed * soon + MARGIN]
        assert reach.falling(state, soon) == pytest.approx(max(there), rel=1e-13)
    assert reach.max_angular_speed(state) == pytest.approx(spins.max(), rel=1e-14)
    assert reach.max_tip_speed(state) == pytest.approx((RADII * spins).max(), rel=1e-14)
    closing = np.ptp(state.linear_velocities, axis=0).max()
    assert reach.closing(state) == pytest.approx(closing, rel=1e-14)
    thinnest = min(min(bone.shape.half_extents) for bone in scene.bones)
    assert reach.ccd_steps(state, .01) == math.ceil(
        (closing + 2 * (RADII * spins).max()) * .01 / (4 * thinnest))
    turned = np.abs(later.angular_velocities - state.angular_velocities).max(axis=1) * RADII
    moved = np.abs(later.linear_velocities - state.linear_velocities)
    assert reach.change(state, later) == pytest.approx(max(turned.max(), moved.max()), rel=1e-14)


@pytest.mark.parametrize('ground', GROUNDS)
@pytest.mark.parametrize('up', [.2, 1.5, 20.0])
def test_what_bones_can_reach_is_what_numpy_finds(ground, up):
    """To rounding; ``clearance`` of the plain one may tell less where nothing is near."""
    scene = dataclasses.replace(MANY, ground=GROUNDS[ground])
    found, plain = CompiledReach(scene), Reach(scene)
    falls = []
    for seed in range(5):
        state = random_state(scene, seed, up)
        assert found.heights(state) == pytest.approx(plain.heights(state), abs=1e-13)
        assert found.clearance(state) == pytest.approx(plain.heights(state).min(), abs=1e-13)
        assert plain.clearance(state) <= found.clearance(state) + 1e-13
        for soon in (.001, .015, .1):
            falls.append(plain.falling(state, soon))
            assert found.falling(state, soon) == pytest.approx(falls[-1], rel=1e-13)
        assert found.closing(state) == pytest.approx(plain.closing(state), rel=1e-14)
        assert found.max_angular_speed(state) == pytest.approx(plain.max_angular_speed(state),
                                                               rel=1e-14)
        assert found.ccd_steps(state, .01) == plain.ccd_steps(state, .01)
        again = random_state(scene, seed + 100, up)
        found.heights(again)
        assert found.clearance(state) == pytest.approx(plain.heights(state).min(), abs=1e-13)
    if ground == 'level':
        assert (max(falls) > 0) is (up < 20)


@pytest.mark.parametrize('ground', GROUNDS)
def test_dolls_that_reach_the_ground_are_near_it(ground):
    """Each bone's lowest point, at the speed of the doll's fastest, and what it may gain.

    Twice that speed is what is looked at; what is not told is farther than that.
    """
    scene = dataclasses.replace(MANY, ground=GROUNDS[ground])
    reach = CompiledReach(scene)
    found = set()
    for seed in range(20):
        state = random_state(scene, seed, .4 * seed)
        near = {doll for doll,
                other in reach.broadphase_pairs(state, .02, 9.8, set()) if other == GROUND}
        speeds = (np.linalg.norm(state.linear_velocities, axis=1)
                  + RADII * np.linalg.norm(state.angular_velocities, axis=1))
        for doll in range(3):
            own = doll == DOLL_OF
            low, fast = Reach(scene).heights(state)[own].min(), speeds[own].max()
            way = 2 * .02 * (fast + .02 * 9.8) + MARGIN
            assert (doll in near) is bool(low < way)
        found |= {len(near)}
    assert found == {0} if ground == 'none' else len(found) > 1


def test_dolls_are_as_near_to_each_other_as_numpy_finds():
    scene = dataclasses.replace(MANY, ground=None)
    for seed in range(5):
        state = random_state(scene, seed)
        moved = 1.5 * seed * DOLL_OF
        state = State(state.positions + moved[:, None], state.orientations,
                      state.linear_velocities, state.angular_velocities)
        near = [reach(scene).broadphase_pairs(state, .01, 9.8, set())
                for reach in (CompiledReach, Reach)]
        assert near[0] == near[1]

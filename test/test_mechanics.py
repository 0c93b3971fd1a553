"""The sums over each doll's bones, compiled and by numpy, against their definitions."""
from __future__ import annotations

import numpy as np
import pytest
from conserved import conserved, matrices
from samples import MANY, SCENES, random_state

from ragdoll_ros.physics import kernels
from ragdoll_ros.physics.motion import Shift
from ragdoll_ros.physics.plain.mechanics import Mechanics


@pytest.fixture(params=['plain', 'compiled'])
def make(request):
    """Who sums."""
    if request.param == 'plain':
        return Mechanics
    if not kernels.ready():
        pytest.skip('nothing is compiled here')
    from ragdoll_ros.physics.conservation import CompiledMechanics
    return CompiledMechanics


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('scene', SCENES.values(), ids=SCENES)
def test_sums_are_those_of_the_definition(make, scene, seed):
    """To rounding: 1e-16 of terms of up to 1e4, some hundred of them."""
    state = random_state(scene, seed)
    found = make(scene).motion(state)
    for doll in range(len(scene.dolls)):
        right = conserved(scene, state, doll)
        for name in ('energy', 'kinetic', 'centre', 'momentum', 'angular_momentum', 'inertia'):
            assert getattr(found, name)[doll] == pytest.approx(getattr(right, name), rel=1e-13,
                                                               abs=1e-11), name


def test_a_shift_adds_the_motion_of_a_rigid_body(make):
    """Each doll's momentum grows by M v, its angular momentum by I w, nothing else turns."""
    rng, state, mechanics = np.random.default_rng(6), random_state(MANY, 5), make(MANY)
    way, velocity, spin = rng.normal(size=(3, len(MANY.dolls), 3))
    after = mechanics.shifted(state, mechanics.motion(state), Shift(way, velocity, spin))
    assert (after.orientations == state.orientations).all()
    for doll, placement in enumerate(MANY.dolls):
        then, now = conserved(MANY, state, doll), conserved(MANY, after, doll)
        assert now.centre - then.centre == pytest.approx(way[doll], abs=1e-13)
        assert now.momentum - then.momentum == pytest.approx(
            placement.doll.mass * velocity[doll], abs=1e-11)
        assert now.angular_momentum - then.angular_momentum == pytest.approx(
            then.inertia @ spin[doll], abs=1e-11)


def test_a_shift_turns_dolls_with_all_their_motion(make):
    scene = SCENES['plate']
    state, mechanics = random_state(scene, 5), make(scene)
    turn, nothing = np.array([[.6, 0, 0, .8]]), np.zeros((1, 3))
    after = mechanics.shifted(state, mechanics.motion(state),
                              Shift(nothing, nothing, nothing, turn))
    by, = matrices(turn)
    assert matrices(after.orientations)[0] == pytest.approx(by @ matrices(state.orientations)[0])
    assert after.angular_velocities[0] == pytest.approx(by @ state.angular_velocities[0])
    assert (after.positions == state.positions).all()

"""The sums over each doll's bones, by numpy and compiled, against their definitions."""
from __future__ import annotations

import pytest
from conserved import conserved
from samples import SCENES, layout_of, random_state

from ragdoll_ros.physics import kernels
from ragdoll_ros.physics.sums import DollSums


@pytest.fixture(params=['plain', 'compiled'])
def make(request):
    """Who sums."""
    if request.param == 'plain':
        return DollSums
    if not kernels.ready():
        pytest.skip('nothing is compiled here')
    from ragdoll_ros.physics.conservation import ConservationProjection
    return lambda scene: ConservationProjection(scene, layout_of(scene))


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

"""The sums over each doll's bones, against their definitions."""
from __future__ import annotations

import pytest
from conserved import conserved
from samples import SCENES, random_state

from ragdoll_ros.physics.engine.doll_totals import DollSums


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('scene', SCENES.values(), ids=SCENES)
def test_sums_are_those_of_the_definition(scene, seed):
    """To rounding: 1e-16 of terms of up to 1e4, some hundred of them."""
    state = random_state(scene, seed)
    found = DollSums(scene).totals(state)
    for doll in range(len(scene.dolls)):
        right = conserved(scene, state, doll)
        for name in ('energy', 'kinetic', 'centre', 'momentum', 'angular_momentum', 'inertia'):
            assert getattr(found, name)[doll] == pytest.approx(getattr(right, name), rel=1e-13,
                                                               abs=1e-11), name

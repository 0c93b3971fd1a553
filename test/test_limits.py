"""What joint limits have to say: compiled and by numpy."""
from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('numba', reason='numba is not installed: nothing is compiled')

from samples import MANY, SCENES, layout_of, random_coordinates

from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.physics.limits import CompiledLimits
from ragdoll_ros.physics.plain.limits import JointLimits


@pytest.mark.parametrize('duration', [0.0, .01])
@pytest.mark.parametrize('scene', [SCENES['doll'], SCENES['plate'], MANY],
                         ids=['doll', 'no_limits', 'dolls'])
def test_joint_limits_are_told_of_as_by_numpy(scene, duration):
    """To the bit: there is one difference, and one product. Over 200 moments, as what was held
    once counts for what comes; one limit in twenty is within 3 mrad.
    """
    layout = layout_of(scene)
    found, plain = CompiledLimits(layout), JointLimits(layout)
    lower, upper = layout.limits
    ends = np.where(np.isfinite(upper), upper, lower)
    rng, pressed, anywhere = np.random.default_rng(2), [], random_coordinates(scene, 2)
    for moment in range(200):
        here = GeneralizedState(anywhere.q.copy(), rng.normal(size=anywhere.v.size) * .3)
        here.q[layout.limited[0]] = ends + np.where(
            rng.random(len(ends)) < .05, rng.uniform(-3e-3, 3e-3, len(ends)),
            -.2 * np.sign(ends))
        pressed.append(plain.is_active(here, duration))
        assert found.is_active(here, duration) == pressed[-1]
        assert found.max_violation(here) == plain.max_violation(here)
        assert found.fastest(here) == plain.fastest(here)
        assert found.approach(here, .015) == pytest.approx(plain.approach(here, .015), rel=1e-15)
        if moment % 7 == 0:
            found.hold(here)
            plain.hold(here)
    assert len(set(pressed)) == (2 if len(ends) else 1)


PAIR = Scene('pair', (Placement(Ragdoll('pair', (
    Bone('a', Sphere(.1), 1.0, (0, 0, 0)), Bone('b', Sphere(.1), 1.0, (1, 0, 0))), (
    Joint('a', 'b', 'hinge', (.5, 0, 0), ((0, 0, 1),), ((-.5, .3),)),))),), ground=None)


@pytest.mark.parametrize('make', [JointLimits, CompiledLimits])
@pytest.mark.parametrize(('angle', 'rate', 'past', 'active', 'approach'), [
    (.1, 2.0, -.2, False, 0.0), (.29, 2.0, -.01, True, 2.0), (.29, -2.0, -.01, False, 0.0),
    (.2995, .01, -.0005, True, 0.0), (.2995, -.01, -.0005, False, 0.0),
    (.302, -.5, .002, True, 0.0), (-.51, 0.0, .01, True, 0.0), (-.49, -2.0, -.01, True, 2.0),
    (-.49, 2.0, -.01, False, 0.0)])
def test_one_hinge_between_its_limits(make, angle, rate, past, active, approach):
    """Past is beyond the nearer end; active: pressing there, or past it by 1 mrad within 0.01 s."""
    limits = make(layout_of(PAIR))
    here = GeneralizedState(np.array([0, 0, 0, 0, 0, 0, 1, angle]), np.array([0.0] * 6 + [rate]))
    # A joint's limits are rounded to 1e-9 degrees.
    assert limits.max_violation(here) == pytest.approx(past, abs=2e-11)
    assert limits.is_active(here, .01) is active
    assert limits.approach(here, .01) == approach
    assert limits.fastest(here) == abs(rate)

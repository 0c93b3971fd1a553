"""Flights by numpy, with accelerations from the engine."""
import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.physics.engine.bullet import BulletEngine
from ragdoll_ros.physics.plain.flight import EnginePath, fly

FLIGHT = load_scene('flight')


@pytest.fixture
def engine():
    """A doll that meets no limit."""
    engine = BulletEngine(FLIGHT, free=True)
    yield engine
    engine.close()


def moving(engine):
    """Its coordinates at the start, with velocities of some 1 m/s and rad/s."""
    start = engine.coordinates()
    return GeneralizedState(start.q, np.random.default_rng(5).normal(size=start.v.shape))


@pytest.mark.parametrize('order', [3, 4])
def test_a_path_leads_through_what_it_passes(engine, order):
    """Between its ends too it is off by h^4 at the most: half as long, 16 times less."""
    start, errors = moving(engine), []
    for length in (0.04, 0.02):
        path = EnginePath(engine, start, length, order)
        missed = [path.at(share * length).q - fly(engine, start, share * length, 4, 40).q
                  for share in (0.2, 0.5, 0.8)]
        errors.append(np.abs(missed).max())
    assert errors[0] / errors[1] > 0.8 * 2 ** 4
    assert errors[1] < 1e-4


@pytest.mark.parametrize('order', [2, 3, 4])
def test_equal_steps_are_of_the_methods_order(engine, order):
    """Twice as many err 2^order times less; 80 steps of order 4 stand for the truth."""
    start = moving(engine)
    truth = fly(engine, start, 0.08, 4, 80)
    errors = [max(np.abs(end.q - truth.q).max(), np.abs(end.v - truth.v).max())
              for end in (fly(engine, start, 0.08, order, steps) for steps in (4, 8))]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.4)

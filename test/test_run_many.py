"""Many ticks, and many scenes, in one call."""
import dataclasses
import itertools

import numpy as np
import pytest

from ragdoll_ros import Simulation, load_scene, run_many
from ragdoll_ros.model.errors import OutOfRange

DROP = load_scene('drop')


def spun(count):
    """Drops of dolls that spin, each in another way."""
    return [dataclasses.replace(DROP, dolls=(
        dataclasses.replace(DROP.dolls[0], spin=(0.1 * k, 1.0, -0.2 * k)),)) for k in range(count)]


def by_ticks(scene, ticks):
    with Simulation(scene) as simulation:
        return np.array([simulation.advance().rows.copy() for _ in range(ticks)])


def test_a_run_is_its_ticks():
    with Simulation(DROP) as simulation:
        assert simulation.run(0).shape == (0, 10, 13)
        np.testing.assert_array_equal(simulation.run(60), by_ticks(DROP, 60))
        assert simulation.time == 600_000_000
        with pytest.raises(OutOfRange, match='ticks'):
            simulation.run(-1)


@pytest.mark.parametrize('threads', [1, 2, 3, None])
@pytest.mark.parametrize('count', [0, 1, 2, 3, 5, 6, 8, 12])
def test_many_are_each_alone(count, threads):
    scenes = spun(count)
    found = list(run_many(scenes, 45, threads=threads))
    assert len(found) == count
    for rows, scene in zip(found, scenes, strict=True):
        np.testing.assert_array_equal(rows, by_ticks(scene, 45))


def test_scenes_are_taken_as_they_are_needed():
    taken = []
    scenes = (taken.append(k) or scene for k, scene in enumerate(itertools.cycle(spun(2))))
    found = list(itertools.islice(run_many(scenes, 2, threads=2), 5))
    assert len(found) == 5 and len(taken) < 12


def test_wrong_arguments_are_named():
    with pytest.raises(OutOfRange, match='accuracy'):
        next(run_many([DROP], 1, accuracy='fine'))
    with pytest.raises(OutOfRange, match='ticks'):
        next(run_many([DROP], -1))

"""The ledger of steps: what it counts of motion whose steps are known."""
import dataclasses

import pytest

from ragdoll_ros.accuracy import ledger
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.ragdoll import Bone, Ragdoll
from ragdoll_ros.model.scene import Ground, Placement, Scene
from ragdoll_ros.model.shapes import Box
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.physics.simulation import Simulation

pytest.importorskip('numba')

REJECTED = ('past_impact', 'closed_unseen', 'new_contacts', 'too_deep', 'too_coarse',
            'too_much_energy')
AWAKE = dataclasses.replace(ACCURACIES['normal'], sleep=False)


def boxes(count):
    """A scene of boxes that lie on the ground, 2 m apart."""
    doll = Ragdoll('box', (Bone('box', Box((0.2, 0.2, 0.2)), 1.0, (0, 0, 0)),), ())
    return Scene('boxes', tuple(Placement(doll, position=(2.0 * k, 0, 0.1), name=f'b{k}')
                                for k in range(count)), Ground())


def counted(scene, ticks, **options):
    with Simulation(scene, accuracy=AWAKE, **options) as simulation:
        for _ in range(20):
            simulation.advance()
        before = simulation.ledger()
        for _ in range(ticks):
            simulation.advance()
        return {name: count - before[name] for name, count in simulation.ledger().items()}


@pytest.mark.parametrize('count', [1, 2, 3, 5, 6, 8, 12, 40])
def test_boxes_at_rest_take_the_steps_that_are_due(count):
    """Each stands on four corners of three rows; nothing is rejected, nothing hits anything."""
    found = counted(boxes(count), 10)
    assert found['steps'] == found['trials'] == found['solves'] == 10 * count, 'one a tick'
    assert [found[name] for name in REJECTED] == [0] * len(REJECTED)
    assert found['impacts'] == found['flight_steps'] == 0
    assert found['contacts'] == 4 * found['solves']
    assert found['rows'] == 12 * found['solves'] and found['dofs'] == 6 * found['solves']


def test_workers_count_alike():
    scene = load_scene('crowd')
    one, two = (counted(scene, 60, workers=workers) for workers in (1, 2))
    assert one['impacts'] > 0 and one['past_impact'] > 0 and one['narrow_phases'] > 0
    assert {name: count for name, count in one.items() if not name.endswith('cycles')} == {
        name: count for name, count in two.items() if not name.endswith('cycles')}


def test_flight_takes_no_contact_steps():
    found = counted(load_scene('flight'), 20)
    assert found['flight_steps'] > 0 and found['trials'] == found['solves'] == 0


def test_steps_that_went_past_an_impact_are_counted():
    """A box falls, tumbles and comes to lie: every trial is a step, taken or rejected."""
    scene = boxes(1)
    high = dataclasses.replace(scene, dolls=(
        dataclasses.replace(scene.dolls[0], position=(0, 0, 1.0), spin=(1.0, 0.5, 0.0)),))
    with Simulation(high, accuracy=AWAKE) as simulation:
        for _ in range(250):
            simulation.advance()
        found = simulation.ledger()
    assert found['impacts'] > 0
    assert found['past_impact'] > 0
    assert sum(found[name] for name in REJECTED) < found['trials'] == found['steps']


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_other_engines_have_no_ledger(engine):
    pytest.importorskip({'bullet': 'pybullet'}.get(engine, engine))
    with Simulation(load_scene('drop'), engine=engine) as simulation:
        assert simulation.ledger() == {}


def test_stages_share_the_time_of_a_tick(capsys):
    found = ledger.measure('drop', 'draft', 1.0)
    assert found.ticks == 100
    if found.rate:
        assert sum(found.stages.values()) == pytest.approx(found.seconds)
        assert min(found.stages.values()) >= 0
    assert ledger.main(['flight', '--seconds', '0.2']) == 0
    said = capsys.readouterr().out
    assert said.startswith('flight, draft, 20 ticks') and 'us a tick' in said


def test_wrong_scenes_and_times_are_named(capsys):
    assert ledger.main(['no_such_scene']) == 2
    assert 'no_such_scene' in capsys.readouterr().err
    with pytest.raises(SystemExit):
        ledger.main(['drop', '--seconds', '0'])
    assert 'expected a number above 0' in capsys.readouterr().err

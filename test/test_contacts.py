"""What touches, told of a whole scene at once: indices, directions and forces, by any engine."""
import numpy as np
import pytest

from ragdoll_ros import (
    Bone,
    Compound,
    Cylinder,
    Ground,
    Part,
    Placement,
    Ragdoll,
    Scene,
    Simulation,
    StaticBody,
    load_scene,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import WrongForm
from ragdoll_ros.model.scene import Material
from ragdoll_ros.model.shapes import Box, Sphere
from ragdoll_ros.physics.engine.protocol import GROUND

EDGE, MASS, G = 0.2, 2.0, 9.8
BLOCK = Ragdoll('block', (Bone('block', Box((EDGE,) * 3), MASS, (0, 0, 0)),))
BALL = Ragdoll('ball', (Bone('ball', Sphere(EDGE / 2), MASS, (0, 0, 0)),))


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
def test_a_stack_and_a_ball_beside_it_bear_their_weights(engine):
    """A block on a block, 2 m from a ball that lies and one that flies: m g between the blocks,
    2 m g under the lower one, m g under the ball, nothing of the fourth.
    """
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(engine, engine))
    half = EDGE / 2
    places = [(BLOCK, (0, 0, half)), (BALL, (2, 0, 50)), (BLOCK, (0, 0, 3 * half)),
              (BALL, (2, 0, half))]
    scene = Scene('stack', tuple(Placement(doll, f'doll_{k}', place)
                                 for k, (doll, place) in enumerate(places)), Ground(),
                  Material(restitution=0))
    with Simulation(scene, engine=engine, accuracy='exact') as simulation:
        for _ in range(28):  # and before they sleep
            simulation.advance()
        found = simulation.contacts
        assert simulation.bones_on_ground.tolist() == [True, False, False, True]
    borne = {}
    for pair in {*zip(found.a.tolist(), found.b.tolist(), strict=True)}:
        own = (found.a == pair[0]) & (found.b == pair[1])
        up = found.normals[own, 2]
        assert np.abs(up) == pytest.approx(1, abs=1e-3)
        upper = pair if up.mean() > 0 else pair[::-1]
        borne[upper] = found.forces[own].sum()
        level = {(0, GROUND): 0, (2, 0): EDGE, (3, GROUND): 0}[upper]
        assert found.positions[own, 2] == pytest.approx(level, abs=2e-3)
    assert borne == pytest.approx({(0, GROUND): 2 * MASS * G, (2, 0): MASS * G,
                                   (3, GROUND): MASS * G}, rel=0.02)
    assert np.abs(found.depths).max() < 2e-3


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
def test_contacts_say_which_body_is_hit_and_bear_the_weight(engine):
    """Blocks at rest on the ground, on a table and on a slope of 0.2 rad, each on its own: forces
    of all contacts, with friction, are its weight; torques keep it from turning.
    """
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(engine, engine))
    tilt = tuple(rotation.from_axis_angle((0.0, 1.0, 0.0), 0.2))
    up = rotation.rotate(tilt, np.array((0.0, 0.0, 1.0)))
    bodies = (
        StaticBody('table', Compound((Part(Cylinder(0.05, 0.6), (0, 0, -0.4)),
                                      Part(Box((1, 1, 0.2))))), position=(3, 0, 0.7)),
        StaticBody('slope', Box((2, 2, 0.2)), (8, 0, 0.5), tilt))
    scene = Scene('three', (
        Placement(BLOCK, 'low', (0, 0, EDGE / 2)), Placement(BLOCK, 'high', (3, 0, 0.8 + EDGE / 2)),
        Placement(BLOCK, 'tilted', tuple(bodies[1].position + (0.1 + EDGE / 2) * up), tilt)),
        Ground(), Material(restitution=0, friction=0.7), bodies=bodies)
    with Simulation(scene, engine=engine, accuracy='exact') as simulation:
        simulation.run(28)  # and before they sleep
        found, centers = simulation.contacts, simulation.state.positions
    assert set(zip(found.a.tolist(), found.b.tolist(), found.bodies.tolist(), strict=True)) == {
        (0, GROUND, GROUND), (1, GROUND, 0), (2, GROUND, 1)}
    force, torque = found.wrenches[:, :3], found.wrenches[:, 3:]
    assert (force * found.normals).sum(axis=1) == pytest.approx(found.forces, abs=1e-6)
    moments = torque + np.cross(found.positions - centers[found.a], force)
    # MuJoCo's contacts are springs, which swing a little; PyBullet's blocks tremble on slopes.
    tolerance = {'rigid': 1e-4, 'bullet': 0.05, 'mujoco': 0.02}[engine] * MASS * G
    for block in range(3):
        own = found.a == block
        assert force[own].sum(axis=0) == pytest.approx((0, 0, MASS * G), abs=tolerance)
        assert moments[own].sum(axis=0) == pytest.approx((0, 0, 0), abs=tolerance * EDGE)


@pytest.mark.parametrize('engine', ['rigid', 'bullet', 'mujoco'])
def test_friction_is_in_the_wrench_of_what_slides(engine):
    """A block that slides along x: Coulomb's force against it, mu times the normal force, which is
    m g where nothing chatters.
    """
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}.get(engine, engine))
    start = Placement(BLOCK, 'block', (0, 0, EDGE / 2), velocity=(3, 0, 0))
    with Simulation(Scene('slide', (start,), Ground(), Material(restitution=0, friction=0.3)),
                    engine=engine, accuracy='exact') as simulation:
        each = []
        for _ in range(40):
            simulation.advance()
            each.append(simulation.contacts.wrenches[:, :3].sum(axis=0))
    x, y, z = np.sum(each, axis=0)
    assert z > MASS * G
    assert (x, y) == pytest.approx((-0.3 * z, 0), abs=0.01 * z)
    if engine == 'rigid':
        assert np.array(each)[:, 2] == pytest.approx(MASS * G, rel=1e-4)


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
def test_a_bounce_is_in_the_impulses(accuracy):
    """A ball that bounces on a table: in a tick m (v' - v - g t), which of a bounce is m (v- + v+),
    with v- = sqrt(2 g h) and v+ = e v-. At rest, m g a second.
    """
    pytest.importorskip('numba')
    height, restitution = 0.5, 0.5
    scene = Scene('bounce', (Placement(BALL, 'ball', (0, 0, height + EDGE / 2)),),
                  material=Material(restitution=restitution),
                  bodies=(StaticBody('table', Box((1, 1, 1)), (0, 0, -0.5)),))
    with Simulation(scene, accuracy=accuracy) as simulation:
        speeds, impulses = [0.0], [0.0]
        for _ in range(250):
            speeds.append(simulation.advance().linear_velocities[0, 2])
            impulses.append(simulation.contact_impulses[0, 2])
            if simulation.asleep:
                break
        simulation.reset()
        assert not simulation.contact_impulses.any()
    given = np.diff(impulses)
    assert given == pytest.approx(MASS * (np.diff(speeds) + G * 0.01), abs=1e-8)
    first = given[given > 0][0]
    assert first == pytest.approx(MASS * (1 + restitution) * (2 * G * height) ** 0.5, rel=1e-8)
    assert given[-2] == pytest.approx(MASS * G * 0.01, rel=1e-6)


def test_dolls_that_hit_each_other_get_opposite_impulses():
    """Two balls in the air: 1 kg m/s is handed over; a third, on its own, gets nothing."""
    pytest.importorskip('numba')
    scene = Scene('shot', (
        Placement(BALL, 'one', (0, 0, 0), velocity=(1, 0, 0)), Placement(BALL, 'two', (0.3, 0, 0)),
        Placement(BALL, 'far', (9, 0, 0))), material=Material(restitution=0), gravity=(0, 0, 0))
    with Simulation(scene) as simulation:
        simulation.run(20)
        assert simulation.contact_impulses == pytest.approx(
            np.array([(-MASS / 2, 0, 0), (MASS / 2, 0, 0), (0, 0, 0)]), abs=1e-8)


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_other_engines_say_that_they_count_no_impulses(engine):
    pytest.importorskip({'bullet': 'pybullet'}.get(engine, engine))
    with (Simulation(load_scene('drop'), engine=engine) as simulation,
          pytest.raises(WrongForm, match='rigid')):
        _ = simulation.contact_impulses


def test_what_sleeps_on_each_other_goes_on_touching_while_others_move():
    """A stack beside a ball that is thrown onto another: clusters are made anew, not theirs."""
    pytest.importorskip('numba')
    half = EDGE / 2
    scene = Scene('stack', (
        Placement(BLOCK, 'lower', (0, 0, half)), Placement(BLOCK, 'upper', (0, 0, 3 * half)),
        Placement(BALL, 'lies', (3, 0, half)), Placement(BALL, 'falls', (3, 0, 8))), Ground(),
        Material(restitution=0))
    with Simulation(scene, engine='rigid') as simulation:
        engine = simulation._engine
        for _ in range(100):
            simulation.advance()
            if engine.sleeping[:2].all():
                assert engine.cluster_of_doll[0] == engine.cluster_of_doll[1]
                found = simulation.contacts
                pairs = set(zip(found.a.tolist(), found.b.tolist(), strict=True))
                assert (1, 0) in pairs or (0, 1) in pairs
        assert engine.sleeping[:2].all() and not engine.sleeping[3]


@pytest.mark.parametrize('engine', ['rigid', 'bullet'])
def test_bones_of_one_doll_on_the_ground_are_those_of_contacts(engine):
    """In the air, as it lands, and as it lies; a joint at its limit is no contact."""
    pytest.importorskip({'rigid': 'numba', 'bullet': 'pybullet'}[engine])
    seen = set()
    with Simulation(load_scene('drop'), engine=engine, accuracy='draft') as simulation:
        for _ in range(150):
            simulation.advance()
            found, on = simulation.contacts, simulation.bones_on_ground
            assert set(np.flatnonzero(on)) == set(found.a[found.b == GROUND])
            seen.add(int(on.sum()))
    assert 0 in seen and max(seen) >= 4


def test_without_a_touch_all_arrays_are_empty():
    with Simulation(Scene('one', (Placement(BALL),))) as simulation:
        simulation.advance()
        found = simulation.contacts
    assert len(found) == 0
    assert (found.a.shape, found.positions.shape, found.forces.shape) == ((0,), (0, 3), (0,))

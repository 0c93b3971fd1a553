"""Robots of several links: drive_body() moves their joints, against MuJoCo and closed forms."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from robot_cost import ALONE, EACH_TICK, costs
from test_driven_motion import assert_repeated
from test_robot_bodies import refusal, scene

from ragdoll_ros import RagdollError, Simulation, load_scene, save_scene
from ragdoll_ros.files.run_scene import read_run_scene, run_scene_text
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.robot import Robot, RobotJoint
from ragdoll_ros.physics.logged_simulation import LoggedSimulation

pytest.importorskip('numba')

LENGTH = 0.8

PLANAR = f"""<robot name="planar"><link name="foot"/>
<link name="upper"><collision><origin xyz="{LENGTH / 2} 0 0"/>
  <geometry><box size="{LENGTH} 0.02 0.3"/></geometry></collision></link>
<link name="lower"><collision><origin xyz="0.25 0 0"/>
  <geometry><box size="0.5 0.02 0.3"/></geometry></collision></link>
<joint name="shoulder" type="continuous"><parent link="foot"/><child link="upper"/>
  <axis xyz="0 0 1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
  <origin xyz="{LENGTH} 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2"/></joint>
</robot>"""
"""An arm that turns in the plane, of two links, on one without a shape."""

SKEW = """<robot name="skew"><mujoco><compiler fusestatic="false"/></mujoco>
<link name="base"><collision><geometry><box size="0.4 0.4 0.2"/></geometry></collision></link>
<link name="mast"/>
<link name="slide"><collision><origin xyz="0.1 0 0"/><geometry><sphere radius="0.1"/></geometry>
  </collision></link>
<link name="arm"><collision><origin xyz="0.1 0.2 0" rpy="0.3 0.2 0.1"/>
  <geometry><cylinder radius="0.1" length="1"/></geometry></collision></link>
<link name="left"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<link name="right"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="post" type="fixed"><parent link="base"/><child link="mast"/>
  <origin xyz="0.1 0 0.3" rpy="0.2 -0.4 1"/></joint>
<joint name="lift" type="prismatic"><parent link="mast"/><child link="slide"/>
  <origin xyz="0 0.1 0.2" rpy="0 0.3 0"/><axis xyz="1 2 2"/><limit lower="0" upper="1"/></joint>
<joint name="waist" type="continuous"><parent link="slide"/><child link="arm"/>
  <origin xyz="0.3 0 0.1" rpy="1 2 3"/><axis xyz="1 -1 0.5"/></joint>
<joint name="thumb" type="revolute"><parent link="arm"/><child link="left"/>
  <origin xyz="0 0.2 0.5"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="finger" type="revolute"><parent link="arm"/><child link="right"/>
  <origin xyz="0 -0.2 0.5" rpy="0 0 3.14"/><axis xyz="0 1 0"/><limit lower="-3" upper="3"/>
  <mimic joint="thumb" multiplier="-2" offset="0.25"/></joint>
</robot>"""

ENTRY = '{{name: arm, urdf: r.urdf, follow: exact{}}}'
BALL = ('{{name: ball, bones: [{{name: ball, shape: {{sphere: {{radius: 0.05}}}}, mass: 0.3, '
        'position: [0, 0, 0]}}]}}, position: [{}, {}, 0]')


def robot(tmp_path, urdf=PLANAR, more='', doll=None):
    """A scene without ground and gravity of a robot, and of a doll that is far away."""
    made = scene(tmp_path, ENTRY.format(more), r_urdf=urdf,
                 doll=f'{{doll: {doll or "doll, position: [50, 0, 2]"}}}')
    return dataclasses.replace(made, ground=None, gravity=(0, 0, 0), material=dataclasses.replace(
        made.material, friction=0.0, restitution=0.5))


def links(simulation):
    """Rows (13,) of the links by their names."""
    rows = simulation.state.rows
    return {name: rows[simulation.scene.bone_index(f'{body}/{body}')]
            for name, body in simulation.scene.robots[0].links.items()}


def tip(shoulder, elbow):
    """Where the lower link begins, and how far it is turned."""
    return (LENGTH * math.cos(shoulder), LENGTH * math.sin(shoulder)), shoulder + elbow


def yaw(row):
    return rotation.rotation_vector(row[3:7])[2]


def assert_as_mujoco_places(found, place, lift=0.0, waist=0.0, thumb=0.0):
    """The rows of the links of SKEW, whose frame is at a pose."""
    mujoco = pytest.importorskip('mujoco')
    model = mujoco.MjModel.from_xml_string(SKEW)
    data = mujoco.MjData(model)
    values = {'lift': lift, 'waist': waist, 'thumb': thumb, 'finger': -2 * thumb + 0.25}
    for name, value in values.items():
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    assert list(found) == ['base', 'slide', 'arm', 'left', 'right']
    for name, row in found.items():
        # MuJoCo fuses the root with its world.
        theirs = Pose() if name == 'base' else Pose(
            data.body(name).xpos, rotation.from_matrix(data.body(name).xmat.reshape(3, 3)))
        expected = place.compose(theirs)
        assert row[:3] == pytest.approx(expected.position, abs=1e-12)
        assert rotation.angle_between(row[3:7], expected.orientation) < 1e-9


def test_links_are_where_mujoco_places_them(tmp_path):
    values = {'lift': 0.4, 'waist': 2.5, 'thumb': 0.6}
    place = Pose(np.array((1.0, 2.0, 3.0)), rotation.from_rpy(0.5, -0.2, 2.0))
    with Simulation(robot(tmp_path, SKEW)) as simulation:
        for _ in range(2):
            simulation.drive_body('arm', np.concatenate(place), joint_angles=values)
            simulation.advance()
        assert simulation.body_pose('arm') == pytest.approx(np.concatenate(place), abs=1e-12)
        assert_as_mujoco_places(links(simulation), place, **values)
        # It follows what moves on within a tick.
        turned = {'lift': 0.41, 'waist': 2.53, 'thumb': 0.55}
        simulation.drive_body('arm', joint_angles=turned, rates={'waist': 2.0, 'thumb': -3.0})
        simulation.run(3)
        assert_as_mujoco_places(links(simulation), place, lift=0.41, waist=2.59, thumb=0.46)


def test_at_the_start_links_are_at_the_angles_of_the_scene(tmp_path):
    made = robot(tmp_path, SKEW, ', position: [1, 2, 3], angles_deg: {thumb: 20, waist: -50}')
    with Simulation(made) as simulation:
        assert_as_mujoco_places(links(simulation), Pose(np.array((1.0, 2.0, 3.0))),
                                waist=math.radians(-50), thumb=math.radians(20))
        before = simulation.state.rows[-5:].copy()
        # Orientations are normalised once.
        assert simulation.run(30)[-1, -5:] == pytest.approx(before, abs=1e-15)
        assert simulation.stale_bodies == ('arm',)


def test_joints_turn_links_along_their_arcs(tmp_path):
    """Also within a tick; then they stand, and the robot is stale."""
    with Simulation(robot(tmp_path)) as simulation:
        simulation.samples_per_tick = 4
        simulation.drive_body('arm', joint_angles={'elbow': 0.05},
                              rates={'shoulder': 3, 'elbow': 2})
        for tick in range(1, 31):
            simulation.advance()
            for part, state in enumerate(simulation.substates):
                time = min(0.01 * (tick - 1 + part / 4), 0.2)
                # The elbow gets where it was told to be at the end of the first tick.
                elbow = 7 * time if time < 0.01 else 0.05 + 2 * time
                place, turn = tip(3 * time, elbow)
                upper, lower = state.rows[-2:]
                assert yaw(upper) == pytest.approx(3 * time, abs=1e-9)
                assert np.abs(upper[:3]).max() < 1e-12, 'it turns about the joint'
                assert lower[:2] == pytest.approx(place, abs=1e-9)
                assert yaw(lower) == pytest.approx(turn, abs=1e-9)
            assert simulation.stale_bodies == (('arm',) if tick >= 20 else ())
        assert not simulation.state.rows[-2:, 7:].any()
        assert simulation.measures()['body_jumps_total'] == 0


@pytest.mark.parametrize('accuracy', ['draft', 'normal', 'exact'])
@pytest.mark.parametrize('w', [3.0, 30.0])
def test_a_ball_leaves_an_arm_by_the_speed_of_its_point(tmp_path, accuracy, w):
    """At the distance d from the axis that is w d, times 1 + e; a motor does m v v' of work."""
    e, mass, distance, radius = 0.5, 0.3, 0.7, 0.05
    made = robot(tmp_path, doll=BALL.format(0, distance), more=', restitution: 0.5')
    with Simulation(made, accuracy=accuracy) as simulation:
        while not simulation.kinetic_energy:
            simulation.drive_body('arm', rates={'shoulder': w})
            row = simulation.advance().rows[0]
        excess, (work, _) = simulation.energy_excess, simulation.work
    sine = (radius + 0.01) / distance
    speed, turned = w * distance * math.sqrt(1 - sine ** 2), math.pi / 2 - math.asin(sine)
    assert row[7:9] == pytest.approx((-(1 + e) * speed * math.sin(turned),
                                      (1 + e) * speed * math.cos(turned)), rel=1e-8)
    assert work == pytest.approx(mass * (1 + e) * speed ** 2, rel=1e-8)
    assert excess == pytest.approx(-mass * (1 - e * e) * speed ** 2 / 2, rel=1e-8)


def test_the_frame_and_the_joints_move_on_by_themselves(tmp_path):
    """What a call does not name keeps its motion until 0.2 s after its own; then it is stale."""
    with Simulation(robot(tmp_path)) as simulation:
        simulation.drive_body('arm', twist=(1, 0, 0, 0, 0, 0))
        for tick in range(40):
            if tick % 10 == 0:
                simulation.drive_body('arm', rates={'elbow': 1.0})
            simulation.drive_body('arm', joint_angles={'shoulder': 0.01 * tick},
                                  rates={'shoulder': 1.0})
            simulation.advance()
            assert simulation.stale_bodies == (('arm',) if tick >= 19 else ()), tick
        upper, lower = simulation.state.rows[-2:]
        assert upper[:3] == pytest.approx((0.2, 0, 0), abs=1e-12)
        assert (yaw(upper), yaw(lower)) == pytest.approx((0.4, 0.8), abs=1e-9)
        # The frame stops, the joints go on.
        simulation.drive_body('arm')
        assert simulation.stale_bodies == ()
        simulation.advance()
        assert yaw(simulation.state.rows[-2]) == pytest.approx(0.41, abs=1e-9)
        # A link that a joint carries moves as the frame turns: its origin is off the axis.
        simulation.drive_body('arm', (0, 0, 0, 0, 0, 0, 1), (0, 0, 0, 0, 0, 2.0))
        simulation.run(10)
        # Until then the shoulder turned by 0.09 rad more.
        place, _ = tip(0.41 + 0.1 + 0.2, 0)
        assert simulation.state.rows[-1, :2] == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize('rate', [1000, 50, 5])
def test_it_goes_on_evenly_however_often_it_is_told(tmp_path, rate):
    with Simulation(robot(tmp_path)) as simulation:
        for tick in range(60):
            for _ in range(max(1, rate // 100) if tick % max(1, 100 // rate) == 0 else 0):
                simulation.drive_body('arm', joint_angles={'shoulder': 0.02 * tick},
                                      rates={'shoulder': 2.0})
            row = simulation.advance().rows[-2]
            assert yaw(row) == pytest.approx(0.02 * (tick + 1), abs=1e-9)
            assert row[12] == pytest.approx(2, abs=1e-6)
        assert simulation.measures()['body_jumps_total'] == 0


def test_a_continuous_joint_takes_the_shorter_way(tmp_path):
    """Encoders wrap at half a turn."""
    with Simulation(robot(tmp_path)) as simulation:
        simulation.drive_body('arm', joint_angles={'shoulder': 3.13})
        simulation.advance()
        simulation.drive_body('arm', joint_angles={'shoulder': 3.16 - 2 * math.pi})
        row = simulation.advance().rows[-2]
        assert row[12] == pytest.approx(3.0, abs=1e-9)
        assert simulation.measures()['body_jumps_total'] == 0


def test_jumps_are_counted_and_give_no_blow(tmp_path):
    """The first values may be anywhere. Then one that takes a link through a ball does not hit."""
    made = robot(tmp_path, doll=BALL.format(0, 0.7))
    with Simulation(made) as simulation:
        simulation.drive_body('arm', joint_angles={'shoulder': 1.0})
        assert yaw(simulation.state.rows[-2]) == pytest.approx(1.0)
        simulation.advance()
        assert simulation.measures()['body_jumps_total'] == 0
        simulation.drive_body('arm', joint_angles={'shoulder': 2.5})
        rows = simulation.run(20)
        assert simulation.measures()['body_jumps_total'] == 1
        assert yaw(rows[0, -2]) == pytest.approx(2.5)
        assert not rows[:, :, 7:].any()
        place, _ = tip(2.5, 0)
        assert rows[-1, -1, :2] == pytest.approx(place, abs=1e-12)


def test_its_links_do_not_collide_with_each_other(tmp_path):
    """Folded into itself, with a ball in reach of both links: only the ball is touched."""
    made = robot(tmp_path, doll=BALL.format(0.3, 0.06))
    with Simulation(made) as simulation:
        for _ in range(60):
            simulation.drive_body('arm', rates={'shoulder': 0.5, 'elbow': 5.0})
            simulation.advance()
            contacts = simulation.contacts
            assert all(0 in pair for pair in zip(contacts.a, contacts.b, strict=True))
        assert simulation.kinetic_energy > 0, 'they hit the ball'
        _, turn = tip(0.3, 3.0)
        assert yaw(simulation.state.rows[-1]) == pytest.approx(turn - 2 * math.pi, abs=1e-9)


def test_events_repeat_it_to_the_bit(tmp_path):
    """An arm on the move knocks over a doll; joint states stop, jump and come again."""
    more = ', position: [-0.9, 0.3, 0.3], angles_deg: {shoulder: -90}'
    made = scene(tmp_path, ENTRY.format(more), r_urdf=PLANAR,
                 doll='{doll: doll, position: [0, 0, 0.05]}')
    log, runs = [], []
    with LoggedSimulation(made) as simulation:
        simulation.on_event = lambda name, arguments: log.append((simulation.time, name, arguments))
        for tick in range(90):
            if tick % 4 == 0 and not 40 < tick < 70:
                simulation.drive_body('arm', joint_angles={'shoulder': -1.5 + 0.03 * tick},
                                      rates={'shoulder': 3.0, 'elbow': -0.5})
            if tick % 10 == 0:
                simulation.drive_body('arm', twist=(0.5, 0, 0, 0, 0, 0.3))
            if tick == 80:
                simulation.drive_body('arm', (-1, 1, 0.3, 0, 0, 0, 1))
            runs.append(simulation.advance().rows.copy())
        assert simulation.work[0] > 0.1, 'it met the doll'
        assert simulation.measures()['body_jumps_total'] == 2
    read, _ = read_run_scene(run_scene_text(made))
    for again in (made, read):
        with Simulation(again) as simulation:
            for start in range(2):
                if start:
                    simulation.reset()
                assert_repeated(simulation, log, runs)


def test_dolls_come_and_go_while_it_moves(tmp_path):
    made = robot(tmp_path)
    with Simulation(made) as simulation:
        other = dataclasses.replace(made.dolls[0], name='other', position=(60, 0, 2))
        simulation.drive_body('arm', rates={'shoulder': 2.0})
        simulation.run(5)
        simulation.add(other)
        simulation.remove('doll')
        simulation.run(5)
        assert yaw(links(simulation)['upper']) == pytest.approx(0.2, abs=1e-9)
        here = simulation.checkpoint()
        ahead = simulation.run(5)
        simulation.go_back(here)
        # A new engine, and the same motion.
        assert simulation.run(5) == pytest.approx(ahead, abs=1e-12)


@pytest.mark.slow
def test_a_robot_of_8_links_that_moves_costs_at_most_half_a_doll():
    found = costs()
    assert found[EACH_TICK] / found[ALONE] <= 1.5, found


def test_a_scene_with_robots_is_written_and_read(tmp_path):
    made = scene(tmp_path, ENTRY.format(
        ', orientation: [0, 0, 0.6, 0.8], friction: 0.3, color: [1, 0, 0, 1], without: [left], '
        'angles_deg: {thumb: 20}, repeat: {count: 2, shift: [3, 0, 0]}'), r_urdf=SKEW)
    assert [own.name for own in made.robots] == ['arm_1', 'arm_2']
    assert made.robots[1].links['slide'] == 'arm_2_slide'
    assert made.robots[1].position == (3, 0, 0)
    (tmp_path / 'elsewhere').mkdir()
    save_scene(made, tmp_path / 'elsewhere/saved.yaml')
    (tmp_path / 'r.urdf').unlink()
    assert load_scene(str(tmp_path / 'elsewhere/saved.yaml')) == made
    read, _ = read_run_scene(run_scene_text(made))
    assert read == made


def test_an_sdf_moves_as_its_urdf(tmp_path):
    sdf = """<sdf version="1.9"><model name="planar"><link name="foot"/>
        <link name="upper"><collision name="c"><geometry><sphere><radius>0.1</radius></sphere>
        </geometry></collision></link>
        <joint name="slide" type="prismatic"><parent>foot</parent><child>upper</child>
        <axis><xyz>0 0.6 0.8</xyz></axis></joint></model></sdf>"""
    made = scene(tmp_path, '{name: arm, sdf: m.sdf, follow: exact}', m_sdf=sdf)
    with Simulation(made) as simulation:
        simulation.drive_body('arm', rates={'slide': 0.5})
        simulation.run(20)
        assert simulation.state.positions[-1] == pytest.approx((0, 0.06, 0.08), abs=1e-9)


@pytest.mark.parametrize(('arguments', 'told'), [
    ({'joint_angles': {'hip': 1.0}}, "joint_angles.hip: UnknownJoint: 'hip'; expected one of "
     'shoulder, elbow'),
    ({'rates': {'elbow': math.nan}}, 'rates.elbow: NotFinite'),
    ({'rates': {'elbow': 2e3}}, 'rates.elbow: OutOfRange'),
    ({'joint_angles': {'elbow': math.inf}}, 'joint_angles.elbow: NotFinite'),
    ({'joint_angles': {'elbow': 'up'}}, 'joint_angles.elbow: WrongForm'),
    ({'joint_angles': {'elbow': 1e9}}, 'joint_angles.elbow: OutOfRange'),
    ({'joint_angles': [1.0, 2.0]}, 'joint_angles: WrongForm'),
    ({'pose': (0, 0, 0), 'rates': {'elbow': 1.0}}, 'pose: WrongForm'),
    ({'twist': (0, 0, math.nan, 0, 0, 0), 'rates': {'elbow': 1.0}}, 'twist: NotFinite'),
    ({'name': 'arm_upper'}, "name: UnknownDoll: 'arm_upper'; expected one of arm")])
def test_a_wrong_motion_is_refused_and_nothing_changes(tmp_path, arguments, told):
    with Simulation(robot(tmp_path)) as simulation:
        before = simulation.state.rows.copy()
        with pytest.raises(RagdollError) as error:
            simulation.drive_body(**{'name': 'arm', **arguments})
        assert told in str(error.value)
        assert simulation.stale_bodies == ('arm',)
        assert np.array_equal(simulation.run(3)[-1], before)


def test_only_a_robot_has_joints(tmp_path):
    made = scene(tmp_path, '{name: box, shape: {sphere: {radius: 0.1}}, follow: exact}')
    with Simulation(made) as simulation, pytest.raises(RagdollError, match='box is no robot'):
        simulation.drive_body('box', rates={})


def test_a_link_is_set_and_removed_by_nobody(tmp_path):
    with Simulation(robot(tmp_path)) as simulation:
        with pytest.raises(errors.WrongForm, match=r'drive_body\(\) moves the robot arm'):
            simulation.set_state('arm_upper', (0, 0, 1))
        with pytest.raises(errors.WrongForm, match=r'links\.upper'):
            simulation.remove('arm_upper')


@pytest.mark.parametrize(('entry', 'urdf', 'said'), [
    ('follow: {max_force: 30, max_torque: 3}', PLANAR, '.follow: WrongForm: '),
    ('follow: exact, mass: 3', PLANAR, '.mass: WrongForm: 3; expected none'),
    ('follow: exact, velocity: [1, 0, 0]', PLANAR, '.velocity: WrongForm'),
    ('follow: exact', PLANAR.replace('<box size="0.5 0.02 0.3"/>', '<plane normal="0 0 1"/>'),
     ".link lower: WrongForm: 'a plane'; expected a box, sphere, cylinder or capsule, or "),
    ('follow: exact', SKEW.replace('joint="thumb"', 'joint="toe"'),
     ".joint finger.mimic: UnknownJoint: 'toe'"),
    ('follow: exact', SKEW.replace('joint="thumb"', 'joint="finger"'),
     '.joint finger.mimic: JointCycle'),
    ('angles_deg: {finger: 3}', SKEW, ".angles_deg.finger: UnknownJoint: 'finger'")])
def test_what_is_wrong_in_a_scene_is_named(tmp_path, entry, urdf, said):
    assert said in refusal(tmp_path, f'{{name: arm, urdf: r.urdf, {entry}}}', r_urdf=urdf)


@pytest.mark.parametrize(('joints', 'links', 'said'), [
    ([('a', 'x', 'y'), ('a', 'y', 'z')], {'x': 'b'}, 'joints[1].name: DuplicateName'),
    ([('a', 'x', 'y'), ('b', 'z', 'y')], {'x': 'b'}, 'joints[1].child: ConnectedTwice'),
    ([('a', 'x', 'y'), ('b', 'y', 'x')], {'x': 'b'}, 'joints[1]: JointCycle'),
    ([], {}, 'links: WrongForm')])
def test_a_robot_is_a_tree(joints, links, said):
    with pytest.raises(errors.ModelError) as error:
        Robot('r', tuple(RobotJoint(name, 'revolute', parent, child)
                         for name, parent, child in joints), links)
    assert said in str(error.value)

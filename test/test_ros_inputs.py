"""What comes in on the topics that push: taken, clamped, refused, counted."""
from __future__ import annotations

import math
import time

import pytest
from geometry_msgs.msg import Twist, Vector3, Wrench, WrenchStamped
from std_msgs.msg import Header

from ragdoll_ros.model.vectors import clamp_norm
from ragdoll_ros.ros.inputs.subscriptions import TORQUE_ARM

HUGE = 1.7e308
BAD = (math.nan, math.inf, -math.inf)


def wrench(force=(0, 0, 0), torque=(0, 0, 0)):
    return Wrench(force=vector(force), torque=vector(torque))


def vector(values):
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def stamped(frame, force=(0, 0, 0), torque=(0, 0, 0)):
    return WrenchStamped(header=Header(frame_id=frame), wrench=wrench(force, torque))


def twist(linear=(0, 0, 0), angular=(0, 0, 0)):
    return Twist(linear=vector(linear), angular=vector(angular))


@pytest.fixture
def node(make_node):
    return make_node(scene='flight', max_force=5000.0)


@pytest.fixture
def inputs(node):
    return node.inputs


@pytest.mark.parametrize('values', [(3, 4, 0), (HUGE, HUGE, -HUGE), (5e-324, 0, 0), (1e300, 1, 0)])
def test_a_shortened_vector_keeps_its_direction_and_is_as_long_as_it_may(values):
    result, _ = clamp_norm(values, 10.0)
    largest = max(map(abs, values))
    length = math.hypot(*result)
    wanted = math.hypot(*(value / largest for value in values)) * largest
    assert length == pytest.approx(min(wanted, 10.0), rel=1e-12)
    for one, other in zip(result, values, strict=True):
        assert one * largest == pytest.approx(other * max(map(abs, result)), rel=1e-9)


def test_force_pushes_the_pushed_bone_in_world_axes(node, inputs):
    inputs.on_force(wrench((1, 2, 3), (4, 5, 6)))
    push, = node.simulation.pushes
    assert (push.bone, push.local, push.duration) == ('torso', False, 0.1)
    assert (push.force, push.torque) == ((1, 2, 3), (4, 5, 6))


def test_the_next_force_takes_the_place_of_the_last_and_zero_ends_it(node, inputs):
    inputs.on_force(wrench((1, 0, 0)))
    inputs.on_force(wrench((0, 2, 0)))
    assert [push.force for push in node.simulation.pushes] == [(0, 2, 0)]
    inputs.on_force(wrench())
    assert node.simulation.pushes == ()


def test_a_velocity_drives_the_pushed_bone_to_it_and_no_further(make_node):
    node = make_node(scene='flight', cmd_vel_timeout=1.0, pushed_bone='head')
    node.inputs.on_cmd_vel(twist((0.5, 0, 0), (0, 0, -1)))
    push, = node.simulation.pushes
    assert (push.bone, push.duration) == ('head', 1.0)
    for _ in range(30):
        node.tick()
    state, head = node.simulation.state, node.simulation.scene.bone_index('head')
    # A tenth: the body that hangs on the head pulls at it.
    assert state.linear_velocities[head] == pytest.approx((0.5, 0, 0), abs=0.05)
    assert state.angular_velocities[head] == pytest.approx((0, 0, -1), abs=0.1)


def test_gains_limits_and_time_out_of_a_velocity_are_those_of_the_parameters(make_node):
    node = make_node(scene='flight', force_per_speed=200.0, torque_per_speed=7.0,
                     cmd_vel_timeout=0.25, max_force=150.0)
    node.inputs.on_cmd_vel(twist((0.5, 0, 0), (0, 0, -1)))
    push, = node.simulation.pushes
    assert (push.force, push.torque, push.duration) == ((100, 0, 0), (0, 0, -7), 0.25)
    node.inputs.on_cmd_vel(twist((5, 0, 0), (0, 0, -9)))
    push, = node.simulation.pushes
    assert push.force == pytest.approx((150, 0, 0))
    assert push.torque == pytest.approx((0, 0, -150 * TORQUE_ARM))
    for _ in range(26):
        node.tick()
    assert node.simulation.pushes == ()


def test_a_velocity_of_zero_lets_go(node, inputs):
    inputs.on_cmd_vel(twist((1, 0, 0)))
    inputs.on_cmd_vel(twist())
    assert node.simulation.pushes == ()


@pytest.mark.parametrize('frame, bone, local', [
    ('world', 'torso', False), ('left_shin', 'left_shin', True), ('torso', 'torso', True)])
def test_push_names_a_frame(node, inputs, frame, bone, local):
    inputs.on_push(stamped(frame, (10, 0, 0)))
    push, = node.simulation.pushes
    assert (push.bone, push.local) == (bone, local)


def test_pushes_on_several_inputs_and_bones_act_at_once(node, inputs):
    inputs.on_force(wrench((1, 0, 0)))
    inputs.on_cmd_vel(twist((1, 0, 0)))
    for frame in ('world', *node.simulation.scene.bone_names):
        inputs.on_push(stamped(frame, (1, 0, 0)))
    assert len(node.simulation.pushes) == 13
    inputs.on_push(stamped('head'))
    assert len(node.simulation.pushes) == 12


def test_the_configured_frame_stands_for_the_world(make_node):
    node = make_node(frame_id='map')
    node.inputs.on_push(stamped('map', (1, 0, 0)))
    assert not node.simulation.pushes[0].local


@pytest.mark.parametrize('bad', BAD)
@pytest.mark.parametrize('place', range(6))
def test_what_is_not_finite_is_refused_on_every_input(node, inputs, bad, place):
    values = [1.0] * 6
    values[place] = bad
    first, second = values[:3], values[3:]
    inputs.on_force(wrench(first, second))
    inputs.on_cmd_vel(twist(first, second))
    for frame in ('world', 'head'):
        inputs.on_push(stamped(frame, first, second))
    assert node.simulation.pushes == ()
    assert node.input_counts.refused == {'~/force': 1, 'cmd_vel': 1, '~/push': 2}
    assert 'NotFinite' in node.input_counts.last_reason
    assert str(bad) in node.input_counts.last_reason


@pytest.mark.parametrize('huge', [1e300, -1e300, HUGE])
def test_what_is_too_strong_is_clamped_to_its_direction(node, inputs, huge):
    inputs.on_force(wrench((huge, 0, huge), (0, huge, 0)))
    inputs.on_cmd_vel(twist((huge, 0, 0)))
    force, speed = node.simulation.pushes
    side = math.copysign(5000 / math.sqrt(2), huge)
    assert force.force == pytest.approx((side, 0, side))
    assert force.torque == pytest.approx((0, math.copysign(5000 * TORQUE_ARM, huge), 0))
    assert speed.force == pytest.approx((math.copysign(2000, huge), 0, 0))
    assert node.input_counts.clamped == {'~/force': 2, 'cmd_vel': 1}
    for _ in range(50):
        node.tick()
    assert node.input_counts.refused == {}


@pytest.mark.parametrize('frame', ['', 'tail', 'World', 'torso ', 'x' * 10000, '\u2603'])
def test_an_unknown_frame_is_refused_and_the_known_ones_named(node, inputs, frame):
    inputs.on_push(stamped(frame, (1, 0, 0)))
    assert node.simulation.pushes == ()
    assert node.input_counts.refused == {'~/push': 1}
    assert 'one of world, torso, head' in node.input_counts.last_reason


def test_a_flood_does_not_pile_up(node, inputs):
    for count in range(3000):
        inputs.on_push(stamped('head', (count + 1, 0, 0)))
        inputs.on_force(wrench((count + 1, 0, 0)))
    assert [push.force[0] for push in node.simulation.pushes] == [3000, 3000]
    assert node.input_counts.refused == {}


def test_a_queue_that_is_full_refuses(node, inputs):
    from ragdoll_ros.model.push import Push
    from ragdoll_ros.physics.actions.push_queue import MAX_PUSHES
    for _ in range(MAX_PUSHES):
        node.simulation.push(Push('head', (1, 0, 0), start=1.0))
    inputs.on_force(wrench((1, 0, 0)))
    assert node.input_counts.refused == {'~/force': 1}
    assert 'at most 1000' in node.input_counts.last_reason


def test_warnings_come_once_a_second_at_the_most(node, inputs, capfd):
    for _ in range(200):
        inputs.on_force(wrench((math.nan, 0, 0)))
    assert node.input_counts.refused == {'~/force': 200}
    assert 1 <= capfd.readouterr().err.count('~/force refused') <= 2


def test_how_old_the_last_refusal_is_grows_until_the_next(node, inputs):
    before = time.monotonic()
    assert math.isnan(node.input_counts.last_reason_age)
    inputs.on_force(wrench((math.nan, 0, 0)))
    first = node.input_counts.last_reason_age
    second = node.input_counts.last_reason_age
    assert 0 <= first < second <= time.monotonic() - before
    inputs.on_force(wrench((math.nan, 0, 0)))
    assert node.input_counts.last_reason_age < time.monotonic() - before - first

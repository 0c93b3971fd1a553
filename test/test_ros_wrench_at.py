"""~/wrench_at: forces at points of bones, in axes that the message names, or a refusal."""
from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import Transform, Vector3, Wrench
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Header


def vector(values):
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def message(frame='world', bones=('left_shin',), points=((0, 0, -0.1),), forces=((-300, 0, 0),),
            torques=None):
    torques = torques or [(0, 0, 0)] * len(forces)
    return MultiDOFJointState(
        header=Header(frame_id=frame), joint_names=list(bones),
        transforms=[Transform(translation=vector(point)) for point in points],
        wrench=[Wrench(force=vector(force), torque=vector(torque))
                for force, torque in zip(forces, torques, strict=True)])


@pytest.fixture
def node(make_node):
    return make_node(scene='flight', max_force=5000.0)


@pytest.mark.parametrize(('frame', 'local'), [('world', False), ('left_shin', True)])
def test_the_frame_names_the_axes_of_point_force_and_torque(node, frame, local):
    node.inputs.on_wrench_at(message(frame, torques=[(1, 2, 3)]))
    push, = node.simulation.pushes
    assert (push.bone, push.local, push.duration) == ('left_shin', local, 0.1)
    assert (push.point, push.force, push.torque) == ((0, 0, -0.1), (-300, 0, 0), (1, 2, 3))
    node.inputs.on_wrench_at(message(frame, forces=[(0, 0, 0)]))
    assert node.simulation.pushes == ()


def test_the_moment_about_the_centre_is_that_of_the_lever(make_node, tmp_path):
    """A free box for one tick: its angular momentum is lever times force times time."""
    (tmp_path / 'box.yaml').write_text(
        'name: box\nbones: [{name: box, shape: {box: {size: [.2, .4, .6]}}, mass: 3,'
        ' position: [0, 0, 1]}]\njoints: []\n')
    (tmp_path / 'free.yaml').write_text('name: free\ngravity: [0, 0, 0]\nstep: .001\n'
                                        'ground: null\ndolls: [{doll: box.yaml}]\n')
    node = make_node(scene=str(tmp_path / 'free.yaml'))
    node.inputs.on_wrench_at(message('world', ['box'], [(0.1, 0.2, 0)], [(0, 0, 50)]))
    node.tick()
    inertia = 3 / 12 * np.array([0.4 ** 2 + 0.6 ** 2, 0.2 ** 2 + 0.6 ** 2, 0.2 ** 2 + 0.4 ** 2])
    spin = np.cross((0.1, 0.2, 0), (0, 0, 50)) * 0.001 / inertia
    # It turns by 1e-5 rad meanwhile, which is the relative error of the torque taken as constant.
    np.testing.assert_allclose(node.simulation.state.angular_velocities[0], spin, rtol=0,
                               atol=1e-4 * np.abs(spin).max())


def test_one_message_pushes_several_bones(node):
    node.inputs.on_wrench_at(message('world', ['head', 'left_shin'], [(0, 0, 0)] * 2,
                                     [(1, 0, 0), (0, 2, 0)]))
    assert {push.bone: push.force for push in node.simulation.pushes} == {
        'head': (1, 0, 0), 'left_shin': (0, 2, 0)}


@pytest.mark.parametrize(('wrong', 'text'), [
    ({'bones': ['tail']}, "joint_names[0]: UnknownBone: 'tail'; expected one of torso"),
    ({'frame': ''}, "header.frame_id: WrongForm: ''; expected world or left_shin"),
    ({'frame': 'head'}, "header.frame_id: WrongForm: 'head'; expected world or left_shin"),
    ({'points': []}, 'transforms: WrongForm: 0; expected as many as joint_names, 1'),
    ({'forces': [(1, 0, 0)] * 2}, 'wrench: WrongForm: 2; expected as many as joint_names, 1'),
    ({'points': [(0, 0, 2)]}, 'transforms[0].translation: OutOfRange'),
    ({'points': [(0, math.nan, 0)]}, 'transforms[0].translation'),
    ({'forces': [(0, math.inf, 0)]}, 'wrench[0].force')])
def test_what_is_wrong_is_refused_as_a_whole(node, wrong, text):
    node.inputs.on_wrench_at(message(**wrong))
    assert node.simulation.pushes == () and node.input_counts.refused == {'~/wrench_at': 1}
    assert text in node.input_counts.last_reason


def test_what_is_too_strong_is_clamped_and_told_with_its_limit(node):
    node.inputs.on_wrench_at(message(torques=[(0, 900, 0)]))
    assert node.simulation.pushes[0].torque == pytest.approx((0, 500, 0))
    assert node.input_counts.last_reason == (
        '~/wrench_at clamped: wrench[0].torque of 900 to 0.1 m times max_force, 500')


def test_the_line_in_the_reference_is_understood(node):
    text = (Path(__file__).parent.parent / 'docs/reference.md').read_text()
    given = yaml.safe_load(re.search(r"/ragdoll/wrench_at \S+ \\\s+'([^']*)'", text)[1])
    node.inputs.on_wrench_at(message(
        given['header']['frame_id'], given['joint_names'],
        [(0, 0, given['transforms'][0]['translation']['z'])],
        [(given['wrench'][0]['force']['x'], 0, 0)]))
    assert node.simulation.pushes[0].force == (-300, 0, 0) and not node.input_counts.refused

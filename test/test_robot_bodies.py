"""Bodies of a scene from the links of a URDF or SDF, against scenes written by hand and Bullet."""
from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from ragdoll_ros import Box, Compound, Plane, Simulation, load_scene, save_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.errors import ModelErrors
from ragdoll_ros.model.pose import Pose

ARM = """<robot name="arm">
<link name="base"><collision><origin xyz="0 0 0.25"/><geometry><box size="1 0.5 0.5"/></geometry>
  </collision></link>
<link name="upper"><collision><origin xyz="0.1 0 0.5" rpy="0.3 0 0.2"/>
  <geometry><cylinder radius="0.1" length="1"/></geometry></collision></link>
<link name="lower"><collision><geometry><sphere radius="0.125"/></geometry></collision>
  <collision><origin xyz="0 0 0.4"/><geometry><capsule radius="0.05" length="0.5"/></geometry>
  </collision></link>
<link name="flag"><visual><geometry><box size="9 9 9"/></geometry></visual></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
  <origin xyz="0 0.1 0.5" rpy="0 0 0.5"/><axis xyz="0 1 0"/><limit lower="-1" upper="2"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
  <origin xyz="0 0 1"/><axis xyz="1 1 0"/><limit lower="0.25" upper="1.5"/></joint>
<joint name="pole" type="fixed"><parent link="lower"/><child link="flag"/></joint>
</robot>"""

SDF = """<sdf version="{version}"><world name="w"><model name="arm"><pose>0 0 1 0 0 0</pose>
<link name="base"><collision name="c"><pose>0 0 0.25 0 0 0</pose>
  <geometry><box><size>1 0.5 0.5</size></box></geometry></collision></link>
<link name="upper"><pose relative_to="shoulder"/><collision name="c">
  <pose degrees="true">0.1 0 0.5 {roll} 0 {yaw}</pose>
  <geometry><cylinder><radius>0.1</radius><length>1</length></cylinder></geometry></collision></link>
<model name="hand"><pose relative_to="crook"/>
  <link name="lower"><collision name="c"><geometry><sphere>
  <radius>0.125</radius></sphere></geometry></collision>
  <collision name="d"><pose>0 0 0.4 0 0 0</pose><geometry><capsule>
  <radius>0.05</radius><length>0.5</length></capsule></geometry></collision></link>
</model>
<frame name="crook" attached_to="upper"><pose>0 0 1 0 0 0</pose></frame>
<joint name="shoulder" type="revolute"><parent>base</parent><child>upper</child>
  <pose relative_to="base">0 0.1 0.5 0 0 0.5</pose>
  <axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint>
<joint name="elbow" type="revolute"><parent>crook</parent><child>hand::lower</child>
  <axis><xyz expressed_in="crook">1 1 0</xyz><limit><lower>0.25</lower><upper>1.5</upper></limit>
  </axis></joint>
</model>
<model name="ground_plane"><link name="plane"><collision name="c"><geometry><plane/></geometry>
  </collision></link></model>
<include><uri>model://sun</uri></include></world></sdf>"""


def written(tmp_path, *bodies, doll='{doll: doll, position: [0, 0, 2]}', **files):
    for name, text in files.items():
        (tmp_path / name.replace('_', '.')).write_text(text)
    file = tmp_path / 'scene.yaml'
    file.write_text(f'ground: {{}}\nmaterial: {{friction: 0.2}}\ndolls: [{doll}]\n'
                    f'bodies: [{", ".join(bodies)}]\n')
    return file


def scene(tmp_path, *bodies, **files):
    return load_scene(str(written(tmp_path, *bodies, **files)))


def refusal(tmp_path, *bodies, **files):
    with pytest.raises(ModelErrors) as caught:
        scene(tmp_path, *bodies, **files)
    return str(caught.value)


def test_a_file_moves_a_doll_to_the_bit_as_the_same_bodies_by_hand(tmp_path):
    pytest.importorskip('numba')
    angle = 0.25
    slope = f"""<robot name="r"><link name="slope"><collision>
        <origin xyz="0.25 0 0.5" rpy="0 {angle} 0"/><geometry><box size="4 2 0.125"/></geometry>
        </collision></link></robot>"""
    sine, cosine = math.sin(angle / 2), math.cos(angle / 2)
    by_hand = ('{name: s_slope, shape: {box: {size: [4, 2, 0.125]}}, position: [1.25, 0, 0.5], '
               f'orientation: [0, {sine}, 0, {cosine}], friction: 0.1}}')
    ball = ('{doll: {name: ball, bones: [{name: ball, shape: {sphere: {radius: 0.1}}, mass: 1, '
            'position: [0, 0, 0]}]}, position: [0.5, 0, 1.2], velocity: [0.1, 0, 0]}')
    states = []
    for body in ('{name: s, urdf: r.urdf, position: [1, 0, 0], friction: 0.1}', by_hand):
        made = scene(tmp_path, body, doll=ball, r_urdf=slope)
        with Simulation(made) as simulation:
            states.append(simulation.run(80))
    assert states[0].tobytes() == states[1].tobytes()
    x, _, z = states[0][-1, 0, :3]
    # Half the board and a radius above its middle plane; it may still bounce a little.
    above = (z - 0.5) * math.cos(angle) + (x - 1.25) * math.sin(angle)
    assert above == pytest.approx(0.0625 + 0.1, abs=1e-4)


def test_links_are_where_bullet_places_them(tmp_path):
    pybullet = pytest.importorskip('pybullet')
    made = scene(tmp_path, '{name: a, urdf: r.urdf, angles_deg: {shoulder: 40, elbow: 70}}',
                 r_urdf=ARM)
    client = pybullet.connect(pybullet.DIRECT)
    try:
        robot = pybullet.loadURDF(str(tmp_path / 'r.urdf'), useFixedBase=True,
                                  physicsClientId=client)
        for joint, degrees in ((0, 40), (1, 70)):
            pybullet.resetJointState(robot, joint, math.radians(degrees), physicsClientId=client)
        states = [pybullet.getLinkState(robot, joint, computeForwardKinematics=True,
                                        physicsClientId=client)[4:6] for joint in (0, 1)]
    finally:
        pybullet.disconnect(client)
    bodies = {body.name: body for body in made.bodies}
    assert list(bodies) == ['a_base', 'a_upper', 'a_lower'], 'none of the flag, which is visual'
    upper = Pose(*map(np.array, states[0])).compose(
        Pose(np.array([0.1, 0, 0.5]), rotation.from_rpy(0.3, 0, 0.2)))
    # Bullet computes in doubles here, but reads numbers of the file as floats.
    for body, (position, orientation) in (('a_upper', upper), ('a_lower', states[1])):
        assert bodies[body].position == pytest.approx(tuple(position), abs=1e-6)
        assert rotation.angle_between(bodies[body].orientation, orientation) < 1e-6
    assert [part.kind for part in bodies['a_lower'].shape.parts] == ['sphere', 'capsule']


@pytest.mark.parametrize('angles', ['{{}}', "{{'{0}shoulder': 40, '{0}elbow': 70}}"])
def test_sdf_and_urdf_of_a_robot_are_the_same(tmp_path, angles):
    """Also where poses are relative to joints, frames and models within models."""
    sdf = SDF.format(version='1.9', roll=math.degrees(0.3), yaw=math.degrees(0.2))
    made = scene(tmp_path, '{name: a, urdf: r.urdf, position: [0, 0, 1], angles_deg: '
                 f'{angles.format("")}}}', '{name: a, sdf: w.sdf, without: [ground_plane, sun], '
                 f'angles_deg: {angles.format("arm::")}}}', r_urdf=ARM, w_sdf=sdf)
    urdf, sdf = made.bodies[:3], made.bodies[3:]
    assert [body.name for body in sdf] == ['a_arm::base', 'a_arm::upper', 'a_arm::hand::lower']
    for one, other in zip(urdf, sdf, strict=True):
        # Rounding of the chain's transforms.
        assert one.position == pytest.approx(other.position, abs=1e-12)
        assert rotation.angle_between(one.orientation, other.orientation) < 1e-7
        assert one.shape == other.shape or one.name == 'a_upper'


def test_axes_of_older_sdf_are_in_the_models_frame(tmp_path):
    def model(version, axis, more=''):
        return f"""<sdf version="{version}"><model name="m">
            <link name="a"><pose>0 0 0 0 0 0.5</pose></link>
            <link name="b"><pose>0 0 1 0 0 0.5</pose><collision name="c"><pose>1 0 0 0 0 0</pose>
            <geometry><sphere><radius>1</radius></sphere></geometry></collision></link>
            <joint name="j" type="revolute"><parent>a</parent><child>b</child>
            <axis><xyz>{axis}</xyz>{more}</axis></joint></model></sdf>"""

    own = f'{math.sin(0.5)} {math.cos(0.5)} 0'
    texts = [model('1.4', '0 1 0'), model('1.11', own), model(
        '1.6', '0 1 0', '<use_parent_model_frame>1</use_parent_model_frame>')]
    made = scene(tmp_path, *(f'{{name: s{k}, sdf: m{k}.sdf, angles_deg: {{j: 90}}}}'
                             for k in range(3)),
                 **{f'm{k}_sdf': text for k, text in enumerate(texts)})
    # A turn by 90 degrees about y takes the arm's x to -z, and leaves its y.
    for body in made.bodies:
        assert body.position == pytest.approx((0, math.sin(0.5), 1 - math.cos(0.5)), abs=1e-12)


def test_a_saved_scene_has_the_bodies_that_the_file_became(tmp_path):
    made = scene(tmp_path, '{name: a, urdf: r.urdf, orientation: [0, 0, 0.6, 0.8], friction: 0.3, '
                 'color: [1, 0, 0, 1], repeat: {count: 2, shift: [3, 0, 0]}}', r_urdf=ARM)
    assert [body.name for body in made.bodies[2:4]] == ['a_1_lower', 'a_2_base']
    assert made.bodies[3].position == pytest.approx((3, 0, 0.25))
    assert {body.friction for body in made.bodies} == {0.3}
    (tmp_path / 'elsewhere').mkdir()
    save_scene(made, tmp_path / 'elsewhere/saved.yaml')
    (tmp_path / 'r.urdf').unlink()
    assert load_scene(str(tmp_path / 'elsewhere/saved.yaml')) == made


def test_copies_turn_as_a_whole(tmp_path):
    made = scene(tmp_path, '{name: a, urdf: r.urdf, repeat: {count: 1, turned: yaw, seed: 3}}',
                 '{name: a, urdf: r.urdf}', r_urdf=ARM)
    turned, straight = (Pose(*map(np.array, zip(*((body.position, body.orientation)
                                                  for body in bodies), strict=True)))
                        for bodies in (made.bodies[:3], made.bodies[3:]))
    turn = rotation.multiply(turned.orientation[0], rotation.inverse(straight.orientation[0]))
    assert rotation.angle_between(turn, rotation.IDENTITY) > 0.1
    assert turned.position == pytest.approx(rotation.rotate(turn, straight.position), abs=1e-12)


def stl(triangles):
    return bytes(80) + struct.pack('<I', len(triangles)) + b''.join(
        struct.pack('<12fH', 0, 0, 0, *np.ravel(triangle), 0) for triangle in triangles)


def test_meshes_are_refused_or_become_boxes(tmp_path):
    urdf = ('<robot name="r"><link name="shell"><collision><origin xyz="0 0 1"/><geometry>'
            '<mesh filename="package://robot/shell.stl" scale="1 1 2"/></geometry></collision>'
            '</link></robot>')
    package = tmp_path / 'robot'
    package.mkdir()
    said = refusal(tmp_path, '{name: a, urdf: r.urdf}', r_urdf=urdf)
    assert ("bodies[0].urdf.(r.urdf).link shell.mesh: WrongForm: 'package://robot/shell.stl'; "
            'expected a box, sphere, cylinder or capsule; or `meshes: exact`') in said
    said = refusal(tmp_path, '{name: a, urdf: r.urdf, meshes: box}')
    assert "link shell.mesh: Unreadable: 'package://robot/shell.stl'; expected a file" in said
    pytest.importorskip('trimesh')
    turn = rotation.from_rpy(0, 0, 0.4)
    for size, orientation in (((0.4, 0.2, 0.1), rotation.IDENTITY), ((0.4, 0.2, 0.1), turn)):
        vertices, triangles = Box(size).mesh()
        vertices = rotation.rotate(orientation, vertices) + np.array((0.5, 0, 0))
        (package / 'shell.stl').write_bytes(stl(vertices[triangles]))
        body, = scene(tmp_path, '{name: a, urdf: r.urdf, meshes: box}').bodies
        # The file has floats.
        assert sorted(body.shape.size) == pytest.approx([0.2, 0.2, 0.4], rel=1e-6)
        assert body.position == pytest.approx((0.5, 0, 1), abs=1e-6)


def test_meshes_become_hulls_or_their_triangles(tmp_path):
    """An L of STL in a link with a box: the box is one body, the mesh another."""
    trimesh = pytest.importorskip('trimesh')
    pytest.importorskip('scipy')
    parts = [trimesh.creation.box((2, 1, 1)), trimesh.creation.box((1, 1, 2))]
    parts[0].apply_translation((0.5, 0, 0))
    parts[1].apply_translation((0, 0, 1.5))
    shape = trimesh.util.concatenate(parts)
    shape.export(tmp_path / 'shell.stl')
    urdf = ('<robot name="r"><link name="shell"><collision><origin xyz="0 0 1" rpy="0 0 0.5"/>'
            '<geometry><mesh filename="shell.stl" scale="1 1 2"/></geometry></collision>'
            '<collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>')
    exact, hull = (scene(tmp_path, f'{{name: a, urdf: r.urdf, meshes: {how}, position: [3, 0, 0]}}',
                         r_urdf=urdf) for how in ('exact', 'hull'))
    for made, kind, volume in ((exact, 'mesh', 8.0), (hull, 'hull', 2 * shape.convex_hull.volume)):
        box, body = made.bodies
        assert (box.name, box.shape) == ('a_shell', Box((1, 1, 1)))
        assert (body.name, body.shape.kind) == ('a_shell_2', kind)
        assert body.position == pytest.approx((3, 0, 1))
        assert rotation.angle_between(body.orientation, rotation.from_rpy(0, 0, 0.5)) < 1e-9
        assert trimesh.Trimesh(*body.shape.mesh()).volume == pytest.approx(volume)
        save_scene(made, tmp_path / 'copy.yaml')
        assert load_scene(str(tmp_path / 'copy.yaml')).bodies == made.bodies


@pytest.mark.parametrize(('key', 'text'), [
    ('urdf', '<robot name="r"><link name="a"><collision><origin xyz="1 2 3" rpy="0 0.3 0"/>'
     '<geometry><plane normal="0 0 2"/></geometry></collision></link></robot>'),
    ('sdf', '<sdf version="1.8"><model name="r"><link name="a"><collision name="c">'
     f'<pose>1 2 3 0 0 0</pose><geometry><plane><normal>{math.sin(0.3)} 0 {math.cos(0.3)}</normal>'
     '<size>1 1</size></plane></geometry></collision></link></model></sdf>')])
def test_planes_are_read(tmp_path, key, text):
    made = scene(tmp_path, f'{{name: w, {key}: r.{key}, friction: 0.4}}', **{f'r_{key}': text})
    body, = made.bodies
    assert (body.name, body.shape, body.friction) == ('w_a', Plane(), 0.4)
    assert body.position == pytest.approx((1, 2, 3))
    assert body.normal == pytest.approx((math.sin(0.3), 0, math.cos(0.3)))


LINK = ('<robot name="r"><link name="a"><collision><geometry>{}</geometry></collision></link>'
        '</robot>')
ENTRY = '{{name: a, urdf: r.urdf, {}}}'


@pytest.mark.parametrize(('entry', 'urdf', 'said'), [
    ('{name: a, urdf: none.urdf}', '', ".urdf: Unreadable: 'none.urdf'; expected a URDF file"),
    ('{name: a, sdf: r.urdf}', ARM, ".sdf.(r.urdf): WrongForm: '<robot>'; expected a <sdf>"),
    (ENTRY.format('shape: {sphere: {radius: 1}}'), ARM, ": WrongForm: 'name, urdf, shape'; "
     'expected exactly one of shape, shapes, urdf, sdf'),
    ('{name: a, shape: {sphere: {radius: 1}}, meshes: box}', '', '.meshes: WrongForm: '),
    (ENTRY.format('mass: 3'), ARM, '.mass: WrongForm: 3; expected none: a robot never'),
    (ENTRY.format('meshes: convex'), ARM, ".meshes: WrongForm: 'convex'; expected one of"),
    (ENTRY.format('angles_deg: {hip: 3}'), ARM, ".angles_deg.hip: UnknownJoint: 'hip'; expected "
     'one of shoulder, elbow'),
    (ENTRY.format('angles_deg: {elbow: 3}'), ARM, '.angles_deg.elbow: OutOfRange: 3; expected '
     '14.3239 to 85.9437 degrees'),
    (ENTRY.format('without: [b]'), ARM, ".without[0]: WrongForm: 'b'; expected one of base, upper"),
    (ENTRY.format('color: [2, 0, 0, 1]'), ARM, '.color[0]: OutOfRange'),
    ('{name: a, urdf: r.urdf}', LINK.format('<box size="1 1 -1"/>'),
     '.urdf.(r.urdf).link a.box: NotPositive'),
    ('{name: a, urdf: r.urdf}', LINK.format('<torus/>'), ".urdf.(r.urdf).link a: WrongForm: 'a "
     "<torus>'; expected a box, sphere, cylinder or capsule; leave the link out by "
     '`without: [a]`'),
    ('{name: a, urdf: r.urdf}', '<robot name="r"><link name="a"/></robot>',
     ".urdf: WrongForm: 'r.urdf'; expected a file with a link that has a <collision>")])
def test_what_is_wrong_is_named(tmp_path, entry, urdf, said):
    assert f'bodies[0]{said}' in refusal(tmp_path, entry, r_urdf=urdf)


POSE = '<pose relative_to="{}"/>'


@pytest.mark.parametrize(('body', 'said'), [
    ('<link name="a">' + POSE.format('b') + '</link>', "pose: WrongForm: 'b'; expected one of "),
    ('<frame name="f" attached_to="g"/><frame name="g" attached_to="f"/><link name="a">'
     + POSE.format('f') + '</link>', 'expected no frame relative to itself'),
    ('', 'expected a <model> that has a <link>'),
    ('<link name="a"><pose>1 2</pose></link>', "a.pose: WrongForm: '1 2'; expected 6 finite"),
    ('<link name="a"><collision name="c"><geometry><plane><normal>0 0 0</normal></plane></geometry>'
     '</collision></link>', 'link a.plane.normal: NotUnit: [0.0, 0.0, 0.0]; expected a direction'),
    ('<link name="a"><collision name="c"><geometry><heightmap/></geometry></collision></link>',
     "link a: WrongForm: 'a <heightmap>'; expected a box")])
def test_what_is_wrong_in_an_sdf_is_named(tmp_path, body, said):
    sdf = f'<sdf version="1.8"><model name="m">{body}</model></sdf>'
    assert said in refusal(tmp_path, '{name: a, sdf: m.sdf}', m_sdf=sdf)


def test_links_of_several_shapes_are_one_body(tmp_path):
    made = scene(tmp_path, '{name: a, urdf: r.urdf, without: [base, upper]}', r_urdf=ARM)
    body, = made.bodies
    assert isinstance(body.shape, Compound)
    # Zero is outside the elbow's limits: the nearest is 0.25 rad about (1, 1, 0).
    upright = rotation.from_rpy(0, 0, 0.5)
    bent = rotation.multiply(upright, rotation.from_axis_angle((1, 1, 0), 0.25))
    assert body.orientation == pytest.approx(tuple(bent))
    assert body.position == pytest.approx((0, 0.1, 1.5))

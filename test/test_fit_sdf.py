"""Robots in SDF become the dolls that their URDFs become; against PyBullet's reader too."""
import math

import numpy as np
import pytest

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.robots.robot import doll_from_urdf
from ragdoll_ros.fit.robots.sdf_dolls import read_sdf
from ragdoll_ros.model import errors, rotation

INERTIA = ('<inertia><ixx>0.04</ixx><ixy>0.002</ixy><ixz>0</ixz><iyy>0.05</iyy><iyz>0.001</iyz>'
           '<izz>0.03</izz></inertia>')

URDF = """<robot name="arm">
<link name="base"><inertial><mass value="3"/></inertial>
  <collision><geometry><box size="1 0.5 0.5"/></geometry></collision></link>
<link name="upper"><inertial><mass value="1.5"/><origin xyz="0.02 0 0.4" rpy="0 0.1 0"/>
  <inertia ixx="0.04" ixy="0.002" ixz="0" iyy="0.05" iyz="0.001" izz="0.03"/></inertial>
  <collision><origin xyz="0 0 0.4" rpy="0 0 0.2"/>
  <geometry><cylinder radius="0.05" length="0.8"/></geometry></collision></link>
<link name="lower"><inertial><mass value="1"/></inertial>
  <collision><origin xyz="0 0 -0.2"/><geometry><sphere radius="0.1"/></geometry></collision>
  <collision><origin xyz="0 0 -0.4"/><geometry><box size="0.1 0.1 0.4"/></geometry></collision>
  </link>
<link name="hand"><inertial><mass value="0.5"/></inertial>
  <visual><geometry><capsule radius="0.05" length="0.1"/></geometry></visual></link>
<link name="rail"><inertial><mass value="0.4"/></inertial>
  <collision><geometry><box size="0.3 0.1 0.1"/></geometry></collision></link>
<link name="camera"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
  <origin xyz="0 0.1 0.5" rpy="0 0 0.5"/><axis xyz="0 0.6 0.8"/><limit lower="-1" upper="2"/>
  <dynamics damping="0.3"/></joint>
<joint name="elbow" type="spherical"><parent link="upper"/><child link="lower"/>
  <origin xyz="0 0 0.9" rpy="0.3 0 0"/></joint>
<joint name="wrist" type="continuous"><parent link="lower"/><child link="hand"/>
  <origin xyz="0 0 -0.7"/><axis xyz="1 0 0"/></joint>
<joint name="slide" type="prismatic"><parent link="base"/><child link="rail"/>
  <origin xyz="0.7 0 0"/><axis xyz="1 0 0"/></joint>
<joint name="mount" type="fixed"><parent link="base"/><child link="camera"/>
  <origin xyz="0.5 0 0.3"/></joint>
</robot>"""

MODEL = f"""<model name="arm">
<frame name="socket" attached_to="base"><pose>0 0.1 0.5 0 0 0.5</pose></frame>
<link name="base"><inertial><mass>3</mass></inertial>
  <collision name="c"><geometry><box><size>1 0.5 0.5</size></box></geometry></collision></link>
<link name="upper"><pose relative_to="shoulder"/>
  <inertial><mass>1.5</mass><pose>0.02 0 0.4 0 0.1 0</pose>{INERTIA}</inertial>
  <collision name="c"><pose>0 0 0.4 0 0 0.2</pose><geometry><cylinder><radius>0.05</radius>
  <length>0.8</length></cylinder></geometry></collision></link>
<link name="lower"><pose relative_to="elbow"/><inertial><mass>1</mass></inertial>
  <collision name="c"><pose>0 0 -0.2 0 0 0</pose><geometry><sphere><radius>0.1</radius></sphere>
  </geometry></collision>
  <collision name="d"><pose relative_to="elbow">0 0 -0.4 0 0 0</pose><geometry><box>
  <size>0.1 0.1 0.4</size></box></geometry></collision></link>
<link name="hand"><pose relative_to="lower">0 0 -0.7 0 0 0</pose><inertial><mass>0.5</mass>
  </inertial><visual name="v"><geometry><capsule><radius>0.05</radius><length>0.1</length></capsule>
  </geometry></visual></link>
<link name="rail"><pose>0.7 0 0 0 0 0</pose><inertial><mass>0.4</mass></inertial>
  <collision name="c"><geometry><box><size>0.3 0.1 0.1</size></box></geometry></collision></link>
<link name="camera"><pose>0.5 0 0.3 0 0 0</pose></link>
<joint name="shoulder" type="revolute"><parent>base</parent><child>upper</child>
  <pose relative_to="socket"/><axis><xyz expressed_in="__model__">{{axis}}</xyz>
  <limit><lower>-1</lower><upper>2</upper></limit><dynamics><damping>0.3</damping></dynamics>
  </axis></joint>
<joint name="elbow" type="ball"><parent>upper</parent><child>lower</child>
  <pose relative_to="upper">0 0 0.9 0.3 0 0</pose></joint>
<joint name="wrist" type="revolute"><parent>lower</parent><child>hand</child>
  <axis><xyz>1 0 0</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis></joint>
<joint name="slide" type="prismatic"><parent>base</parent><child>rail</child>
  <axis><xyz>1 0 0</xyz><limit><lower>0.1</lower><upper>0.3</upper></limit></axis></joint>
<joint name="mount" type="fixed"><parent>base</parent><child>camera</child></joint>
</model>"""

AXIS = rotation.rotate(rotation.from_rpy(0, 0, 0.5), np.array([0, 0.6, 0.8]))
"""The shoulder's, which URDF gives in the link's frame, in the model's."""


def model(axis=AXIS):
    return MODEL.format(axis=' '.join(map(repr, map(float, axis))))


def written(tmp_path, *bodies, version='1.9'):
    path = tmp_path / 'robot.sdf'
    path.write_text(f'<sdf version="{version}">{"".join(bodies)}</sdf>')
    return path


def read(tmp_path, *bodies, **options):
    return read_sdf(written(tmp_path, *bodies, **options))


def assert_same(doll, other):
    """Equal but for rounding of the transforms of a chain."""
    assert [bone.name for bone in doll.bones] == [bone.name for bone in other.bones]
    for bone, its in zip(doll.bones, other.bones, strict=True):
        assert bone.shape.kind == its.shape.kind and bone.mass == its.mass
        assert bone.shape.volume == pytest.approx(its.shape.volume, rel=1e-12)
        assert bone.position == pytest.approx(its.position, abs=1e-12)
        # Angles near zero are square roots of what cosines lose.
        assert rotation.angle_between(bone.orientation, its.orientation) < 1e-7
        assert bone.inertia == pytest.approx(its.inertia, rel=1e-9)
    for joint, its in zip(doll.joints, other.joints, strict=True):
        assert (joint.parent, joint.child, joint.kind, joint.angle_names, joint.damping) == (
            its.parent, its.child, its.kind, its.angle_names, its.damping)
        assert joint.anchor == pytest.approx(its.anchor, abs=1e-12)
        assert np.allclose(joint.axes, its.axes, atol=1e-12)
        assert joint.limits == its.limits
    assert [(rider.name, rider.bone) for rider in doll.riders] == [
        (rider.name, rider.bone) for rider in other.riders]
    for rider, its in zip(doll.riders, other.riders, strict=True):
        assert rider.position == pytest.approx(its.position, abs=1e-12)


def test_an_sdf_is_the_doll_of_the_same_urdf(tmp_path):
    [(placement, notes)] = read(tmp_path, model())
    assert_same(placement.doll, doll_from_urdf(URDF))
    assert notes == ('slide: prismatic joints are not supported: fixed',)


def test_poses_and_masses_are_those_of_pybullet(tmp_path):
    """Its reader knows no frames by name: version 1.5, whose poses are in the model's frame."""
    pybullet = pytest.importorskip('pybullet')
    old = """<model name="m"><pose>1 2 3 0 0 0</pose>
        <link name="a"><inertial><mass>2</mass>{inertia}</inertial>{ball}</link>
        <link name="b"><pose>0.1 0.2 0.9 0.2 0.1 0.7</pose><inertial><pose>0 0 0.3 0 0 0</pose>
        <mass>1</mass>{inertia}</inertial>{ball}</link>
        <link name="c"><pose>0.3 0.2 1.4 0 0 0.3</pose><inertial><mass>0.5</mass>{inertia}
        </inertial>{ball}</link>
        <joint name="ab" type="revolute"><parent>a</parent><child>b</child><axis>
        <xyz>0 0.8 0.6</xyz><limit><lower>-1</lower><upper>0.5</upper></limit></axis></joint>
        <joint name="bc" type="revolute"><parent>b</parent><child>c</child><axis><xyz>1 0 0</xyz>
        <limit><lower>-2</lower><upper>2</upper></limit></axis></joint></model>""".format(
        inertia=INERTIA, ball='<collision name="k"><geometry><sphere><radius>0.1</radius></sphere>'
        '</geometry></collision>')
    path = written(tmp_path, f'<world name="w">{old}</world>', version='1.5')
    [(placement, _)] = read_sdf(path)
    doll, client = placement.doll, pybullet.connect(pybullet.DIRECT)
    try:
        robot, = pybullet.loadSDF(str(path), physicsClientId=client)
        names = {pybullet.getJointInfo(robot, k, client)[12].decode(): k for k in range(2)}
        masses = {name: pybullet.getDynamicsInfo(robot, k, client)[0] for name, k in names.items()}
        centres = {name: pybullet.getLinkState(robot, k, physicsClientId=client)[0]
                   for name, k in names.items()}
        at, turn = pybullet.getBasePositionAndOrientation(robot, client)
        infos = {name: pybullet.getJointInfo(robot, k, client) for name, k in names.items()}
    finally:
        pybullet.disconnect(client)
    base = rotation.inverse(np.array(turn))
    for name in 'bc':
        bone = doll.bone(name)
        joint = next(joint for joint in doll.joints if joint.child == name)
        assert bone.mass == pytest.approx(masses[name], rel=1e-6)
        # It reads numbers as floats.
        assert np.subtract(bone.position, doll.bone('a').position) == pytest.approx(
            rotation.rotate(base, np.subtract(centres[name], at)), abs=1e-6)
        assert joint.limits[0] == pytest.approx(infos[name][8:10], abs=1e-6)
        assert joint.angle_names == (infos[name][1].decode(),)
    assert doll.mass == pytest.approx(3.5)


def test_axes_of_each_version_are_the_same_axis(tmp_path):
    """In the model's frame up to 1.4; where the file says so in 1.5 and 1.6; as it names later."""
    def axis_of(version, axis, more=''):
        [(placement, _)] = read(tmp_path, f"""<model name="m">
            <link name="a"><inertial><mass>1</mass></inertial>{BALL}</link>
            <link name="b"><pose>0 0 1 0 0 0.5</pose><inertial><mass>1</mass></inertial>{BALL}
            </link><joint name="j" type="revolute"><parent>a</parent><child>b</child><axis>
            {axis}{more}</axis></joint></model>""", version=version)
        return placement.doll.joints[0].axes[0]

    own = f'<xyz>{math.sin(0.5)} {math.cos(0.5)} 0</xyz>'
    for version, axis, more in (
            ('1.4', '<xyz>0 1 0</xyz>', ''), ('1.11', own, ''),
            ('1.6', '<xyz>0 1 0</xyz>', '<use_parent_model_frame>1</use_parent_model_frame>'),
            ('1.9', '<xyz expressed_in="a">0 1 0</xyz>', '')):
        assert axis_of(version, axis, more) == pytest.approx((0, 1, 0), abs=1e-12)


BALL = ('<collision name="k"><geometry><sphere><radius>0.1</radius></sphere></geometry>'
        '</collision>')


def link(name, more='', mass=1.0, at='0 0 0'):
    return (f'<link name="{name}"><pose>{at} 0 0 0</pose><inertial><mass>{mass}</mass></inertial>'
            f'{BALL}{more}</link>')


def joint(name, parent, child, kind='revolute', more='<axis><xyz>0 0 1</xyz></axis>'):
    return (f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>'
            f'{more}</joint>')


def test_a_universal_joint_has_two_axes_and_a_screw_is_fixed(tmp_path):
    [(placement, notes)] = read(
        tmp_path, '<model name="m">', link('a'), link('b', at='0 0 1'), link('c', at='0 0 -1'),
        joint('ab', 'a', 'b', 'universal', '<axis><xyz>1 0 0</xyz><limit><lower>-1</lower><upper>1'
              '</upper></limit></axis><axis2><xyz>0 1 0</xyz></axis2>'),
        joint('ac', 'a', 'c', 'screw'), '</model>')
    first, second = sorted(placement.doll.joints, key=lambda joint: joint.child)
    assert (first.kind, first.axes) == ('universal', ((1, 0, 0), (0, 1, 0)))
    assert first.limits == (pytest.approx((-1, 1)), None)
    assert (first.angle_names, second.kind) == (('ab', 'ab_2'), 'fixed')
    assert notes == ('ac: screw joints are not supported: fixed',)


def test_what_has_no_joint_is_a_doll_of_its_own_in_its_place(tmp_path):
    """A world: what is static or included is named; names are those within a model."""
    path = written(tmp_path, '<world name="w">', model().replace(
        '<model name="arm">', '<model name="arm"><pose>0 0 2 0 0 0.4</pose>'),
        '<model name="ball"><pose>3 1 2 0 0 0</pose>', link('l'), link('m', at='1 0 0'), '</model>',
        '<model name="floor"><static>true</static>', link('f'), '</model>',
        '<include><uri>model://sun</uri></include></world>')
    found = read_sdf(path)
    dolls = {placement.doll.name: placement for placement, _ in found}
    assert list(dolls) == ['arm', 'ball', 'ball_2']
    assert_same(dolls['arm'].doll, doll_from_urdf(URDF))
    assert dolls['arm'].position == pytest.approx((0, 0, 2))
    assert rotation.angle_between(dolls['arm'].orientation, rotation.from_rpy(0, 0, 0.4)) < 1e-7
    assert dolls['ball_2'].position == pytest.approx((4, 1, 2))
    notes = found[0][1]
    assert any(note.startswith('sun: an <include> is left out: ') for note in notes)
    assert any(note.startswith('floor::f: <static>, no doll') for note in notes)
    assert main([str(path), '-o', str(tmp_path / 'out.yaml')]) == 0
    scene = load_scene(str(tmp_path / 'out.yaml'))
    assert [placement.doll.name for placement in scene.dolls] == list(dolls)
    assert np.subtract(scene.dolls[2].position, scene.dolls[0].position) == pytest.approx((4, 1, 0))


def test_a_loop_and_a_joint_to_the_world_are_named(tmp_path):
    [(placement, notes)] = read(
        tmp_path, '<model name="m">', link('a'), link('b', at='0 0 1'), link('c', at='0 1 1'),
        joint('ab', 'a', 'b'), joint('ac', 'a', 'c'), joint('bc', 'b', 'c'),
        joint('again', 'a', 'b'), joint('pivot', 'world', 'a'), '</model>')
    assert [each.angle_names for each in placement.doll.joints] == [('ab',), ('ac',)]
    assert notes == ('bc: closes a loop, of which a doll has none: ignored',
                     'again: closes a loop, of which a doll has none: ignored',
                     'pivot: a continuous joint to the world: ignored')


def test_a_joint_whose_child_another_moves_moves_its_parent(tmp_path):
    """As in PR2's grippers: a parallel link hangs on the tip of a finger, as its parent."""
    [(placement, notes)] = read(
        tmp_path, '<model name="m">', link('a'), link('b', at='0 0 1'), link('c', at='0 1 1'),
        joint('ab', 'a', 'b'), joint('cb', 'c', 'b', more='<axis><xyz>1 0 0</xyz><limit><lower>-1'
                                     '</lower><upper>2</upper></limit></axis>'), '</model>')
    hinge = next(each for each in placement.doll.joints if each.child == 'c')
    assert (hinge.parent, hinge.axes, hinge.anchor) == ('b', ((-1, 0, 0),), (0, 0, 1))
    assert hinge.limits == (pytest.approx((-1, 2)),) and notes == ()


def test_a_link_and_a_joint_may_have_one_name(tmp_path):
    """Before SDF 1.7 they are not of one scope."""
    [(placement, _)] = read(tmp_path, '<model name="m">', link('a'), link('b', at='0 0 1'),
                            joint('b', 'a', 'b'), '</model>', version='1.4')
    assert placement.doll.joints[0].anchor == (0, 0, 1)


def test_a_point_mass_with_a_shape_is_a_solid(tmp_path):
    """As Drake's poles, whose moments of 1e-20 stand for zero."""
    tiny = ''.join(f'<{key}>1e-20</{key}>' for key in ('ixx', 'iyy', 'izz'))
    [(placement, notes)] = read(tmp_path, '<model name="m">', link('a').replace(
        '</mass>', f'</mass><inertia>{tiny}</inertia>'), '</model>')
    assert placement.doll.root.inertia == pytest.approx((0.4 * 0.1 ** 2,) * 3)
    assert notes == ('a: no body has its inertia: that of a uniform solid is used',)


def test_a_joint_that_follows_another_is_named(tmp_path):
    follows = '<axis><xyz>0 0 1</xyz><mimic joint="ab"><multiplier>2</multiplier></mimic></axis>'
    [(_, notes)] = read(tmp_path, '<world name="w"><model name="m">', link('a'), link('b'),
                        link('c'), joint('ab', 'a', 'b'), joint('ac', 'a', 'c', more=follows),
                        '</model></world>')
    assert notes == ('ac: mimics ab: becomes an independent joint',)


def test_a_link_without_a_mass_has_that_of_water(tmp_path):
    [(placement, notes)] = read(tmp_path, f'<model name="m"><link name="a">{BALL}</link></model>')
    assert placement.doll.mass == pytest.approx(1000 * 4 / 3 * math.pi * 0.1 ** 3)
    assert 'the mass of water' in notes[0]


@pytest.mark.parametrize(('body', 'said'), [
    ('<model name="m"><static>1</static>' + link('a') + '</model>',
     "model: WrongForm: ['a']; expected a model that moves: a scene has what is <static> as a"),
    ('<model name="m"><link name="a"/></model>', "link: WrongForm: ['a']; expected a link with a"),
    ('<model name="m">' + link('a', mass='heavy') + '</model>',
     "link a.inertial.mass: WrongForm: 'heavy'; expected a finite number"),
    ('<model name="m">' + link('a', mass=-1) + '</model>', 'link a.inertial.mass: OutOfRange: -1'),
    ('<world name="w"><include><uri>model://sun</uri></include></world>',
     'sun: an <include> is left out: put the model itself there, as `gz sdf -p FILE` prints it'),
    ('<model name="m">' + link('a') + link('b') + joint('j', 'a', 'b', more='<axis><xyz>0 0 1</xyz>'
     '<dynamics><damping>much</damping></dynamics></axis>') + '</model>',
     "joint j.axis.dynamics.damping: WrongForm: 'much'")])
def test_what_is_wrong_is_named(tmp_path, body, said):
    with pytest.raises(errors.ModelErrors) as caught:
        read(tmp_path, body)
    assert said in str(caught.value) and 'robot.sdf' in str(caught.value)


def test_options_for_characters_are_refused(tmp_path, capsys):
    assert main([str(written(tmp_path, model())), '--mass', '3']) == 2
    assert 'a .sdf defines its own bodies' in capsys.readouterr().err


def test_comments_may_have_what_gazebo_reads_and_xml_forbids(tmp_path):
    path = tmp_path / 'arm.sdf'
    path.write_text(f'<sdf version="1.7"><!-- gz topic --msgtype\n <link -- -->{model()}</sdf>')
    (placement, _), = read_sdf(path)
    assert placement.doll.root.name == 'base'
    path.write_text('<!-- a --\n b -->\n<sdf><model></sdf>')
    with pytest.raises(errors.ModelErrors, match='line 3'):
        read_sdf(path)
    path.write_text('<!DOC<!-- -->TYPE a><sdf/>')
    with pytest.raises(errors.ModelErrors, match='DOCTYPE'):
        read_sdf(path)


def test_more_models_than_a_scene_may_have_are_refused_before_they_fall(tmp_path, capsys):
    path = tmp_path / 'world.sdf'
    models = ''.join(f'<model name="box{number}"><link name="l"><collision name="c"><geometry><box>'
                     '<size>1 1 1</size></box></geometry></collision></link></model>'
                     for number in range(1001))
    path.write_text(f'<sdf version="1.7"><world name="w">{models}</world></sdf>')
    assert main([str(path)]) == 2
    assert 'OutOfRange: 1001; expected at most 1000 dolls in a file' in capsys.readouterr().err

"""URDF becomes a doll: what to_urdf writes comes back, and robots go limp."""
import math
from xml.etree import ElementTree

import numpy as np
import pytest
from specimens import HAMMER

from ragdoll_ros.files.doll import load_doll, save_doll
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.fit.robots.robot import doll_from_urdf, read_urdf
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Part, Sphere
from ragdoll_ros.physics.simulation import Simulation

TURN = rotation.from_rpy(0.3, -0.4, 0.5)


def every_kind():
    """A doll with each shape and each joint kind, everything askew."""
    bones = (Bone('root', Box((0.2, 0.3, 0.4)), 5, (0, 0, 0), TURN),
             Bone('hinged', Cylinder(0.05, 0.3), 1, (0, 0.4, 0.1), TURN),
             Bone('swung', Capsule(0.05, 0.3), 2, (0, -0.4, 0.1), rotation.inverse(TURN)),
             Bone('crossed', Sphere(0.1), 3, (0.4, 0, 0)),
             Bone('stuck', Box((0.1, 0.1, 0.1)), 1, (-0.3, 0, 0.1)))
    x, y = rotation.rotate(TURN, np.eye(3)[:2])
    joints = (Joint('root', 'hinged', 'hinge', (0, 0.2, 0), (x,), ((-1, 0.5),), 0.1),
              Joint('root', 'swung', 'ball', (0, -0.2, 0), ((0, -0.6, 0.8),),
                    ((-0.8, 0.8), (-0.3, 0.3)), 0.2),
              Joint('root', 'crossed', 'universal', (0.2, 0, 0), (x, y), ((-1, 1), (-0.5, 0.2))),
              Joint('crossed', 'stuck', 'fixed', (-0.1, 0, 0)))
    return Ragdoll('every', bones, joints)


def from_root(doll, position):
    return np.subtract(position, doll.root.position)


def test_any_name_is_written_as_xml():
    name = 'a <"b"> & \'c\'\t\n\r ä'
    text = to_urdf(Ragdoll('x', (Bone(name, Sphere(1), 1, (0, 0, 0)),), ()))
    assert ElementTree.fromstring(text).find('link').get('name') == name


@pytest.mark.parametrize('name', ['doll', 'article_doll', None])
def test_what_to_urdf_writes_comes_back(name):
    doll = load_doll(name) if name else every_kind()
    back = doll_from_urdf(to_urdf(doll))
    assert back.root.name == doll.root.name
    assert {bone.name for bone in back.bones} == {bone.name for bone in doll.bones}
    for bone in doll.bones:
        other = back.bone(bone.name)
        assert other.shape == bone.shape
        assert other.mass == bone.mass
        # Through roll, pitch and yaw, and a row of frames: a few last digits are lost.
        assert np.allclose(from_root(back, other.position), from_root(doll, bone.position),
                           atol=1e-12)
        turns = np.array([other.orientation, bone.orientation])
        assert rotation.angle_between(turns[0], turns[1]) < 1e-9
    joints = {joint.child: joint for joint in back.joints}
    for joint in doll.joints:
        other = joints[joint.child]
        assert (other.kind, other.parent, other.damping) == (
            joint.kind, joint.parent, joint.damping)
        if joint.kind != 'fixed':
            assert np.allclose(from_root(back, other.anchor), from_root(doll, joint.anchor),
                               atol=1e-12)
        assert np.allclose(other.axes, joint.axes, atol=1e-12)
        assert np.allclose(other.limits, joint.limits, atol=1e-9)


def test_what_is_read_can_be_written(tmp_path):
    """As plain numbers: YAML knows none of numpy's, and would crash on one."""
    doll = doll_from_urdf(to_urdf(every_kind().replace_bone('root', shape=HAMMER)))
    save_doll(doll, tmp_path / 'doll.yaml')
    assert load_doll(str(tmp_path / 'doll.yaml')) == doll


def link(name, shape='<box size="0.1 0.1 0.1"/>', mass=1.0, origin='', tag='collision'):
    inertial = f'<inertial><mass value="{mass}"/></inertial>' if mass else ''
    part = f'<{tag}>{origin}<geometry>{shape}</geometry></{tag}>' if shape else ''
    return f'<link name="{name}">{inertial}{part}</link>'


def joint(child, parent='a', kind='revolute', xyz='0 0 1', axis='0 0 1', inside=''):
    limit = '<limit lower="-1" upper="2" effort="1" velocity="1"/>' if kind == 'revolute' else ''
    return (f'<joint name="to_{child}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{child}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}{inside}'
            '</joint>')


def robot(*parts):
    return f'<robot name="r">{"".join(parts)}</robot>'


def read(tmp_path, *parts):
    path = tmp_path / 'robot.urdf'
    path.write_text(robot(*parts))
    return read_urdf(path)


@pytest.mark.parametrize(('kind', 'expected', 'limits'), [
    ('revolute', 'hinge', ((-1, 2),)), ('continuous', 'hinge', (None,)), ('fixed', 'fixed', ()),
    ('prismatic', 'fixed', ()), ('planar', 'fixed', ()), ('floating', 'ball', (None, None)),
    ('spherical', 'ball', (None, None))])
def test_joint_kinds(tmp_path, kind, expected, limits):
    doll, notes = read(tmp_path, link('a'), link('b'), joint('b', kind=kind))
    assert doll.joints[0].kind == expected
    assert len(doll.joints[0].limits) == len(limits)
    for pair, wanted in zip(doll.joints[0].limits, limits, strict=True):
        assert pair == (wanted and pytest.approx(wanted, abs=1e-9))
    assert bool(notes) == (kind in ('prismatic', 'planar', 'floating'))
    assert all(kind in note and 'to_b' in note for note in notes)
    assert doll.joints[0].anchor == (0, 0, 1)


def test_dry_friction_is_ignored_with_a_note(tmp_path):
    resists = '<dynamics damping="0.5" friction="2"/>'
    doll, notes = read(tmp_path, link('a'), link('b'), link('c'), link('d'),
                       joint('b', inside=resists), joint('c', inside=resists),
                       joint('d', inside='<dynamics damping="0.5" friction="0"/>'))
    [note] = notes
    assert note.startswith('to_b, to_c: dry friction') and 'ignored' in note
    assert [each.damping for each in doll.joints] == [0.5] * 3


def test_contact_properties_of_pybullet_are_ignored_with_a_note(tmp_path):
    rubber = '<contact><lateral_friction value="2"/></contact></link>'
    soles = [link(name).replace('</link>', rubber) for name in 'ac']
    _, [note] = read(tmp_path, soles[0], link('b'), soles[1], joint('b'), joint('c'))
    assert note.startswith('a, c: ') and '<contact>' in note and 'ignored' in note


def test_a_link_without_a_shape_rides_and_gives_its_mass(tmp_path):
    doll, _ = read(tmp_path, link('a'), link('sensor', shape='', mass=0.5), link('tip', '', 0),
                   joint('sensor', kind='fixed', xyz='0 0 0.3'),
                   joint('tip', 'sensor', 'fixed', '0.1 0 0'))
    assert [bone.name for bone in doll.bones] == ['a']
    assert doll.mass == 1.5
    riders = {rider.name: (rider.bone, rider.position) for rider in doll.riders}
    assert riders == {'a': ('a', (0, 0, 0)), 'sensor': ('a', (0, 0, 0.3)),
                      'tip': ('a', (0.1, 0, 0.3))}


def test_a_bare_root_gives_way_to_its_child(tmp_path):
    doll, _ = read(tmp_path, link('world', '', 0), link('a'), link('b'),
                   joint('a', 'world', 'fixed'), joint('b'))
    assert doll.root.name == 'a'
    assert [(j.parent, j.child) for j in doll.joints] == [('a', 'b')]


def test_two_branches_of_a_bare_root_stay_one_doll(tmp_path):
    doll, notes = read(tmp_path, link('base', '', 0), link('a'), link('b'),
                       joint('a', 'base', xyz='0 1 0'), joint('b', 'base', xyz='0 -1 0'))
    assert notes == ('to_a: no link above it has a shape: ignored',)
    assert [(j.parent, j.child, j.kind) for j in doll.joints] == [('a', 'b', 'hinge')]


def test_bare_links_between_make_one_joint(tmp_path):
    """Two axes that cross are a universal joint; three, or two askew, a ball joint."""
    def row(second_axis):
        return read(tmp_path, link('a'), link('v', '', 0), link('b'), joint('v', axis='1 0 0'),
                    joint('b', 'v', xyz='0 0 0', axis=second_axis))[0]

    doll = row('0 1 0')
    assert doll.joints[0].kind == 'universal'
    assert doll.joints[0].axes == ((1, 0, 0), (0, 1, 0))
    assert row('0.6 0.8 0').joints[0].kind == 'ball'


def test_a_link_without_a_mass_gives_its_shapes_to_what_carries_it(tmp_path):
    doll, _ = read(tmp_path, link('a'), link('b', mass=0), link('c', '<sphere radius="1"/>', 0,
                                                               tag='visual'),
                   joint('b', kind='fixed', xyz='0 0 0.2'), joint('c', kind='fixed'))
    assert [bone.name for bone in doll.bones] == ['a']
    assert [part.shape for part in doll.root.shape.parts] == [Box((0.1, 0.1, 0.1))] * 2
    # Two cubes, 0.2 m apart, reach from -0.05 to 0.25 m.
    ends = doll.root.position[2] + np.array([-1, 1]) * doll.root.shape.support(
        np.array([[0, 0, -1], [0, 0, 1]]))
    assert ends == pytest.approx([-0.05, 0.25])


def test_a_link_of_next_to_nothing_is_merged_and_named(tmp_path):
    """As in files of Unitree's robots; else what is written could not be loaded again."""
    doll, notes = read(tmp_path, link('a'), link('b', mass=4e-15), link('c', mass=0.1), joint('b'),
                       joint('c', 'b', axis='1 0 0'))
    assert [bone.name for bone in doll.bones] == ['a', 'c']
    assert notes == ('b: 4e-15 kg, less than a millionth of the robot: part of a',)
    made = doll.joints[0]
    assert (made.parent, made.kind, made.anchor, made.axes) == (
        'a', 'hinge', (0, 0, 2), ((1, 0, 0),))
    assert len(doll.bone('a').shape.parts) == 2, "its shape is the parent's"
    assert {rider.name: rider.bone for rider in doll.riders} == {'a': 'a', 'b': 'a', 'c': 'c'}
    save_doll(doll, tmp_path / 'doll.yaml')
    assert load_doll(str(tmp_path / 'doll.yaml')) == doll


def test_a_root_without_a_mass_is_part_of_what_is_fixed_to_it(tmp_path):
    """As PR2's base_footprint: no mass is invented for it."""
    doll, notes = read(tmp_path, link('foot', mass=0), link('a', mass=200), link('b'),
                       joint('a', 'foot', 'fixed'), joint('b'))
    assert [bone.name for bone in doll.bones] == ['a', 'b'] and notes == ()
    assert (doll.mass, len(doll.root.shape.parts)) == (201, 2)


def test_a_moving_link_without_a_mass_and_next_to_no_size_is_merged_and_named(tmp_path):
    doll, notes = read(tmp_path, link('a', mass=200), joint('b'),
                       link('b', '<box size="0.001 0.001 0.001"/>', 0))
    assert [bone.name for bone in doll.bones] == ['a']
    assert notes == ('b: 1e-06 kg, less than a millionth of the robot: part of a',)


def test_an_inertia_of_rounding_alone_is_that_of_a_solid(tmp_path):
    """Exports have moments of 1e-24 and -1e-24 kg m^2 where others are 1e-4."""
    tiny = ('<inertia ixx="1e-24" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>')
    doll, notes = read(tmp_path, link('a').replace('</inertial>', tiny))
    assert notes == ('a: no body has its inertia: that of a uniform solid is used',)
    assert doll.root.inertia == pytest.approx((0.01 / 6,) * 3)


def test_what_touches_at_the_start_does_not_collide(tmp_path):
    """Hulls around the meshes of neighbours jam: a hand of PMB's Tiago took 3 s a tick."""
    parts = [link(name) for name in 'abcd'] + [joint(child, xyz=xyz) for child, xyz in (
        ('b', '0 0 1'), ('c', '0.1005 0 1'), ('d', '0 0.2 1'))]
    doll, _ = read(tmp_path, *parts)
    assert doll.no_collision == (('b', 'c'),), 'cubes of 0.1 m, 0.5 mm from each other; d is far'


def test_what_fixed_joints_connect_is_one_for_collisions(tmp_path):
    """As in MuJoCo, which merges what is welded: what a hinge connects are two parts of a and b, c
    and d, of which none collides with another; e beyond does.
    """
    parts = [link(name) for name in 'abcde'] + [joint(*pair, kind=kind) for pair, kind in (
        ('ba', 'fixed'), ('cb', 'revolute'), ('dc', 'fixed'), ('ed', 'revolute'))]
    doll, _ = read(tmp_path, *parts)
    pairs = {''.join(sorted(pair)) for pair in doll.excluded_pairs}
    assert pairs == {'ab', 'cd', 'ac', 'ad', 'bc', 'bd', 'ce', 'de'}


def test_the_world_needs_no_link(tmp_path):
    held = joint('a', 'world', 'fixed')
    assert read(tmp_path, link('a'), held) == read(
        tmp_path, '<link name="world"/>', link('a'), held)


def test_a_fixed_joint_needs_no_axis_and_a_prefix_no_namespace(tmp_path):
    doll, _ = read(tmp_path, link('a'), link('b'), joint('b', kind='fixed', axis=''),
                   '<gazebo><sensor:camera a:b="1"><rate>3</rate></sensor:camera></gazebo>')
    assert [each.kind for each in doll.joints] == ['fixed']
    with pytest.raises(errors.ModelErrors, match=r'unbound prefix.*expand a xacro first'):
        read(tmp_path, link('a'), '<xacro:wheel name="b"/>')


@pytest.mark.parametrize('quote', '"\'')
def test_a_default_namespace_changes_no_name(quote):
    """As of the quadrotor of Drake and Bullet."""
    text = f'<robot name="r">{link("a")}</robot>'
    spaced = text.replace('name="r"', f'xmlns = {quote}http://drake.mit.edu{quote}\n name="r"')
    assert doll_from_urdf(spaced) == doll_from_urdf(text)


def test_what_is_only_seen_is_a_body_where_nothing_has_a_mass(tmp_path):
    seen = link('b', mass=0, tag='visual')
    assert len(read(tmp_path, link('a', mass=0), seen, joint('b'))[0].bones) == 2
    assert len(read(tmp_path, link('a'), seen, joint('b'))[0].bones) == 1


def test_a_mimic_joint_becomes_independent_with_a_note(tmp_path):
    doll, notes = read(tmp_path, link('a'), link('b'), link('c'), joint('b'),
                       joint('c', inside='<mimic joint="to_b" multiplier="2"/>'))
    assert [j.kind for j in doll.joints] == ['hinge', 'hinge']
    assert notes == ('to_c: mimics to_b: becomes an independent joint',)


def test_a_shape_of_no_size_is_ignored_with_a_note(tmp_path):
    doll, notes = read(tmp_path, link('a'), link('b', '<sphere radius="0"/>', 0),
                       joint('b', kind='fixed'))
    assert len(doll.bones) == 1 and notes == ('b: a <sphere> of no size is ignored',)


def test_hinges_apart_keep_the_first_and_say_so(tmp_path):
    doll, notes = read(tmp_path, link('a'), link('v', '', 0), link('b'), joint('v'),
                       joint('b', 'v', xyz='0 0 0.5'))
    assert doll.joints[0].kind == 'hinge'
    assert any('to_b' in note and 'fixed' in note for note in notes)


def test_a_moving_link_without_mass_gets_that_of_water(tmp_path):
    doll, notes = read(tmp_path, link('a'), link('b', mass=0), joint('b'))
    assert doll.bone('b').mass == pytest.approx(1.0)
    assert 'b has no mass' in notes[0]


def test_zero_outside_the_limits_starts_at_the_nearest_angle(tmp_path):
    """As the Panda's elbow: limits -3 to -0.5 start at -0.5, and count from there."""
    text = joint('b', axis='0 1 0').replace('lower="-1" upper="2"', 'lower="-3" upper="-0.5"')
    doll, _ = read(tmp_path, link('a'), link('b', origin='<origin xyz="0 0 1"/>'), text)
    assert doll.joints[0].limits[0] == pytest.approx((-2.5, 0), abs=1e-9)
    # A turn of -0.5 about y takes the child's middle from (0, 0, 1) to (-sin, 0, cos).
    assert np.allclose(doll.bone('b').position, (-math.sin(0.5), 0, 1 + math.cos(0.5)))


def test_a_world_with_a_shape_is_a_bone_of_another_name(tmp_path):
    """Its frame keeps the name: as a rider, which pushes do not refer to."""
    doll, _ = read(tmp_path, link('world'), link('b'), joint('b', 'world'))
    assert [bone.name for bone in doll.bones] == ['world_', 'b']
    assert [(rider.name, rider.bone) for rider in doll.riders] == [('world', 'world_'), ('b', 'b')]


def test_several_shapes_of_a_link_stay_several(tmp_path):
    two = (link('a').replace('</link>', '') + '<collision><origin xyz="0.1 0 0"/><geometry>'
           '<box size="0.1 0.1 0.1"/></geometry></collision></link>')
    doll, _ = read(tmp_path, two)
    assert [part.shape for part in doll.root.shape.parts] == [Box((0.1, 0.1, 0.1))] * 2
    assert np.allclose(doll.root.position, (0.05, 0, 0), atol=1e-12)
    # Side by side they are the uniform box of both.
    assert doll.root.inertia == pytest.approx(Box((0.2, 0.1, 0.1)).inertia(1.0))


def test_shapes_and_inertia_come_back():
    """Bones of several shapes, capsules among them, in their own axes, and own inertias."""
    doll = every_kind()
    for name, changes in (('root', {'shape': HAMMER}), ('stuck', {'shape': HAMMER}),
                          ('hinged', {'moments': (0.02, 0.03, 0.025)}),
                          ('swung', {'shape': HAMMER, 'moments': (0.1, 0.2, 0.15)})):
        doll = doll.replace_bone(name, **changes)
    off = Compound((Part(Box((0.1, 0.2, 0.3)), (0.1, 0, 0), TURN),))
    doll = doll.replace_bone('crossed', shape=off, moments=(0.1, 0.2, 0.15))
    back = doll_from_urdf(to_urdf(doll))
    for bone in doll.bones:
        other = back.bone(bone.name)
        assert other.inertia == pytest.approx(bone.inertia, rel=1e-9)
        assert (other.moments is None) == (bone.moments is None)
        assert np.allclose(from_root(back, other.position), from_root(doll, bone.position),
                           atol=1e-12)
        assert rotation.angle_between(np.array(other.orientation), bone.orientation) < 1e-9
        assert [part.shape for part in other.shape.parts] == [
            part.shape for part in bone.shape.parts]
        for part, wanted in zip(other.shape.parts, bone.shape.parts, strict=True):
            assert np.allclose(part.position, wanted.position, atol=1e-12)
            assert rotation.angle_between(np.array(part.orientation), wanted.orientation) < 1e-9


FLOATING = ('<link name="world"/><joint name="free" type="floating"><parent link="world"/>'
            '<child link="a"/></joint>')


def massive(name, inertia, xyz='0 0 0', rpy='0 0 0', mass=2.0, shape=''):
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    return (f'<link name="{name}"><inertial><origin xyz="{xyz}" rpy="{rpy}"/><mass value="{mass}"/>'
            f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="{ixy}" ixz="{ixz}" iyz="{iyz}"/>'
            f'</inertial>{shape}</link>')


def test_mass_centre_and_inertia_are_those_of_the_link_and_what_it_carries(tmp_path):
    """Against MuJoCo, which makes one body of links that are fixed to each other.

    What is carried has no shape, and an inertia that no solid as dense as matter has.
    """
    mujoco = pytest.importorskip('mujoco')
    box = '<collision><geometry><box size="0.2 0.1 0.3"/></geometry></collision>'
    text = robot(FLOATING, massive('a', (0.03, 0.04, 0.05, 0.005, -0.004, 0.003), '0.01 0.02 0.03',
                                   '0.3 -0.4 0.5', shape=box),
                 massive('b', (1.0, 1.5, 1.2, 0.1, 0.2, 0), '0.1 0 0', '0 1 0', 0.7),
                 '<joint name="to_b" type="fixed"><parent link="a"/><child link="b"/>'
                 '<origin xyz="0 0 0.4" rpy="0.2 0 -0.7"/></joint>')
    model = mujoco.MjModel.from_xml_string(text)
    assert model.nbody == 2
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[1])
    axes = axes.reshape(3, 3)
    bone = doll_from_urdf(text).root
    assert bone.mass == pytest.approx(model.body_mass[1])
    assert bone.position == pytest.approx(model.body_ipos[1], abs=1e-12)
    turn = rotation.matrix(bone.orientation)
    assert turn * bone.inertia @ turn.T == pytest.approx(
        axes * model.body_inertia[1] @ axes.T, abs=1e-9)
    # The box stays where it is: its faces are 0.1, 0.05 and 0.15 m from the link's frame.
    part, = bone.shape.parts
    assert part.shape == Box((0.2, 0.1, 0.3))
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    reach = directions @ bone.position + bone.shape.support(directions @ turn)
    assert reach == pytest.approx([0.1, 0.05, 0.15] * 2)


@pytest.mark.parametrize('inertia', [(0, 0, 0, 0, 0, 0), (1, 1, 3, 0, 0, 0), (-1, 1, 1, 0, 0, 0)])
def test_an_unphysical_inertia_is_ignored_with_a_note(tmp_path, inertia):
    shape = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    doll, notes = read(tmp_path, massive('a', inertia, shape=shape))
    assert doll.root.moments is None and 'no body has its inertia' in notes[0]


def test_what_is_only_a_mesh_becomes_the_box_of_the_same_inertia(tmp_path):
    box = Box((0.1, 0.2, 0.4))
    x, y, z = box.inertia(2.0)
    mesh = ('<link name="a"><inertial><origin xyz="0 0 0.5" rpy="0 0 0"/><mass value="2"/>'
            f'<inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>'
            '<collision><geometry><mesh filename="a.stl"/></geometry></collision></link>')
    doll, notes = read(tmp_path, mesh)
    assert sorted(doll.root.shape.size) == pytest.approx([0.1, 0.2, 0.4])
    assert sorted(doll.root.inertia) == pytest.approx(sorted((x, y, z)))
    assert np.allclose(doll.root.position, (0, 0, 0.5))
    assert 'a.stl is ignored: no such file' in notes[0]
    assert 'box of the same inertia' in notes[1]
    # What no box as dense as matter could have: a cube of water's size.
    doll, notes = read(tmp_path, mesh.replace(f'ixx="{x}"', 'ixx="1"').replace(
        f'iyy="{y}"', 'iyy="1"').replace(f'izz="{z}"', 'izz="1"'))
    assert doll.root.shape.volume == pytest.approx(2e-3)


@pytest.mark.parametrize(('text', 'kind'), [
    ('', errors.Unreadable), ('<robot', errors.Unreadable), ('<sdf/>', errors.WrongForm),
    ('<!DOCTYPE r [<!ENTITY a "x">]><robot>&a;</robot>', errors.Unreadable),
    (robot(), errors.Detached), (robot(link('a'), link('a')), errors.DuplicateName),
    (robot(link('a'), link('b')), errors.Detached),
    (robot(link('a'), joint('b')), errors.UnknownBone),
    (robot(link('a'), link('b'), joint('b'), joint('b')), errors.ConnectedTwice),
    (robot(link('a'), link('b'), joint('b'), joint('a', 'b')), errors.JointCycle),
    (robot(link('a'), link('b'), joint('b', kind='wobbly')), errors.WrongForm),
    (robot(link('a'), link('b'), joint('b', axis='0 0 0')), errors.NotUnit),
    (robot(link('a'), link('b'), joint('b', xyz='0 nan 0')), errors.WrongForm),
    (robot(link('a'), link('b'), joint('b').replace('"-1"', '"3"')), errors.LimitsReversed),
    (robot(link('a', '<box size="1 1 -1"/>')), errors.NotPositive),
    (robot(link('a', '<box size="1 1"/>')), errors.WrongForm),
    # A decimal comma makes two numbers of one.
    (robot(link('a', '<box size="0,1 0,1 0,1"/>')), errors.WrongForm),
    (robot(link('a', '<sphere radius="0,1"/>')), errors.WrongForm),
    (robot(link('a', '<box size="1 1 ${height}"/>')), errors.WrongForm),
    (robot(link('a', '<sphere/>')), errors.WrongForm),
    (robot(link('a', mass=-1)), errors.OutOfRange), (robot(link('a', '')), errors.WrongForm)])
def test_broken_urdf_is_a_named_error(text, kind):
    with pytest.raises(kind):
        doll_from_urdf(text)


def test_a_shipped_robot_falls_limp():
    """The A1 that comes with PyBullet: 22 links with shapes, on their way to the ground."""
    pybullet_data = pytest.importorskip('pybullet_data')
    doll, _ = read_urdf(f'{pybullet_data.getDataPath()}/a1/a1.urdf')
    with Simulation(above_ground(doll)) as simulation:
        top = simulation.state.positions[:, 2].max()
        for _ in range(200):
            state = simulation.advance()
    assert state.positions[:, 2].max() < top - 0.4
    assert np.abs(state.linear_velocities).max() < 0.5


@pytest.mark.parametrize('shape', ['<box size="1 0 1"/>', '<sphere radius="-1"/>',
                                   '<cylinder radius="1" length="0"/>',
                                   '<capsule radius="0" length="1"/>'])
def test_a_size_that_cannot_be_is_told_with_its_link(shape):
    with pytest.raises(errors.NotPositive) as caught:
        doll_from_urdf(f'<robot name="r">{link("forearm", shape)}</robot>')
    assert caught.value.path.startswith('link forearm.')

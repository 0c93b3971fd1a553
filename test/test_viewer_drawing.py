"""What the page draws: meshes, dials of joint limits, skins, the pointer's geometry."""
from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('viser')
import fit_rigs
from fit_rigs import RIGS
from specimens import OCTAHEDRON, SPECIMENS

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.fit.skin import skin_of
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.coordinates import GeneralizedState
from ragdoll_ros.model.plane import Plane
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll, SkeletonFrame
from ragdoll_ros.model.scene import Placement, Scene, above_ground
from ragdoll_ros.model.shapes import Box, Part, Sphere
from ragdoll_ros.model.skeleton import Riders
from ragdoll_ros.model.state import State
from ragdoll_ros.model.static_body import StaticBody
from ragdoll_ros.physics.engine.protocol import GROUND
from ragdoll_ros.physics.sensors.impact_arrow import ImpactArrow
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.recording import Rods
from ragdoll_ros.viewer.drawing import framing
from ragdoll_ros.viewer.drawing.bodies import Bodies
from ragdoll_ros.viewer.drawing.joint_balls import joint_balls
from ragdoll_ros.viewer.drawing.joint_limits import ARC_SEGMENTS, RIM, SPOKES, JointLimits
from ragdoll_ros.viewer.drawing.meshes import COARSE, MESHES, SEGMENTS
from ragdoll_ros.viewer.drawing.overlays import (
    LABEL_GAP,
    MOST_LABELS,
    Overlays,
    apart,
    arrow_to_surface,
    force_arrows,
)
from ragdoll_ros.viewer.drawing.skin_meshes import SkinMeshes
from ragdoll_ros.viewer.drawing.stage import CELL, FADE, draw_static_bodies, grid_size
from ragdoll_ros.viewer.pointer import nearest_bone, target_at_distance, to_bone_frame
from ragdoll_ros.viewer.sources.recent_impacts import RecentImpacts
from ragdoll_ros.viewer.sources.source import Frame

CORNERS = SEGMENTS / 2 * np.sin(2 * np.pi / SEGMENTS)
"""Area of the polygon of SEGMENTS corners in a circle of radius 1, which stands for pi."""


@pytest.mark.parametrize(('meshes', 'kind', 'volume', 'tolerance'), [
    (MESHES, 'box', 1, 1e-12), (MESHES, 'cylinder', CORNERS / 4, 1e-12),
    # A ball of flat faces lacks some of its volume, here 3 %, a coarse one 12 %.
    (MESHES, 'sphere', np.pi / 6, 0.03), (COARSE, 'sphere', np.pi / 6, 0.13)])
def test_a_mesh_is_closed_seen_from_outside_and_of_size_one(meshes, kind, volume, tolerance):
    """Each edge is run once each way; by the divergence theorem the volume is positive, right."""
    vertices, faces = meshes[kind]
    assert np.ptp(vertices, axis=0) == pytest.approx([1, 1, 1])
    corners = vertices[faces]
    assert np.einsum('ti,ti->', corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6 \
        == pytest.approx(volume, rel=tolerance)
    _, same = np.unique(vertices.round(9), axis=0, return_inverse=True)
    edges = same.ravel()[faces][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    there = set(map(tuple, edges.tolist()))
    assert len(there) == len(edges)
    assert there == {(b, a) for a, b in there}


HULLS = Compound((*OCTAHEDRON.parts,
                  Part(OCTAHEDRON.parts[0].shape, (0.3, 0.1, 0), (0, 0.6, 0, 0.8))))
HULLS = HULLS.in_frame(HULLS.principal_pose())


@pytest.mark.parametrize('shape', [*SPECIMENS.values(), OCTAHEDRON, HULLS],
                         ids=[*SPECIMENS, 'hull', 'hulls'])
def test_what_is_drawn_of_a_bone_reaches_as_far_as_its_shape(shape):
    """Along any direction; flat faces of balls lack 1.7 % of a radius of 0.2 m."""
    import viser
    rng = np.random.default_rng(6)
    bone = Bone('b', shape, 1, (1, 2, 3), rng.normal(size=4))
    scene = Scene('s', (Placement(Ragdoll('d', (bone,))),))
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    state = State(rng.normal(size=(1, 3)), rotation.normalized(rng.normal(size=(1, 4))),
                  *np.zeros((2, 1, 3)))
    points = []
    batches = Bodies(server, scene, state).batches
    assert len(batches) == len({part.kind for part in bone.shape.primitives})
    for batch in batches:
        vertices = batch.handle.vertices
        for place, wxyz, scale in zip(batch.handle.batched_positions, batch.handle.batched_wxyzs,
                                      batch.handle.batched_scales, strict=True):
            points.append(place + rotation.rotate(wxyz[[1, 2, 3, 0]], vertices * scale))
    server.stop()
    directions = rotation.normalized(rng.normal(size=(50, 3)))
    found = (np.concatenate(points) @ directions.T).max(axis=0)
    back = rotation.inverse(state.orientations[0])
    expected = directions @ state.positions[0] + shape.support(rotation.rotate(back, directions))
    assert found == pytest.approx(expected, abs=3.5e-3)


def all_kinds():
    """A doll of three limited joints of every kind, its bones turned askew."""
    rng = np.random.default_rng(5)
    bones = tuple(Bone(name, Box((0.2, 0.1, 0.3)), 1, position, rng.normal(size=4))
                  for name, position in (('a', (0, 0, 1)), ('b', (0, 0, 0.5)),
                                         ('c', (0.5, 0, 1)), ('d', (-0.5, 0, 1))))
    joints = (Joint('a', 'b', 'hinge', (0, 0, 0.75), ((1, 1, 0),), ((-2, 2),)),
              Joint('a', 'c', 'universal', (0.25, 0, 1), ((0, 1, 0), (0, 0, 1)),
                    ((-1.5, 1.5), (-1.2, 1.2))),
              Joint('a', 'd', 'ball', (-0.25, 0, 1), ((1, 0, 1),), ((-1.4, 1.4), (-2.0, 2.0))))
    return Ragdoll('d', bones, joints)


def drawn(server):
    """Lines of all dials."""
    return server.scene.get_handle_by_name('/scene/limits')


def test_the_last_needle_of_each_joint_moves_with_the_child():
    """All angles of a joint turn the child: so does the needle of its last angle.

    Where the child carries it is taken from the child's own pose; 1e-4 m: the engine's joints
    gap by less here, and the page's numbers have 32 bits.
    """
    import viser
    doll = all_kinds()
    scene = Scene('s', (Placement(doll, spin=(3, -2, 4)),), gravity=(0, 0, 0))
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    limits = JointLimits(server, scene)
    with Simulation(scene) as simulation:
        begin = simulation.state
        limits.show(begin, simulation.joint_angles)
        first = drawn(server).points.copy()
        for _ in range(30):
            state = simulation.advance()
        assert np.abs(simulation.joint_angles).max() > 0.2
        limits.show(state, simulation.joint_angles)
    needles, before = drawn(server).points[-6:], first[-6:]
    assert len(drawn(server).points) == RIM + SPOKES + 6 * (ARC_SEGMENTS + 1)
    for child, row in (('b', 0), ('c', 2), ('d', 5)):
        index = scene.bone_index(child)
        local = rotation.rotate(rotation.inverse(begin.orientations[index]),
                                before[row] - begin.positions[index])
        carried = state.positions[index] + rotation.rotate(state.orientations[index], local)
        assert np.abs(carried - needles[row]).max() < 1e-4
    limits.show(state, None)
    assert not drawn(server).visible
    server.stop()


@pytest.mark.parametrize('corner', [(0, -1, -1), (1, 1, -1), (2, 1, 1), (3, -1, 1)])
def test_a_limb_at_both_ends_of_its_swing_points_at_the_corner_of_its_cone(corner):
    """Its twist axis as the child, placed there by the engine, carries it; whatever the twist."""
    import viser
    quarter, x, y = corner
    whole = all_kinds()
    doll = Ragdoll('d', tuple(bone for bone in whole.bones if bone.name in 'ad'), whole.joints[-1:])
    (joint,), child = doll.joints, doll.bone('d')
    scene = Scene('s', (Placement(doll, orientation=(0.5, 0.1, 0.3, 0.8)),), gravity=(0, 0, 0))
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    limits = JointLimits(server, scene)
    with Simulation(scene) as simulation:
        q, v = simulation.coordinates.q.copy(), simulation.coordinates.v
        q[7:10] = 1.4 * x, 1.4 * y, 0.6
        state = simulation.place(GeneralizedState(q, v))
        assert simulation.joint_angles == pytest.approx((1.4 * x, 1.4 * y, 0.6), abs=1e-9)
        limits.show(state, simulation.joint_angles)
    index = scene.bone_index('d')
    carried = rotation.multiply(state.orientations[index], rotation.inverse(child.orientation))
    anchor = state.positions[index] + rotation.rotate(
        carried, np.subtract(joint.anchor, child.position))
    # The limb is on the other side of the anchor than the axis points to.
    ahead = rotation.rotate(carried, -np.array(joint.axes[0]))
    points = drawn(server).points[RIM * quarter // 4, 0] - anchor
    assert points == pytest.approx(0.15 * ahead, abs=1e-6)
    server.stop()


def test_needles_are_red_at_their_limit():
    import viser

    from ragdoll_ros.viewer.drawing.joint_limits import GREEN, RED
    scene = load_scene('drop')
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    limits = JointLimits(server, scene)
    with Simulation(scene) as simulation:
        angles = simulation.joint_angles
        state = simulation.state
    pairs = [pair for joint in scene.dolls[0].doll.joints for pair in joint.angle_limits]
    angles = np.array([(low + high) / 2 for low, high in pairs])
    angles[3] = pairs[3][1] + 0.1
    limits.show(state, angles)
    colors = drawn(server).colors[-len(angles):, 0].tolist()
    assert [tuple(color) for color in colors] == [
        RED if k == 3 else GREEN for k in range(len(angles))]
    server.stop()


def test_the_arrows_of_a_doll_at_rest_bear_its_weight():
    """Those at the ground: their sum is straight up, mass times gravity within 1 %; each begins
    there and is as long as its N are; and the doll lies on more than one of its ten bones.
    """
    scene = load_scene('drop')
    with Simulation(scene) as simulation:
        while not simulation.asleep:
            state = simulation.advance()
        contacts = simulation.contacts
    low = contacts.b == GROUND
    frame = Frame(scene, 0.0, state, contacts=contacts.positions[low],
                  forces=(contacts.normals * contacts.forces[:, None])[low],
                  pairs=np.stack([contacts.a, contacts.b, contacts.bodies], axis=1)[low])
    arrows, newtons = force_arrows(frame)
    doll = scene.dolls[0].doll
    weight = doll.mass * -scene.gravity[2]
    assert 2 <= len(arrows) <= 10
    along = np.diff(arrows, axis=1)[:, 0]
    pulled = (along / np.linalg.norm(along, axis=1)[:, None] * newtons[:, None]).sum(axis=0)
    assert pulled == pytest.approx((0, 0, weight), abs=0.01 * weight)
    assert np.linalg.norm(along, axis=1) == pytest.approx(newtons / (9.8 * doll.mass))
    assert abs(arrows[:, 0, 2]).max() < 0.001
    assert (np.diff(newtons) <= 0).all()


def test_a_bone_between_wall_and_floor_has_an_arrow_of_each():
    scene = load_scene('drop')
    with Simulation(scene) as simulation:
        frame = Frame(scene, 0.0, simulation.state, contacts=np.zeros((3, 3)),
                      forces=np.array([(0, 0, 300.0), (0, 0, 300), (500, 0, 0)]),
                      pairs=np.array([(0, GROUND, GROUND), (0, GROUND, GROUND), (0, GROUND, 0)]))
    _, newtons = force_arrows(frame)
    assert newtons.tolist() == [600, 500]


def test_no_arrow_where_a_source_knows_no_forces():
    scene = load_scene('drop')
    with Simulation(scene) as simulation:
        frame = Frame(scene, 0.0, simulation.state, contacts=np.zeros((3, 3)))
    arrows, newtons = force_arrows(frame)
    assert len(arrows) == len(newtons) == 0


@pytest.mark.parametrize('count', [0, 1, 2, 3, 5, 6, 8, 12, 40])
def test_labels_do_not_lie_on_stronger_ones(count):
    """Each tip has one, or lies near a stronger one that has, or there are as many as may be."""
    tips = np.random.default_rng(count).uniform(0, 1, (count, 3)) * (1, 1, 0.1)
    labelled = apart(tips)
    assert sorted(labelled) == labelled and len(labelled) <= MOST_LABELS
    assert labelled[:1] == [0][:count]
    distances = np.linalg.norm(tips[:, None] - tips[None], axis=2)
    for index in range(count):
        stronger = [other for other in labelled if other < index]
        near = (distances[index, stronger] < LABEL_GAP).any()
        assert (index in labelled) == (not near and len(stronger) < MOST_LABELS)


@pytest.fixture(scope='module')
def fit():
    return fit_rigs.fitted('mixamo')


def seen(skin, doll, state):
    """Vertices (v, 3) as three.js skins them: sum of W_b T_b inv(T_b in the bind pose) v."""
    moved = np.zeros_like(skin.vertices)
    for index, weight in zip(skin.bones, skin.weights.T, strict=True):
        bone = doll.bones[index]
        local = rotation.rotate(rotation.inverse(bone.orientation),
                                skin.vertices - np.array(bone.position))
        moved += weight[:, None] * (state.positions[index] + rotation.rotate(
            state.orientations[index], local))
    return moved


def with_model(fit, tmp_path):
    return dataclasses.replace(fit.doll, model=str(fit_rigs.write(RIGS['mixamo'], tmp_path)))


def test_a_skin_follows_as_its_riders_say(fit, tmp_path):
    """After a fall, by riders.py's formula with all 52 riders, though ours has fewer bones."""
    doll = with_model(fit, tmp_path)
    skin = skin_of(doll)
    assert len(skin.bones) < len(doll.riders) == 52
    assert np.allclose(skin.weights.sum(axis=1), 1)
    scene = above_ground(doll)
    riders = Riders(scene)
    with Simulation(scene) as simulation:
        for _ in range(60):
            state = simulation.advance()
    places, turns = riders.poses(state)
    character = fit.character
    order = [riders.names.index(name) for name in character.bone_names]
    expected = np.zeros_like(character.vertices)
    for slot, weight in zip(character.bones.T, character.weights.T, strict=True):
        local = rotation.rotate(rotation.inverse(character.orientations[slot]),
                                character.vertices - character.positions[slot])
        k = np.array(order)[slot]
        expected += weight[:, None] * (places[k] + rotation.rotate(turns[k], local))
    found = seen(skin, doll, state)
    assert np.abs(found - character.vertices).max() > 0.1
    assert np.abs(found - expected).max() < 1e-6


def test_a_skin_comes_in_the_size_that_its_doll_was_fitted_in(fit, tmp_path):
    """`ragdoll_fit --scale 2` makes a doll twice as large; the file stays as it is."""
    model = with_model(fit, tmp_path).model
    double = fit_character(read_character(model, scale=2.0)).doll
    skin = skin_of(dataclasses.replace(double, model=model))
    assert np.allclose(skin.vertices, 2 * fit.character.vertices, atol=1e-6)


def test_a_skin_that_does_not_fit_is_told(fit, tmp_path):
    assert skin_of(fit.doll) is None
    doll = with_model(fit, tmp_path)
    with pytest.raises(errors.RagdollError, match='riders'):
        skin_of(dataclasses.replace(doll, riders=doll.riders[:-1]))
    Path(doll.model).write_bytes(b'rubbish')
    with pytest.raises(errors.RagdollError, match=Path(doll.model).name):
        skin_of(doll)
    Path(doll.model).unlink()
    with pytest.raises(errors.RagdollError, match=Path(doll.model).name):
        skin_of(doll)


def test_rods_from_masses_alone_are_the_simulations():
    scene = load_scene('ponytail')
    with Simulation(scene) as simulation:
        for _ in range(40):
            state = simulation.advance()
        swings = simulation.swings
        rods = Rods(scene)
        assert rods.count == 8
        expected = np.stack([swings.roots, swings.positions], axis=1)
        assert np.abs(rods.ends(swings.positions, state) - expected).max() < 1e-9


def test_the_pointer_keeps_its_distance():
    """Target = C + D |A - C|, D of length one toward the pointer."""
    eye, point = np.array([4.0, 0, 1]), np.array([0.0, 0, 1])
    assert target_at_distance(eye, np.array([0.0, 3, 1]), 4.0) == pytest.approx([0.8, 2.4, 1])
    assert target_at_distance(eye, point, 4.0) == pytest.approx(point)
    assert target_at_distance(eye, eye, 4.0) == pytest.approx(eye)


def test_the_nearest_body_and_its_point():
    bones = (Bone('a', Sphere(0.5), 1, (0, 0, 0)), Bone('b', Box((2, 0.2, 0.2)), 1, (0, 1, 0)))
    joints = (Joint('a', 'b', 'fixed', (0, 0.5, 0)),)
    scene = Scene('s', (Placement(Ragdoll('d', bones, joints)),), gravity=(0, 0, 0))
    with Simulation(scene) as simulation:
        state = simulation.state
    # Nearer to a's centre than to b's, but b reaches far out.
    assert nearest_bone(scene, state, np.array([0.95, 0.9, 0])) == 1
    assert nearest_bone(scene, state, np.array([0.3, 0.3, 0])) == 0
    assert to_bone_frame(scene, state, 1, np.array([5.0, 1.05, 0])) == pytest.approx([1, 0.05, 0])


@pytest.mark.parametrize(('push', 'tip'), [
    (Push('box', (0, 2000, 0)), (1, -1, 3)), (Push('box', (0, -500, 0)), (1, 5, 3)),
    # Turned by 90 degrees about z, its length of 6 m along x is along y.
    (Push('box', (8, 0, 0), local=True), (1, -1, 3)),
    (Push('box', (0, 0, -8), point=(1, 0.5, 0.5)), (2, 2.5, 4))])
def test_the_arrow_of_a_push_ends_before_the_body(push, tip):
    """Of a box of 6 x 4 x 2 m; the arrow is as long and runs as the push says."""
    box, place = Bone('box', Box((6, 4, 2)), 1, (0, 0, 0)), np.array((1.0, 2.0, 3.0))
    turn = rotation.from_rpy(0, 0, np.pi / 2)
    arrow = arrow_to_surface(box, push, place, turn)
    assert arrow[1] == pytest.approx(tip)
    assert np.diff(arrow, axis=0) == pytest.approx(np.diff(push.arrow(place, turn), axis=0))


def test_a_character_that_cannot_be_opened_is_told_and_the_doll_shown_without():
    """A path that is too long for the system, or through what is no folder: no error of Python."""
    import viser
    ball = Ragdoll('d', (Bone('b', Sphere(0.1), 1, (0, 0, 0)),),
                   riders=(SkeletonFrame('r', 'b', (0, 0, 0)),))
    dolls = tuple(Placement(dataclasses.replace(ball, model=model), name=name)
                  for name, model in (('long', 'm' * 300), ('through', f'{__file__}/x.glb')))
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    skins = SkinMeshes(server, Scene('s', dolls))
    server.stop()
    assert [note.split(':')[0] for note in skins.notes] == ['no skin for long',
                                                            'no skin for through']
    assert all('expected a' in note for note in skins.notes) and not skins.handles


@pytest.mark.parametrize('name', ['drop', 'crowd', 'field'])
def test_the_ground_is_below_all_dolls_seen_from_home(name):
    """The grid fades with the distance, to nothing at its reach; its lines stay apart.

    A line of the grid nearer than half the reach is 1.5 of 600 pixels or more from the next.
    """
    scene = load_scene(name)
    with Simulation(scene) as simulation:
        balls = framing.bounding_spheres(scene, simulation.state)
    look_at = framing.box_center(*balls)
    eye = framing.home_position(*balls, look_at, fov=0.8, aspect=1.2)
    cell, reach = grid_size(scene)
    assert np.linalg.norm(balls[0] - eye, axis=1).max() < 0.9 * reach
    apart = 300 / np.tan(0.4) * eye[2] * cell / (reach / 2) ** 2
    assert apart > 1.5
    assert (cell, reach) == (CELL, FADE) or name != 'drop'


def test_impacts_are_arrows_with_their_ratio_for_a_second():
    import viser
    hit = ImpactArrow((0.0, 0.0, 0.0), (0.0, 0.0, 0.5), '280 N, 2.00 of the limit', True)
    tap = ImpactArrow((1.0, 0.0, 0.0), (1.0, 0.0, 0.1), '14 N, 0.10 of the limit', False)
    scene, recent = load_scene('drop'), RecentImpacts()
    assert recent.add(0, 1.0, (hit,)) == recent.add(0, 1.0, (hit,)) == (hit,)
    assert recent.add(0, 1.5, (tap,)) == (hit, tap)
    assert recent.add(0, 2.1, ()) == (tap,)
    assert recent.add(1, 2.2, ()) == ()
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    overlays = Overlays(server)
    with Simulation(scene) as simulation:
        state = simulation.state
    overlays.show(Frame(scene, 0.0, state, impacts=(tap, hit)))
    for kind, arrow in (('impacts', tap), ('impacts_above', hit)):
        points = server.scene.get_handle_by_name(f'/scene/{kind}').points
        np.testing.assert_allclose(points, [(arrow.tail, arrow.tip)], atol=1e-6)
    labels = [server.scene.get_handle_by_name(f'/scene/impacts_labels/{k}') for k in range(2)]
    assert [label.text for label in labels] == [hit.text, tap.text]
    overlays.show(Frame(scene, 0.0, state))
    assert not server.scene.get_handle_by_name('/scene/impacts').visible
    assert server.scene.get_handle_by_name('/scene/impacts_labels/0') is None
    server.stop()


def test_a_plane_is_drawn_from_above_alone():
    """From below it would hide the whole scene, as in a corner of walls."""
    import viser
    slope = StaticBody('slope', Plane(), (1.0, 0.0, 0.5), (0.0, 0.1, 0.0, 1.0))
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    draw_static_bodies(server, dataclasses.replace(load_scene('drop'), bodies=(slope,)))
    mesh = server.scene.get_handle_by_name('/scene/static/surface_0')
    server.stop()
    vertices, faces = mesh.vertices, mesh.faces
    normal = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]],
                      vertices[faces[:, 2]] - vertices[faces[:, 0]])
    assert mesh.side == 'front' and not mesh.cast_shadow
    assert (normal[:, 2] > 0).all() and not normal[:, :2].any() and not vertices[:, 2].any()


def test_the_hulls_of_a_static_body_are_drawn_as_one_mesh():
    import viser
    rock = StaticBody('rock', HULLS, (1.0, 0.0, 0.5), (0.0, 0.1, 0.3, 1.0))
    server = viser.ViserServer('127.0.0.1', 0, verbose=False)
    draw_static_bodies(server, dataclasses.replace(load_scene('drop'), bodies=(rock,)))
    mesh = server.scene.get_handle_by_name('/scene/static/hulls_0')
    server.stop()
    drawn = mesh.position + rotation.rotate(mesh.wxyz[[1, 2, 3, 0]], mesh.vertices)
    own = [part.pose.apply(part.shape.vertices) for part in rock.parts]
    # Sent as floats of 32 bits.
    np.testing.assert_allclose(drawn, np.concatenate(own), atol=1e-6)


def test_a_ball_at_each_joint_reaches_into_both_bones():
    """Of points all over a ball some are within the one bone and some within the other."""
    scene = load_scene('drop')
    doll = scene.dolls[0].doll
    balls = joint_balls(scene)
    assert len(balls) == len(doll.joints) == 9
    points = np.random.default_rng(1).normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for joint, (parent, child, ball) in zip(doll.joints, balls, strict=True):
        assert (doll.bones[parent].name, doll.bones[child].name) == (joint.parent, joint.child)
        centre = doll.bones[parent].pose.apply(np.array(ball.position))
        np.testing.assert_allclose(centre, joint.anchor, atol=1e-12)
        for bone in (doll.bones[parent], doll.bones[child]):
            local = bone.pose.apply_inverse(centre + ball.size[0] / 2 * points)
            assert (np.abs(local) < bone.shape.half_extents).all(axis=1).any()


def test_a_large_crowd_has_no_balls_at_its_joints():
    assert len(joint_balls(load_scene('crowd'))) == 90
    assert joint_balls(load_scene('field')) == []

"""Recordings of fitted characters as their own file: bones, skin, images, read back by libraries
that are not ours.
"""
from __future__ import annotations

import base64
import dataclasses
import io
import json
import zipfile

import fit_rigs
import imageio.v3 as iio
import numpy as np
import pytest
import test_fit_rigid
import wild_rigs
from test_fit_split_characters import SMALL, person, write_two
from test_recordings_formats import moved, to_ros

from ragdoll_ros import Riders, load_animations
from ragdoll_ros.fit.pipeline import fit_character, fit_characters
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import rotation
from ragdoll_ros.model.pose import Pose
from ragdoll_ros.model.scene import Placement, Scene, above_ground
from ragdoll_ros.recordings.bvh_file import bvh_text
from ragdoll_ros.recordings.gltf.gltf_file import gltf_bytes
from ragdoll_ros.recordings.mcap_file import load_recording
from ragdoll_ros.recordings.save import save_recording
from ragdoll_ros.replay.command import main as replay_command
from ragdoll_ros.viewer.timeline.export import export_zip

TICKS = 30

TYPES = {5121: '<u1', 5123: '<u2', 5125: '<u4', 5126: '<f4'}

WIDTHS = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3, 'VEC4': 4, 'MAT4': 16}


def png(color):
    return iio.imwrite('<bytes>', np.full((4, 4, 3), color, np.uint8), extension='.png')


def dressed(folder):
    """A person with fingers in centimetres, lying on a turned armature, with what files have: two
    materials with images, an animation, a camera, a floor, VRM's humanoid.
    """
    rig = dataclasses.replace(fit_rigs.RIGS['turned_scaled_moved'], name='dressed',
                              bones=fit_rigs.humanoid('mixamo', fingers=True))
    points, faces, joints, _ = skin = fit_rigs.skin(rig.bones)
    made = fit_rigs.document(rig, skin)
    data = made.data
    (folder / 'cloth of the legs.png').write_bytes(png((200, 40, 40)))
    data['images'] = [
        {'name': 'Face', 'bufferView': made.view(png((9, 90, 200))), 'mimeType': 'image/png'},
        {'name': 'Cloth', 'uri': 'cloth%20of%20the%20legs.png'},
        {'name': 'Lost', 'uri': 'lost.png'}]
    data['samplers'] = [{'wrapS': 33071}]
    data['textures'] = [{'source': 0, 'sampler': 0}, {'source': 1, 'name': 'cloth'}, {'source': 2}]
    data['extensionsUsed'] = ['KHR_materials_emissive_strength', 'VRMC_vrm']
    data['materials'] = [
        {'name': 'Skin', 'pbrMetallicRoughness': {'baseColorTexture': {'index': 0}},
         'extensions': {'KHR_materials_emissive_strength': {'emissiveStrength': 2.0}}},
        {'name': 'Trousers', 'normalTexture': {'index': 2},
         'pbrMetallicRoughness': {'baseColorTexture': {'index': 1, 'texCoord': 1}}}]
    legs = joints[faces[:, 0], 0] > 40
    parts = tuple(made.accessor(faces[some].reshape(-1, 1), 'u2', 'SCALAR')
                  for some in (~legs, legs))
    uvs = [made.accessor(points[:, axes], 'f4', 'VEC2') for axes in ((0, 1), (1, 2))]
    attributes = {**data['meshes'][0]['primitives'][0]['attributes'],
                  'TEXCOORD_0': uvs[0], 'TEXCOORD_1': uvs[1]}
    data['meshes'] = [{'name': 'Person', 'primitives': [
        {'attributes': attributes, 'material': number, 'indices': part}
        for number, part in enumerate(parts)]}, {'name': 'Floor', 'primitives': [{'attributes': {
            'POSITION': made.accessor(1e3 * np.eye(3), 'f4', 'VEC3')}}]}]
    data['cameras'] = [{'type': 'perspective', 'perspective': {'yfov': 1, 'znear': 0.1}}]
    nodes = data['nodes']
    nodes += [{'name': 'Camera', 'camera': 0}, {'name': 'Floor', 'mesh': 1}]
    data['scenes'] = [{'nodes': [0, len(nodes) - 2, len(nodes) - 1]}]
    data['animations'] = [{'name': 'wave', 'channels': [
        {'sampler': 0, 'target': {'node': len(nodes) - 1, 'path': 'translation'}}], 'samplers': [
        {'input': made.accessor([[0], [1]], 'f4', 'SCALAR', min=[0], max=[1]),
         'output': made.accessor(np.eye(3)[:2], 'f4', 'VEC3')}]}]
    data['extensions'] = {'VRMC_vrm': {'specVersion': '1.0'}}
    data['asset']['copyright'] = 'CC0'
    path = folder / 'dressed.glb'
    path.write_bytes(made.glb())
    return path


class Read:
    """A .glb by pygltflib, its accessors and transforms by numpy."""

    def __init__(self, content):
        pygltflib = pytest.importorskip('pygltflib')
        self.gltf = pygltflib.GLTF2.load_from_bytes(content)
        self.names = [node.name for node in self.gltf.nodes]
        self.parents = [-1] * len(self.names)
        for index, node in enumerate(self.gltf.nodes):
            for child in node.children or []:
                assert self.parents[child] == -1
                self.parents[child] = index

    def numbers(self, accessor):
        entry = self.gltf.accessors[accessor]
        view = self.gltf.bufferViews[entry.bufferView]
        assert view.byteStride is None
        start, width = (view.byteOffset or 0) + (entry.byteOffset or 0), WIDTHS[entry.type]
        return np.frombuffer(self.gltf.binary_blob(), TYPES[entry.componentType],
                             entry.count * width, start).reshape(-1, width).astype(float)

    def name_above(self, node):
        return self.names[self.parents[node]] if self.parents[node] >= 0 else None

    def image(self, index):
        return self.view(self.gltf.images[index].bufferView)

    def view(self, index):
        view = self.gltf.bufferViews[index]
        start = view.byteOffset or 0
        return self.gltf.binary_blob()[start:start + view.byteLength]

    def at_key(self, key):
        """Places each node where the animation has it."""
        (animation,) = self.gltf.animations
        for channel in animation.channels:
            values = self.numbers(animation.samplers[channel.sampler].output)
            setattr(self.gltf.nodes[channel.target.node], channel.target.path, values[key].tolist())
        return self

    def worlds(self):
        """World transform of each node, (n, 4, 4)."""
        found = {-1: np.eye(4)}

        def world(node):
            if node not in found:
                entry, local = self.gltf.nodes[node], np.eye(4)
                if entry.matrix:
                    local = np.reshape(entry.matrix, (4, 4)).T
                else:
                    x, y, z, w = rotation.normalized(entry.rotation or (0, 0, 0, 1))
                    local[:3, :3] = fit_rigs.matrix((x, y, z, w))[:3, :3] * (entry.scale or 1)
                    local[:3, 3] = entry.translation or 0
                found[node] = world(self.parents[node]) @ local
            return found[node]

        return np.array([world(node) for node in range(len(self.names))])

    def skinned(self, node):
        """Vertices (v, 3), world frame of the recording, of a node's mesh by its skin."""
        entry = self.gltf.nodes[node]
        attributes = self.gltf.meshes[entry.mesh].primitives[0].attributes
        points, joints, weights = (self.numbers(getattr(attributes, key))
                                   for key in ('POSITION', 'JOINTS_0', 'WEIGHTS_0'))
        bound = self.gltf.skins[entry.skin]
        matrices = self.worlds()[bound.joints]
        if bound.inverseBindMatrices is not None:
            matrices = matrices @ self.numbers(bound.inverseBindMatrices).reshape(
                -1, 4, 4).transpose(0, 2, 1)
        blended = np.einsum('vk,vkij->vij', weights, matrices[joints.astype(int)])
        return to_ros(np.einsum('vij,vj->vi', blended[:, :3], np.pad(
            points, ((0, 0), (0, 1)), constant_values=1)))


def skinned_mesh(read):
    (node,) = (k for k, node in enumerate(read.gltf.nodes) if node.skin is not None)
    return node


@pytest.fixture(scope='module')
def person_run(tmp_path_factory):
    """The dressed person's file, its doll and a recording of its fall."""
    path = dressed(tmp_path_factory.mktemp('dressed'))
    doll = dataclasses.replace(fit_character(read_character(path)).doll, model=str(path))
    assert len(doll.bones) < 30 < 50 < len(doll.riders)
    recording, states = moved(above_ground(doll), TICKS)
    return path, doll, recording, states


def test_gltf_has_the_bones_of_the_file_below_their_parents(person_run):
    """Each node of the file with its name, and that of its parent, in the order of the file."""
    path, doll, recording, _ = person_run
    file, read = Read(path.read_bytes()), Read(gltf_bytes(recording))
    assert read.names == [*file.names, recording.scene.dolls[0].name]
    for node in range(len(file.names)):
        assert read.name_above(node) == (file.name_above(node) or read.names[-1])
    (theirs,), (ours,) = file.gltf.skins, read.gltf.skins
    assert [read.names[k] for k in ours.joints] == [file.names[k] for k in theirs.joints]
    np.testing.assert_array_equal(read.numbers(ours.inverseBindMatrices),
                                  file.numbers(theirs.inverseBindMatrices))
    assert {rider.name for rider in doll.riders} <= set(read.names)


def test_gltf_has_the_skin_images_and_materials_of_the_file(person_run):
    path, _, recording, _ = person_run
    file, read = Read(path.read_bytes()), Read(gltf_bytes(recording))
    assert [each.name for each in read.gltf.materials] == ['Skin', 'Trousers']
    assert read.gltf.materials[0].extensions == file.gltf.materials[0].extensions
    # An image that is not there leaves its texture out.
    assert [each.name for each in read.gltf.images] == ['Face', 'Cloth']
    assert read.gltf.materials[1].normalTexture is None
    assert read.image(0) == png((9, 90, 200)) and read.image(1) == png((200, 40, 40))
    for each, color in zip(read.gltf.materials, ((9, 90, 200), (200, 40, 40)), strict=True):
        texture = read.gltf.textures[each.pbrMetallicRoughness.baseColorTexture.index]
        assert read.image(texture.source) == png(color)
    assert read.gltf.materials[1].pbrMetallicRoughness.baseColorTexture.texCoord == 1
    assert read.gltf.samplers[read.gltf.textures[0].sampler].wrapS == 33071
    theirs, (ours,) = file.gltf.meshes[0], read.gltf.meshes
    assert ours.name == 'Person'
    for one, other in zip(theirs.primitives, ours.primitives, strict=True):
        assert one.material == other.material
        np.testing.assert_array_equal(file.numbers(one.indices), read.numbers(other.indices))
        for key, number in vars(one.attributes).items():
            if number is not None:
                np.testing.assert_array_equal(file.numbers(number),
                                              read.numbers(getattr(other.attributes, key)))
    assert read.gltf.asset.copyright == 'CC0'
    assert read.gltf.extensionsUsed == ['KHR_materials_emissive_strength']
    assert not read.gltf.cameras and not read.gltf.extensions


def test_gltf_moves_only_what_the_doll_moves(person_run):
    """Bones without a body of their own, such as fingers, have no tracks."""
    _, doll, recording, _ = person_run
    read = Read(gltf_bytes(recording))
    (animation,) = read.gltf.animations
    assert animation.name == recording.scene.name
    moves = {read.names[each.target.node] for each in animation.channels}
    assert moves == {bone.name for bone in doll.bones}
    times = read.numbers(animation.samplers[0].input)[:, 0]
    np.testing.assert_allclose(times, recording.times, atol=1e-7)  # 32 bits


RUNS = ['mixamo', 'centimetres', 'millimetres', 'z_up', 'turned_scaled_moved', 'faces_backwards',
        'no_binds', 'scaled_nodes', 'two_skeletons', 'four_legs', 'feet_mirrored-smooth',
        'feet_of_nothing-smooth', 'hands_and_feet_of_nothing-sharp', 'poles-smooth']


def fall_of(rig, folder):
    """A rig's file, its character as the fit reads it, and its fall."""
    known = rig in fit_rigs.RIGS
    path = (fit_rigs.write(fit_rigs.RIGS[rig], folder) if known
            else wild_rigs.write(wild_rigs.WILD[rig], folder))
    fit = (fit_rigs if known else wild_rigs).fitted(rig)
    recording, states = moved(above_ground(dataclasses.replace(fit.doll, model=str(path))), TICKS)
    return path, read_character(path), recording, states


@pytest.fixture(scope='module', params=RUNS)
def run(request, tmp_path_factory):
    return fall_of(request.param, tmp_path_factory.mktemp('rig'))


def test_every_bone_of_the_file_is_within_a_micrometre_at_every_instant(run):
    """Beside the riders: the file's bones as fixed to the simulation's."""
    _, character, recording, states = run
    riders = Riders(recording.scene)
    read = Read(gltf_bytes(recording))
    nodes = [read.names.index(name) for name in riders.names]
    assert set(riders.names) == set(character.bone_names)
    for key, state in enumerate(states):
        worlds = read.at_key(key).worlds()[nodes]
        np.testing.assert_allclose(to_ros(worlds[:, :3, 3]), riders.poses(state).position,
                                   rtol=0, atol=1e-6)


def test_an_armature_far_from_the_origin_of_its_file_costs_no_digits(tmp_path):
    """40 000 units away 32 bits would leave 4e-5 m."""
    rig = fit_rigs.RIGS['turned_scaled_moved']
    path = fit_rigs.write(dataclasses.replace(rig, root=fit_rigs.matrix(
        (-fit_rigs.HALF, 0, 0, fit_rigs.HALF), 0.01, (400, 0, -300))), tmp_path)
    doll = dataclasses.replace(fit_character(read_character(path)).doll, model=str(path))
    recording, states = moved(above_ground(doll), TICKS)
    read, riders = Read(gltf_bytes(recording)), Riders(recording.scene)
    nodes = [read.names.index(name) for name in riders.names]
    places = read.at_key(TICKS - 1).worlds()[nodes][:, :3, 3]
    np.testing.assert_allclose(to_ros(places), riders.poses(states[-1]).position, rtol=0,
                               atol=1e-6)


def blended(character, recording, state):
    """Sum of w P R^-1 v (v, 3) of a character as the fit reads it, with its bones on the doll's."""
    riders = Riders(recording.scene)
    order = [riders.names.index(name) for name in character.bone_names]
    poses = Pose(*(part[order] for part in riders.poses(state)))
    found = np.zeros_like(character.vertices)
    for bones, weights in zip(character.bones.T, character.weights.T, strict=True):
        there = Pose(character.positions[bones], character.orientations[bones])
        now = Pose(poses.position[bones], poses.orientation[bones])
        found += weights[:, None] * now.apply(there.apply_inverse(character.vertices))
    return found


def test_the_skin_is_where_linear_blend_skinning_has_it(run):
    _, character, recording, states = run
    read = Read(gltf_bytes(recording))
    for key in (0, 13, TICKS - 1):
        # The file's own matrices and weights have 32 bits: 1e-7 of some metres.
        np.testing.assert_allclose(read.at_key(key).skinned(skinned_mesh(read)), blended(
            character, recording, states[key]), rtol=0, atol=2e-6)


def helmeted():
    made = fit_rigs.document(test_fit_rigid.PERSON)
    test_fit_rigid.helmet(made, mirrored=True)
    return made


@pytest.mark.parametrize('made', [test_fit_rigid.parts(), test_fit_rigid.parts(pivots=True),
                                  helmeted()], ids=['parts', 'pivots', 'helmet'])
def test_meshes_without_a_skin_go_with_their_bones(made, tmp_path):
    path = tmp_path / 'rigid.glb'
    path.write_bytes(made.glb())
    character = read_character(path)
    doll = dataclasses.replace(fit_character(character).doll, model=str(path))
    recording, states = moved(above_ground(doll), 20)
    read = Read(gltf_bytes(recording)).at_key(19)
    worlds, nodes = read.worlds(), list(enumerate(read.gltf.nodes))
    drawn = [read.skinned(k) for k, node in nodes if node.skin is not None]
    for k, node in nodes:
        if node.mesh is not None and node.skin is None:
            (part,) = read.gltf.meshes[node.mesh].primitives
            points = read.numbers(part.attributes.POSITION)
            drawn.append(to_ros(points @ worlds[k, :3, :3].T + worlds[k, :3, 3]))
    np.testing.assert_allclose(np.concatenate(drawn), blended(character, recording, states[19]),
                               rtol=0, atol=2e-6)  # 32 bits of some metres


def test_a_compressed_skin_stays_compressed(tmp_path):
    test_fit_draco = pytest.importorskip('test_fit_draco')
    path = tmp_path / 'draco.glb'
    path.write_bytes(test_fit_draco.compressed().glb())
    doll = dataclasses.replace(fit_character(read_character(path)).doll, model=str(path))
    recording, _ = moved(above_ground(doll), 2)
    file, read = Read(path.read_bytes()), Read(gltf_bytes(recording))
    key = test_fit_draco.EXTENSION
    assert key in read.gltf.extensionsUsed and (
        (key in read.gltf.extensionsRequired) == (key in file.gltf.extensionsRequired))
    (theirs,), (ours,) = (each.gltf.meshes[0].primitives for each in (file, read))
    assert ours.extensions[key]['attributes'] == theirs.extensions[key]['attributes']
    assert (read.view(ours.extensions[key]['bufferView'])
            == file.view(theirs.extensions[key]['bufferView']))


@pytest.mark.parametrize('rig', ['mixamo', 'poles-smooth'])
def test_skinning_matrices_are_poses_times_the_files_inverse_bind_matrices(rig, tmp_path):
    """In a file in metres and glTF's axes, of its numbers alone: sum of w P M v."""
    path, _, recording, states = fall_of(rig, tmp_path)
    file, read, riders = Read(path.read_bytes()), Read(gltf_bytes(recording)), Riders(
        recording.scene)
    bound = file.gltf.skins[0]
    inverses = file.numbers(bound.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    poses = riders.poses(states[20])
    order = [riders.names.index(file.names[joint]) for joint in bound.joints]
    matrices = np.tile(np.eye(4), (len(order), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = (rotation.matrix(poses.orientation[order]),
                                               poses.position[order])
    attributes = file.gltf.meshes[0].primitives[0].attributes
    points, joints, weights = (file.numbers(getattr(attributes, key))
                               for key in ('POSITION', 'JOINTS_0', 'WEIGHTS_0'))
    blended = np.einsum('vk,vkij->vij', weights, (matrices @ inverses)[joints.astype(int)])
    expected = np.einsum('vij,vj->vi', blended[:, :3], np.pad(
        points, ((0, 0), (0, 1)), constant_values=1))
    shown = read.at_key(20).skinned(skinned_mesh(read))
    np.testing.assert_allclose(shown, expected, rtol=0, atol=2e-6)  # 32 bits of some metres


def test_trimesh_places_the_bones_and_finds_the_images(person_run):
    trimesh = pytest.importorskip('trimesh')
    _, _, recording, states = person_run
    read = Read(gltf_bytes(recording)).at_key(17)
    shown = trimesh.load(io.BytesIO(b''.join(read.gltf.save_to_bytes())), file_type='glb')
    riders = Riders(recording.scene)
    places = np.array([shown.graph.get(name)[0][:3, 3] for name in riders.names])
    np.testing.assert_allclose(to_ros(places), riders.poses(states[17]).position, rtol=0,
                               atol=1e-6)
    colors = {tuple(np.array(mesh.visual.material.baseColorTexture)[0, 0])
              for mesh in shown.geometry.values()}
    assert colors == {(9, 90, 200), (200, 40, 40)}


def test_twins_share_the_skin_and_have_bones_each(person_run):
    _, doll, *_ = person_run
    one = above_ground(doll).dolls[0]
    scene = Scene('twins', tuple(dataclasses.replace(one, name=name, position=(0, y, 1.5))
                                 for name, y in (('left', 1.0), ('right', -1.0))))
    recording, states = moved(scene, 5)
    read = Read(gltf_bytes(recording))
    assert len(read.gltf.skins) == 2 and len(read.gltf.meshes) == 1 and len(read.gltf.images) == 2
    worlds, riders = read.at_key(4).worlds(), Riders(scene).poses(states[4])
    half = len(doll.riders)
    for number, placement in enumerate(scene.dolls):
        top = read.names.index(placement.name)
        nodes = range(top - len(read.names) // 2 + 1, top)
        nodes = {read.names[node]: node for node in nodes}
        places = [worlds[nodes[rider.name], :3, 3] for rider in doll.riders]
        np.testing.assert_allclose(to_ros(places), riders.position[number * half:][:half],
                                   rtol=0, atol=1e-6)


@pytest.mark.parametrize('skins', [1, 2])
def test_each_of_two_characters_in_a_file_has_its_own_skin(tmp_path, skins):
    path = write_two(tmp_path, person(), person('', SMALL, x=2), skins)
    placed = [fit.placed(str(path)) for fit in fit_characters(read_character(path))]
    whole = Read(path.read_bytes())
    triangles = sum(len(whole.numbers(part.indices)) // 3 for mesh in whole.gltf.meshes
                    for part in mesh.primitives)
    both = 0
    for placement in placed:
        recording, _ = moved(Scene('one', (placement,)), 2)
        read = Read(gltf_bytes(recording))
        shown = read.skinned(skinned_mesh(read))
        (part,) = read.gltf.meshes[read.gltf.nodes[skinned_mesh(read)].mesh].primitives
        corners = read.numbers(part.indices).astype(int)
        both += len(corners) // 3
        middle = (shown[corners[:, 0]].max(axis=0) + shown[corners[:, 0]].min(axis=0)) / 2
        assert middle[1] == pytest.approx(placement.position[1], abs=0.02)
        assert np.ptp(shown[corners[:, 0], 1]) < 2
    assert both == triangles


def test_bvh_has_the_bones_and_the_tree_of_the_file(run, tmp_path):
    """By bvhio; its numbers have 32 bits."""
    bvhio = pytest.importorskip('bvhio')
    _, character, recording, states = run
    (tmp_path / 'run.bvh').write_text(bvh_text(recording))
    root = bvhio.readAsHierarchy(str(tmp_path / 'run.bvh'))
    parents = {joint.Name: joint.Parent and joint.Parent.Name for joint, *_ in root.layout()}
    tops = character.parents.count(-1)
    top = None if tops == 1 else root.Name
    expected = {name: character.bone_names[up] if up >= 0 else top
                for name, up in zip(character.bone_names, character.parents, strict=True)}
    assert parents == expected | ({} if tops == 1 else {top: None})
    riders = Riders(recording.scene)
    for key in (0, 13, TICKS - 1):
        root.loadPose(key)
        read = {joint.Name: to_ros(np.array(joint.PositionWorld) / 100)
                for joint, *_ in root.layout()}
        for name, place in zip(riders.names, riders.poses(states[key]).position, strict=True):
            assert np.linalg.norm(read[name] - place) < 1e-4, (name, key)


def test_bvh_moves_the_doll_again(person_run, tmp_path):
    """Read back as an animation of the doll: its bodies are where they were."""
    _, doll, recording, states = person_run
    (file,) = save_recording(recording, tmp_path / 'run.bvh')
    motion = load_animations(doll, str(file))['run']
    assert motion.duration == pytest.approx(recording.duration, abs=1e-6)
    for key in (0, 17, TICKS - 1):
        placement = motion.place(Placement(doll), recording.times[key])
        for bone, place in zip(doll.bones, states[key].positions, strict=True):
            # A draft exceeds limits by some 1e-5 rad, to which the animation's angles are clipped.
            assert np.linalg.norm(placement.bone_pose(bone).position - place) < 1e-4


def test_the_command_and_the_page_save_the_same(person_run, tmp_path, capsys):
    """From a file of poses alone, whose scene names the character; its file gone, a warning."""
    path, doll, recording, _ = person_run
    own = tmp_path / 'own.glb'
    own.write_bytes(path.read_bytes())
    placement = dataclasses.replace(recording.scene.dolls[0],
                                    doll=dataclasses.replace(doll, model=str(own)))
    scene = dataclasses.replace(recording.scene, dolls=(placement,))
    (run,) = save_recording(dataclasses.replace(recording, scene=scene), tmp_path / 'run.mcap')
    assert replay_command([str(run), '--save', str(tmp_path / 'fall.glb')]) == 0
    made = (tmp_path / 'fall.glb').read_bytes()
    assert Read(made).names == [*Read(path.read_bytes()).names, placement.name]
    with zipfile.ZipFile(io.BytesIO(export_zip(load_recording(run)))) as archive:
        assert archive.read('run.glb') == made
    own.unlink()
    assert capsys.readouterr().err == ''
    assert replay_command([str(run), '--save', str(tmp_path / 'fall.glb')]) == 0
    assert 'warning: ' in (told := capsys.readouterr().err) and 'own.glb' in told


@pytest.mark.parametrize('suffix', ['.glb', '.bvh'])
def test_without_its_file_a_character_is_saved_as_its_doll(person_run, tmp_path, suffix):
    _, doll, recording, _ = person_run
    gone = tmp_path / 'gone.glb'
    placement = dataclasses.replace(recording.scene.dolls[0],
                                    doll=dataclasses.replace(doll, model=str(gone)))
    lost = dataclasses.replace(recording, scene=dataclasses.replace(recording.scene,
                                                                    dolls=(placement,)))
    with pytest.warns(UserWarning, match=rf"{placement.name} .* its doll's bones.*gone\.glb"):
        (file,) = save_recording(lost, tmp_path / f'run{suffix}')
    if suffix == '.glb':
        read = Read(file.read_bytes())
        assert read.names == [*(bone.name for bone in doll.bones), placement.name]
        assert all(node.mesh is not None for node in read.gltf.nodes[:-1])
    heard = []
    save_recording(lost, tmp_path / f'run{suffix}', heard.append)
    assert len(heard) == 1 and 'no such file' in heard[0].lower()


def test_a_broken_file_is_told_and_its_doll_saved(person_run, tmp_path):
    """A mesh whose positions are not there: a fault that no motion needs to read."""
    path, doll, recording, _ = person_run
    content = path.read_bytes()
    length = int.from_bytes(content[12:16], 'little')
    data = json.loads(content[20:20 + length])
    blob = content[28 + length:]
    data['meshes'][0]['primitives'][1]['attributes']['TEXCOORD_1'] = 9999
    data['buffers'] = [{'byteLength': len(blob), 'uri': 'data:application/octet-stream;base64,'
                        + base64.b64encode(blob).decode()}]
    broken = tmp_path / 'broken.gltf'
    broken.write_text(json.dumps(data))
    placement = dataclasses.replace(recording.scene.dolls[0],
                                    doll=dataclasses.replace(doll, model=str(broken)))
    scene = dataclasses.replace(recording.scene, dolls=(placement,))
    with pytest.warns(UserWarning, match='9999'):
        content = gltf_bytes(dataclasses.replace(recording, scene=scene))
    assert {bone.name for bone in doll.bones} <= set(Read(content).names)

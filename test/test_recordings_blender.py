"""Recordings of fitted characters in Blender: runs where its module is, `pip install bpy`."""
from __future__ import annotations

import dataclasses

import fit_rigs
import numpy as np
import pytest
from test_recordings_character import Read, dressed, png
from test_recordings_formats import moved

from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.recordings.gltf.gltf_file import gltf_bytes

bpy = pytest.importorskip('bpy')

TICKS = 60
FPS = 100
"""A key on each frame."""

Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""From glTF's axes to Blender's."""


@pytest.fixture(scope='module', params=['metres', 'centimetres'])
def content(request, tmp_path_factory):
    """Of a .glb: a person tumbles for 0.6 s. That in centimetres is below an armature that is
    scaled by 0.01, turned and moved.
    """
    folder = tmp_path_factory.mktemp(request.param)
    path = (dressed(folder) if request.param == 'centimetres'
            else fit_rigs.write(fit_rigs.RIGS['mixamo'], folder))
    doll = dataclasses.replace(fit_character(read_character(path)).doll, model=str(path))
    placement = Placement(doll, 'faller', (0.0, 0.0, 1.5), (0.36, 0.48, 0.0, 0.8))
    return gltf_bytes(moved(Scene('fall', (placement,)), TICKS)[0])


def opened(content, folder, **options):
    """The armature of a file in an empty Blender."""
    (folder / 'fall.glb').write_bytes(content)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = FPS
    bpy.ops.import_scene.gltf(filepath=str(folder / 'fall.glb'), **options)
    (armature,) = (each for each in bpy.data.objects if each.type == 'ARMATURE')
    return armature


def keys(content):
    """Places of the joints by name, Blender's axes, at each key of a file, with Blender there."""
    read = Read(content)
    (animation,) = read.gltf.animations
    for key, time in enumerate(read.numbers(animation.samplers[0].input)[:, 0]):
        frame = round(time * FPS, 3)
        bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
        yield dict(zip(read.names, read.at_key(key).worlds()[:, :3, 3] @ Z_UP.T, strict=True))


def shown(armature):
    """Places of the joints by name, as Blender has them at its frame."""
    world = np.array(armature.matrix_world, float)
    return {bone.name: world[:3, :3] @ np.array(bone.head, float) + world[:3, 3]
            for bone in armature.pose.bones}


def composed(armature, rests):
    """The same in 64 bits, from the transforms of the curves and from ``rests``, the rest pose of
    each bone in the armature (4, 4) by name.
    """
    world = np.array(armature.matrix_world, float)
    poses = {}
    for bone in armature.pose.bones:
        above = np.eye(4) if bone.parent is None else (
            poses[bone.parent.name] @ np.linalg.inv(rests[bone.parent.name]))
        poses[bone.name] = above @ rests[bone.name] @ np.array(bone.matrix_basis, float)
    return {name: (world @ pose)[:3, 3] for name, pose in poses.items()}


def farthest(places, expected):
    return max(np.linalg.norm(place - expected[name]) for name, place in places.items())


def test_blender_has_the_bones_images_and_materials_of_the_file(content, tmp_path):
    armature, read = opened(content, tmp_path), Read(content)
    joints = read.gltf.skins[0].joints
    assert {bone.name: bone.parent and bone.parent.name for bone in armature.data.bones} == {
        read.names[joint]: read.name_above(joint) if read.parents[joint] in joints else None
        for joint in joints}
    images = {'Face': png((9, 90, 200)), 'Cloth': png((200, 40, 40))} if read.gltf.images else {}
    assert {image.name: bytes(image.packed_file.data) for image in bpy.data.images
            if image.packed_file} == images
    (body,) = (each for each in bpy.data.objects if each.type == 'MESH' and each.vertex_groups)
    assert [slot.name for slot in body.material_slots] == (['Skin', 'Trousers'] if images else [])
    assert {group.name for group in body.vertex_groups} == {read.names[k] for k in joints}


def test_blender_has_the_joints_of_the_first_key_within_a_micrometre(content, tmp_path):
    # By default the bones below a scaled armature are 100 times as long: the joint after one is
    # then the difference of two numbers of some thousand units.
    armature = opened(content, tmp_path, bone_heuristic='TEMPERANCE')
    first = next(keys(content))
    assert farthest(shown(armature), first) < 1e-6


@pytest.mark.parametrize('direction', ['BLENDER', 'TEMPERANCE'])
def test_at_later_keys_only_blenders_rest_pose_is_farther_off(content, tmp_path, direction):
    """Blender's importer places the tip of a bone one unit of the file from its joint, with 32
    bits: a bone at 100 units is at rest turned by up to 4e-6 rad. Joints are off by that times what
    they have turned and moved. The transforms that it has read are exact.
    """
    # Without the guess the rest pose is that of the nodes, which is the first key.
    armature = opened(content, tmp_path, bone_heuristic=direction, guess_original_bind_pose=False)
    read = Read(content)
    worlds = read.worlds()
    above = np.linalg.inv(worlds[read.names.index(armature.name)])
    files, blenders = {}, {}
    for bone in armature.data.bones:
        blenders[bone.name] = np.array(bone.matrix_local, float)
        place = above @ worlds[read.names.index(bone.name)]
        axes = Z_UP @ place[:3, :3] @ Z_UP.T
        # Blender exchanges the axes of the bone.
        exchange = np.round(axes.T @ blenders[bone.name][:3, :3])
        files[bone.name] = np.eye(4)
        files[bone.name][:3] = np.column_stack([axes @ exchange, Z_UP @ place[:3, 3]])
    for expected in keys(content):
        assert farthest(composed(armature, files), expected) < 1e-6
        assert farthest(shown(armature), composed(armature, blenders)) < 1e-6

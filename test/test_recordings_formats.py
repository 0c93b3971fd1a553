"""Recordings as glTF, BVH and CSV, read back by libraries that are not ours."""
from __future__ import annotations

import dataclasses
import io

import numpy as np
import pytest
from samples import every_kind, scene_of

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.push import Push
from ragdoll_ros.model.scene import SECOND, Placement
from ragdoll_ros.model.shapes import Capsule
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.bvh_file import bvh_text
from ragdoll_ros.recordings.gltf.gltf_file import crease_normals, gltf_bytes
from ragdoll_ros.recordings.recording import RecordedPose, Recorder
from ragdoll_ros.recordings.save import FORMATS, csv_text, save_recording

TICKS = 80
LOOKED_AT = (0, 13, 41, TICKS - 1)
"""Instants at which a file is held against the simulation."""


def moved(scene, ticks=TICKS, force=(600.0, 300.0, 0.0)):
    """A recording of a scene whose first bone is pushed, and its states."""
    recorder, states = Recorder(scene), []
    with Simulation(scene, accuracy='draft') as simulation:
        simulation.push(Push(scene.bone_names[0], force, duration=0.2))
        for _ in range(ticks):
            state = simulation.advance()
            recorder.add(simulation.time / SECOND,
                         RecordedPose(state.positions, state.orientations))
            states.append(state)
    return recorder.recording(), states


SCENES = {
    'drop': load_scene('drop'),
    # Joints and shapes of every kind.
    'every kind': scene_of(every_kind()),
    # Far from the world's origin 32 bits are not enough: 3e-5 m.
    'two far away': dataclasses.replace(load_scene('drop'), dolls=tuple(
        Placement(load_scene('drop').dolls[0].doll, name, (400.0, 3.0 * k, 1.0), (0.6, 0, 0, 0.8))
        for k, name in enumerate(('left', 'right'))))}


@pytest.fixture(scope='module', params=SCENES)
def run(request):
    recording, states = moved(SCENES[request.param])
    return recording.scene, recording, states


def joint_places(scene, state):
    """Place of each joint on its child, (j, 3) m, world frame, and the names of the children."""
    names, places = [], []
    for placement, part in zip(scene.dolls, scene.bone_slices, strict=True):
        index = {bone.name: k for k, bone in enumerate(placement.doll.bones, part.start)}
        for joint in placement.doll.joints:
            bone = placement.doll.bone(joint.child)
            local = bone.pose.apply_inverse(np.array(joint.anchor))
            places.append(state.poses(index[joint.child]).apply(local))
            names.append((placement.name, joint.child))
    return names, np.array(places)


def to_ros(points):
    """Back from Y up, facing +Z: what faces +Z there faces +x here, what is up is up."""
    return np.asarray(points) @ np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])


class Shown:
    """A .glb at a key of its animation: parsed by pygltflib, placed by trimesh."""

    def __init__(self, content):
        pygltflib = pytest.importorskip('pygltflib')
        self.gltf = pygltflib.GLTF2.load_from_bytes(content)

    def numbers(self, accessor):
        """What an accessor holds, (n, k), float64."""
        entry = self.gltf.accessors[accessor]
        view = self.gltf.bufferViews[entry.bufferView]
        kind = {5126: '<f4', 5125: '<u4', 5123: '<u2'}[entry.componentType]
        found = np.frombuffer(self.gltf.binary_blob(), kind, view.byteLength // int(kind[-1]),
                              view.byteOffset or 0).reshape(entry.count, -1).astype(float)
        assert found.min(axis=0).tolist() == entry.min and found.max(axis=0).tolist() == entry.max
        return found

    def scene(self, key):
        """Trimesh's scene with each node where the animation has it at a key."""
        trimesh = pytest.importorskip('trimesh')
        (animation,) = self.gltf.animations
        for channel in animation.channels:
            values = self.numbers(animation.samplers[channel.sampler].output)
            setattr(self.gltf.nodes[channel.target.node], channel.target.path, values[key].tolist())
        return trimesh.load(io.BytesIO(b''.join(self.gltf.save_to_bytes())), file_type='glb')


def test_gltf_has_every_joint_within_a_micrometre(run):
    """Joints on the bones as trimesh has placed them, beside the simulation's."""
    scene, recording, states = run
    shown = Shown(gltf_bytes(recording))
    for key in LOOKED_AT:
        placed = shown.scene(key)
        names, places = joint_places(scene, states[key])
        dolls = {placement.name: placement.doll for placement in scene.dolls}
        for (doll, child), place in zip(names, places, strict=True):
            node = child if placed.graph.transforms.parents.get(child) == doll or len(
                dolls) == 1 else next(name for name, up in placed.graph.transforms.parents.items()
                                      if up == doll and name.startswith(child))
            matrix = placed.graph.get(node)[0]
            bone = dolls[doll].bone(child)
            anchor = next(joint.anchor for joint in dolls[doll].joints if joint.child == child)
            local = bone.pose.apply_inverse(np.array(anchor))[[1, 2, 0]]
            read = to_ros(matrix[:3, :3] @ local + matrix[:3, 3])
            assert np.linalg.norm(read - place) < 1e-6, (child, key)


def test_gltf_has_the_bones_shapes_in_their_places(run):
    """As wide along the world's axes as the shapes say, which know nothing of meshes."""
    scene, recording, states = run
    shown = Shown(gltf_bytes(recording)).scene(TICKS - 1)
    low, high = (np.array(edge) for edge in zip(*(
        _box(bone, *states[-1].poses(k)) for k, bone in enumerate(scene.bones)), strict=True))
    size = max(2 * max(bone.shape.half_extents) for bone in scene.bones)
    bounds = to_ros(shown.bounds)
    # A circle of 20 corners is up to 1.3 % less wide than a circle.
    np.testing.assert_allclose(bounds, [low.min(axis=0), high.max(axis=0)], atol=0.013 * size)


def _box(bone, position, orientation):
    """Corners of the box around a bone, along the world's axes."""
    back = rotation.inverse(orientation)
    reach = [bone.shape.support(rotation.rotate(back, sign * axis)) for sign in (-1, 1)
             for axis in np.eye(3)]
    return position - reach[:3], position + reach[3:]


def test_gltf_times_and_turns_are_those_of_the_run(run):
    """Times to 32 bits; from key to key the shorter way, as some readers do not look for it."""
    _, recording, _ = run
    shown = Shown(gltf_bytes(recording))
    (animation,) = shown.gltf.animations
    times = shown.numbers(animation.samplers[0].input)[:, 0]
    np.testing.assert_allclose(times, recording.times, atol=1e-7)
    for channel in animation.channels:
        if channel.target.path == 'rotation':
            values = shown.numbers(animation.samplers[channel.sampler].output)
            assert ((values[1:] * values[:-1]).sum(axis=1) > 0).all()


def test_bvh_has_every_joint_within_a_tenth_of_a_millimetre(run, tmp_path):
    """By bvhio, whose numbers have 32 bits: so far from the origin that is 3e-5 m by itself."""
    bvhio = pytest.importorskip('bvhio')
    scene, recording, states = run
    for index, placement in enumerate(scene.dolls):
        (tmp_path / 'run.bvh').write_text(bvh_text(recording, index))
        root = bvhio.readAsHierarchy(str(tmp_path / 'run.bvh'))
        for key in LOOKED_AT:
            root.loadPose(key)
            read = {joint.Name: to_ros(np.array(joint.PositionWorld) / 100)
                    for joint, *_ in root.layout()}
            names, places = joint_places(scene, states[key])
            for (doll, child), place in zip(names, places, strict=True):
                if doll == placement.name:
                    assert np.linalg.norm(read[child] - place) < 1e-4, (child, key)
            first = scene.bone_slices[index].start + [
                bone.name for bone in placement.doll.bones].index(placement.doll.root.name)
            at = states[key].positions[first]
            assert np.linalg.norm(read[placement.doll.root.name] - at) < 1e-4


def test_bvh_says_its_times(run):
    _, recording, _ = run
    lines = bvh_text(recording).splitlines()
    at = lines.index('MOTION')
    assert lines[at + 1] == f'Frames: {TICKS}' and len(lines) == at + 3 + TICKS
    assert float(lines[at + 2].removeprefix('Frame Time: ')) == pytest.approx(0.01, abs=1e-9)


def test_bvh_of_uneven_times_goes_evenly():
    """A body that moves evenly is where it would be, whenever it was looked at."""
    scene = load_scene('flight')
    recorder, count = Recorder(scene), len(scene.bones)
    for time in (0.0, 0.01, 0.04, 0.05):
        places = np.zeros((count, 3))
        places[:, 0] = time
        recorder.add(time, RecordedPose(places, np.tile((0, 0, 0, 1.0), (count, 1))))
    rows = bvh_text(recorder.recording()).splitlines()[-4:]
    read = [float(row.split()[2]) / 100 for row in rows]  # forward is +Z
    assert read == pytest.approx([0, 0.05 / 3, 0.1 / 3, 0.05], abs=1e-9)


def test_csv_reads_back_to_the_bit(run):
    """By numpy."""
    scene, recording, _ = run
    text = csv_text(recording)
    head = text.partition('\n')[0].split(',')
    table = np.genfromtxt(io.StringIO(text), delimiter=',', skip_header=1)
    np.testing.assert_array_equal(table[:, 0], recording.times)
    poses = table[:, 1:].reshape(TICKS, len(scene.bones), 7)
    np.testing.assert_array_equal(poses[..., :3], recording.positions)
    np.testing.assert_array_equal(poses[..., 3:], recording.orientations)
    assert head[0] == 'time' and head[1:8:6] == [f'{scene.bone_names[0]}.x',
                                                 f'{scene.bone_names[0]}.qw']


def test_normals_of_a_capsule_point_away_from_its_axis():
    """Radially on its barrel, from the ends' centres on its balls: to half a face's 9 degrees."""
    shape = Capsule(0.1, 0.4)
    places, normals = crease_normals(*shape.mesh())
    axis = places.copy()
    axis[:, :2] = 0
    axis[:, 2] = np.clip(places[:, 2], -0.2, 0.2)
    away = rotation.normalized(places - axis)
    assert (normals * away).sum(axis=1).min() > np.cos(np.radians(10))


def test_a_file_is_written_by_its_suffix(tmp_path):
    recording, _ = moved(SCENES['two far away'], 2)
    made = [path.name for suffix in FORMATS
            for path in save_recording(recording, tmp_path / f'run{suffix}')]
    assert made == ['run.mcap', 'run.glb', 'run_left.bvh', 'run_right.bvh', 'run.csv']
    assert sorted(made) == sorted(path.name for path in tmp_path.iterdir())
    with pytest.raises(errors.OutOfRange, match=r'run\.fbx.*\.glb'):
        save_recording(recording, tmp_path / 'run.fbx')
    with pytest.raises(errors.Unreadable, match='can be written'):
        save_recording(recording, tmp_path / 'nowhere' / 'run.csv')

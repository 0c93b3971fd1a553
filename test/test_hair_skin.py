"""The skin of hair follows its swings: on the page, in glTF recordings, and with Riders.

Each against linear blend skinning of the rig's own vertices and weights, with the poses of bones
and of masses that the simulation publishes.
"""
import dataclasses
import re

import fit_rigs
import numpy as np
import pytest
from conserved import matrices
from test_fit_many import hairy
from test_fit_spring_bones import new, old, rig, written
from test_recordings_character import Read

from ragdoll_ros.files.doll import build_doll, doll_data, load_doll, save_doll
from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.fit.skin import skin_of
from ragdoll_ros.model import errors, rotation
from ragdoll_ros.model.ragdoll import Bone, Ragdoll, SkeletonFrame
from ragdoll_ros.model.scene import Placement, Scene, above_ground
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.model.skeleton import Riders
from ragdoll_ros.model.swing import Link, Swing
from ragdoll_ros.model.swing_mount import mount_swings
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.gltf.gltf_file import gltf_bytes
from ragdoll_ros.recordings.recording import Recorder

TICKS = 60


def strands(folder):
    return fit_rigs.write(hairy('hair', strands=6, pieces=4), folder)


def of_hair(name):
    """Swing and link of a bone of those rigs by its name, None of others."""
    strand, _, piece = name.partition('_')
    return (f'{strand}_0', int(piece)) if re.fullmatch(r'hair\d+', strand) else None


def of_tail(name):
    swing = {'new': 'ponytail', 'old': 'tail0'}
    return {key: (value, int(name[4:])) for key, value in swing.items()} if re.fullmatch(
        r'tail\d', name) else {}


CASES = {'hair by its name': (strands, of_hair),
         'VRM 1': (lambda folder: written(folder, new), lambda name: of_tail(name).get('new')),
         'VRM 0': (lambda folder: written(folder, old), lambda name: of_tail(name).get('old'))}


def stands(placement):
    """Pose of a doll's frame in the world at the start."""
    return placement.pose


class Run:
    """A scene of two hairy characters and one without between them, and a second of its motion."""

    def __init__(self, path, link_of):
        fit = fit_character(read_character(path))
        self.character, self.link_of = fit.character, link_of
        self.doll = dataclasses.replace(fit.doll, model=str(path))
        bald = dataclasses.replace(fit_rigs.fitted('vrm').doll, name='bald')
        far = 4 * np.eye(3)
        self.scene = Scene('two', (
            Placement(self.doll, 'first', spin=(0.5, 2, 3)), Placement(bald, 'bald', far[1]),
            Placement(self.doll, 'second', 2 * far[1], (0.6, 0, 0, 0.8), spin=(4, 0, -3))))
        recorder = Recorder(self.scene)
        with Simulation(self.scene, accuracy='draft') as simulation:
            self.start = self.told(simulation)
            recorder.take(simulation)
            for _ in range(TICKS):
                simulation.advance()
                recorder.take(simulation)
            self.end = self.told(simulation)
            self.state, self.rods = simulation.state, simulation.swings.rods
        self.names = [name for mount in mount_swings(self.scene) for name in mount.names]
        self.recording = recorder.recording()

    def told(self, simulation):
        """Published poses as matrices: of bones, and of links, with their axes at their roots."""
        state, swings = simulation.state, simulation.swings
        bones = np.tile(np.eye(4), (len(state.positions), 1, 1))
        bones[:, :3, :3], bones[:, :3, 3] = matrices(state.orientations), state.positions
        links = np.tile(np.eye(4), (len(swings.positions), 1, 1))
        links[:, :3, :3], links[:, :3, 3] = matrices(swings.orientations), swings.rods[:, 0]
        return bones, links

    def moves(self, placement):
        """Motion (b, 4, 4), from the start to the end, of what moves each of a doll's bones."""
        bones, links = (now @ np.linalg.inv(then)
                        for now, then in zip(self.end, self.start, strict=True))
        carrier = {rider.name: rider.bone for rider in self.doll.riders}
        found = []
        for name in self.character.bone_names:
            if self.link_of(name) is None:
                found.append(bones[self.scene.bone_index(f'{placement.name}/{carrier[name]}')])
            else:
                swing, link = self.link_of(name)
                found.append(links[self.names.index(f'{placement.name}/{swing}/{link + 1}')])
        return np.array(found)

    def skinned(self, placement):
        """Vertices (v, 3) at the end, world frame, by the character's own weights."""
        at = np.concatenate([stands(placement).apply(self.character.vertices),
                             np.ones((len(self.character.vertices), 1))], axis=1)
        blended = np.einsum('vk,vkij->vij', self.character.weights,
                            self.moves(placement)[self.character.bones])
        return np.einsum('vij,vj->vi', blended, at)[:, :3]

    def of_hair(self):
        """Whether each vertex has weight on hair, (v,)."""
        hair = np.array([self.link_of(name) is not None for name in self.character.bone_names])
        return (self.character.weights * hair[self.character.bones]).any(axis=1)

    @property
    def hairy(self):
        return [(0, self.scene.dolls[0]), (2, self.scene.dolls[2])]


@pytest.fixture(scope='module', params=CASES)
def run(request, tmp_path_factory):
    write, link_of = CASES[request.param]
    return Run(write(tmp_path_factory.mktemp('hair')), link_of)


def blended(skin, poses):
    """Vertices of a skin whose joints are at poses (b, 4, 4), world frame."""
    bound = np.tile(np.eye(4), (len(skin.positions), 1, 1))
    bound[:, :3, :3], bound[:, :3, 3] = matrices(skin.orientations), skin.positions
    moved = np.einsum('vb,bij->vij', skin.weights, poses @ np.linalg.inv(bound))
    return np.einsum('vij,vj->vi', moved[:, :3, :3], skin.vertices) + moved[:, :3, 3]


def test_riders_of_hair_follow_their_links(run):
    """Of bones and links alike; without rods hair stays where the head has it."""
    riders = Riders(run.scene)
    found = riders.poses(run.state, run.rods)
    still = riders.poses(run.state)
    for _, placement in run.hairy:
        rows = [riders.names.index(f'{placement.name}/{name}')
                for name in run.character.bone_names]
        moves = run.moves(placement)
        at = stands(placement).apply(run.character.positions)
        expected = np.einsum('bij,bj->bi', moves[:, :3, :3], at) + moves[:, :3, 3]
        # The doll's file has 12 decimals, and a link's lengths 9 digits.
        assert np.abs(found.position[rows] - expected).max() < 1e-8
        turned = matrices(found.orientation[rows])
        begun = matrices(rotation.multiply(placement.orientation, run.character.orientations))
        assert np.abs(turned - moves[:, :3, :3] @ begun).max() < 1e-8
        hair = [run.link_of(name) is not None for name in run.character.bone_names]
        apart = np.linalg.norm(found.position[rows] - still.position[rows], axis=1)
        # The stiff ponytail of VRM's settings swings by two centimetres.
        assert apart[np.array(hair)].max() > 0.01
        assert not apart[~np.array(hair)].any()


def test_the_skin_returns_to_the_files_bind_pose_at_rest(run):
    """At the start, where each link is at rest: the file's own vertices, where the doll stands."""
    riders = Riders(run.scene)
    with Simulation(run.scene, accuracy='draft') as simulation:
        found = riders.poses(simulation.state, simulation.swings.rods)
    for _, placement in run.hairy:
        rows = [riders.names.index(f'{placement.name}/{name}')
                for name in run.character.bone_names]
        at = stands(placement).apply(run.character.positions)
        assert np.abs(found.position[rows] - at).max() < 1e-8
    skin = skin_of(run.doll)
    bound = np.tile(np.eye(4), (len(skin.positions), 1, 1))
    bound[:, :3, :3], bound[:, :3, 3] = matrices(skin.orientations), skin.positions
    bones, links = run.start
    joints = np.concatenate([bones[skin.bones], links[skin.links]])
    first = run.scene.dolls[0]
    assert np.abs(blended(skin, joints) - stands(first).apply(skin.vertices)).max() < 1e-8
    assert np.array_equal(skin.vertices, run.character.vertices)


def test_a_gltf_recording_moves_the_hair(run):
    """Read by pygltflib: the files of both, and the bones of the one without."""
    read = Read(gltf_bytes(run.recording)).at_key(TICKS)
    worn = [k for k, node in enumerate(read.gltf.nodes) if node.skin is not None]
    for node, (_, placement) in zip(worn, run.hairy, strict=True):
        # Numbers of 32 bits on places of some metres.
        assert np.abs(read.skinned(node) - run.skinned(placement)).max() < 4e-6


SKINNED = """() => {
  const {scene, nodeRefFromName: nodes} = window.__viserMutable;
  scene.updateMatrixWorld();
  const toWorld = nodes[''].matrixWorld.clone().invert(), found = [];
  scene.traverse(mesh => {
    if (!mesh.isSkinnedMesh) return;
    mesh.skeleton.update();
    const at = mesh.position.clone(), vertices = [];
    for (let k = 0; k < mesh.geometry.attributes.position.count; k++) {
      mesh.getVertexPosition(k, at).applyMatrix4(mesh.matrixWorld).applyMatrix4(toWorld);
      vertices.push(at.toArray());
    }
    found.push(vertices);
  });
  return found;
}"""
"""Vertices of each skin as the graphics card places them, world frame, z up."""


@pytest.fixture(scope='module')
def browser():
    pytest.importorskip('viser')
    from browser import chromium
    with chromium() as context:
        yield context


def test_the_page_moves_the_hair(run, browser):
    """The vertices that three.js skins, of both, at the end of the run."""
    from browser import View
    from page_client import served

    from ragdoll_ros.viewer.sources.playback import PlaybackSource
    with served(PlaybackSource(run.recording)) as page:
        view = View(browser, f'http://127.0.0.1:{page.server.get_port()}')
        view.wait(lambda: page.timeline.clip is not None)
        page.timeline.go_to(run.recording.duration)
        view.wait(lambda: page.frame is not None and page.frame.time == run.recording.duration)
        expected = np.array([run.skinned(placement) for _, placement in run.hairy])

        def follows():
            found = view.page.evaluate(SKINNED)
            if not found or any(len(each) != expected.shape[1] for each in found):
                return False
            # Meshes by skins: a skin may have several, as for outlines.
            apart = np.abs(np.array(found)[:, None] - expected).max(axis=(2, 3))
            # Numbers of 32 bits on places of some metres.
            return apart.min(axis=0).max() < 1e-5 and apart.min(axis=1).max() < 1e-5
        view.wait(follows)
        assert not view.errors
        view.close()


def test_the_thinnest_of_too_many_bodies_carry_their_skin_too(tmp_path):
    """Every bone of each strand is moved by its own link."""
    made = fit_character(read_character(fit_rigs.write(hairy('strand'), tmp_path))).doll
    for swing in made.swings:
        name = swing.name.rpartition('_')[0]
        assert [link.riders for link in swing.links] == [(f'{name}_{k}',) for k in range(5)]


def test_what_hangs_below_a_chain_goes_with_its_link(tmp_path):
    """A ring on the second piece of a ponytail, which VRM 0 leaves out of the chain."""
    made = rig()
    second = next(k for k, bone in enumerate(made.bones) if bone.name == 'tail1')
    fit_rigs.limb(made.bones, second, ['ring'], [(.05, 1.5, -.3), (.09, 1.5, -.3)], [.01])
    [swing] = fit_character(read_character(written(tmp_path, old, made))).doll.swings
    assert [link.riders for link in swing.links] == [('tail0',), ('tail1', 'ring'), ('tail2',)]


def test_a_dolls_file_keeps_them_and_one_without_hair_is_as_before(run, tmp_path):
    path = tmp_path / 'doll.yaml'
    save_doll(run.doll, path)
    assert load_doll(str(path)) == run.doll
    assert all('riders' not in link for swing in doll_data(
        dataclasses.replace(run.doll, swings=tuple(bare(swing) for swing in run.doll.swings)))[
            'swings'] for link in swing['links'])


def bare(swing):
    return dataclasses.replace(swing, links=tuple(
        dataclasses.replace(link, riders=()) for link in swing.links))


def test_hair_that_is_kept_is_rigid_as_its_bodies(tmp_path):
    doll = fit_character(read_character(strands(tmp_path)), FitOptions(keep=('hair0_*',))).doll
    assert not any(rider.startswith('hair0_') for swing in doll.swings for link in swing.links
                   for rider in link.riders)


def small(**riders):
    bones = (Bone('a', Sphere(.1), 1, (0, 0, 0)),)
    links = (Link(.1, riders=riders.get('first', ())), Link(.1, riders=riders.get('second', ())))
    frames = (SkeletonFrame('x', 'a', (0, 0, 0)), SkeletonFrame('y', 'a', (0, 0, .1)))
    return Ragdoll('d', bones, (), (Swing('s', 'a', (0, 0, 0), (1, 0, 0), links),), frames)


def test_wrong_riders_of_links_are_refused():
    with pytest.raises(errors.UnknownBone, match=r"swings\[0\].links\[1\].riders.*'z'.*x, y"):
        small(second=('z',))
    with pytest.raises(errors.DuplicateName, match=r'swings\[0\].links\[1\].riders.*x'):
        small(first=('x',), second=('x',))
    data = doll_data(small(first=('x',)))
    data['swings'][0]['links'][1]['riders'] = ['nobody']
    _, found = build_doll(data)
    assert [error.path for error in found] == ['swings[0].links[1].riders']


def test_a_link_that_points_back_along_its_rest_turns_by_half(tmp_path):
    """Any half turn across it will do; the root is where the rod says."""
    doll = small(first=('x',), second=('y',))
    scene = above_ground(doll)
    with Simulation(scene) as simulation:
        state = simulation.state
    start = state.positions[0]
    rods = start + np.array([[(0, 0, 0), (-.1, 0, 0)], [(-.1, 0, 0), (-.2, 0, 0)]])
    positions, turns = Riders(scene).poses(state, rods)
    assert matrices(turns)[:, :, 0] == pytest.approx(np.array([(-1, 0, 0)] * 2), abs=1e-12)
    assert positions[0] == pytest.approx(start, abs=1e-12)
    assert np.linalg.norm(positions[1] - rods[1, 0]) == pytest.approx(np.hypot(.1, .1))

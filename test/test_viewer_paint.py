"""A character's materials and images as its file has them: on the page, in a recording's glTF."""
from __future__ import annotations

import dataclasses
import io
import re

import fit_rigs
import imageio.v3 as iio
import numpy as np
import pytest

pytest.importorskip('viser')
from browser import SHARPNESS, View, chromium
from page_client import served

from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.fit.skin import skin_of
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.recordings.gltf.gltf_file import gltf_bytes
from ragdoll_ros.recordings.recording import Recorder
from ragdoll_ros.viewer.sources.playback import PlaybackSource
from ragdoll_ros.viewer.static import save_static

LIMBS = {'L_.*(Arm|Hand)': (200, 40, 40), 'R_.*(Arm|Hand)': (40, 160, 60),
         'L_.*(Leg|Foot)': (50, 80, 200), 'R_.*(Leg|Foot)': (220, 180, 40)}
"""sRGB of the limbs, by their bones' names; arms are of one material and image, legs of another."""

BODY = (128, 128, 128)

EYE = """() => {
  const {camera, nodeRefFromName: nodes} = window.__viserMutable;
  return camera.position.clone().applyMatrix4(nodes[''].matrixWorld.clone().invert()).toArray();
}"""

PAINTED = """() => {
  let is = false;
  window.__viserMutable.scene.traverse(each => {
    is = is || Boolean(each.isSkinnedMesh && each.ragdollMaterials && each.material[1]?.map?.image);
  });
  return is;
}"""
"""Whether the skin has both materials, and the second one its image."""

PICTURES = """async () => {
  for (let k = 0; k < 5; k++) await new Promise(drawn => requestAnimationFrame(drawn));
}"""
"""Waits for some pictures more."""


def limb_of(bone):
    """Index of a bone's limb in LIMBS, -1 for the body."""
    return next((k for k, words in enumerate(LIMBS) if re.search(words, bone.name)), -1)


def painted(folder):
    """A character of two materials, each with an image of three stripes; unlit, so that colours
    are what the images say.
    """
    rig = fit_rigs.RIGS['vrm']
    points, faces, joints, _ = skin = fit_rigs.skin(rig.bones)
    made = fit_rigs.document(rig, skin)
    limbs = np.array([limb_of(rig.bones[k]) for k in joints[:, 0]])
    uvs = np.stack([(np.where(limbs < 0, 2, limbs % 2) + 0.5) / 3, np.full(len(points), 0.5)], 1)
    legs = limbs[faces[:, 0]] >= 2
    attributes = {**made.data['meshes'][0]['primitives'][0]['attributes'],
                  'TEXCOORD_0': made.accessor(uvs, 'f4', 'VEC2')}
    colors = list(LIMBS.values())
    for key in ('materials', 'textures', 'images', 'extensionsUsed'):
        made.data[key] = []
    made.data['extensionsUsed'] = ['KHR_materials_unlit']
    primitives = []
    for number, (some, stripes) in enumerate(((~legs, colors[:2]), (legs, colors[2:]))):
        stripe = np.repeat(np.array([[*stripes, BODY]], np.uint8), 8, axis=1).repeat(8, axis=0)
        png = iio.imwrite('<bytes>', stripe, extension='.png')
        made.data['images'].append({'bufferView': made.view(png), 'mimeType': 'image/png'})
        made.data['textures'].append({'source': number})
        made.data['materials'].append({
            'pbrMetallicRoughness': {'baseColorTexture': {'index': number}, 'metallicFactor': 0},
            'extensions': {'KHR_materials_unlit': {}}})
        primitives.append({'attributes': attributes, 'material': number, 'indices': made.accessor(
            faces[some].reshape(-1, 1), 'u4', 'SCALAR')})
    made.data['meshes'] = [{'primitives': primitives}]
    path = folder / 'painted.glb'
    path.write_bytes(made.glb())
    return path


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """A doll with its skin, and 0.4 s of its fall."""
    path = painted(tmp_path_factory.mktemp('painted'))
    doll = dataclasses.replace(fit_rigs.fitted('vrm').doll, model=str(path))
    recorder = Recorder(above_ground(doll))
    with Simulation(recorder.scene, accuracy='draft') as simulation:
        for _ in range(41):
            recorder.take(simulation)
            simulation.advance()
    return recorder.recording(), skin_of(doll)


def posed(skin, pose):
    """Vertices (v, 3) of a skin on its bones: sum of W_b T_b inv(bind_b) v."""
    places = np.zeros_like(skin.vertices)
    for weight, bone, at, turn in zip(skin.weights.T, skin.bones, skin.positions,
                                      skin.orientations, strict=True):
        local = rotation.rotate(rotation.inverse(turn), skin.vertices - at)
        places += weight[:, None] * (pose.positions[bone] + rotation.rotate(
            pose.orientations[bone], local))
    return places


def colors_of(content, corners):
    """SRGB (f, 3) that trimesh reads of the triangles with these corners (f, 3, 3) in the file's
    bind pose, Y up.
    """
    import trimesh
    from scipy.spatial import cKDTree
    scene = trimesh.load(io.BytesIO(content), file_type='glb', process=False)
    keys, colors = [], []
    for mesh in scene.geometry.values():
        uvs = mesh.visual.uv[mesh.faces].mean(axis=1)
        image = mesh.visual.material.baseColorTexture
        colors.append(trimesh.visual.color.uv_to_color(uvs, image)[:, :3])
        keys.append(mesh.triangles_center)
    away, nearest = cKDTree(np.concatenate(keys)).query(corners.mean(axis=1))
    assert away.max() < 1e-5
    return np.concatenate(colors)[nearest]


@pytest.fixture(scope='module')
def browser():
    with chromium() as context:
        yield context


def test_limbs_have_their_colours_on_the_page(run, browser):
    """As a fall goes on: what the page draws where trimesh, which reads the recording's glTF and
    casts a ray at each triangle, sees one of a limb. Means of each limb within 10 %.
    """
    import trimesh
    recording, skin = run
    pose = recording.pose(40)
    content = gltf_bytes(recording)
    with served(PlaybackSource(recording)) as page:
        view = View(browser, f'http://127.0.0.1:{page.server.get_port()}')
        view.page.set_viewport_size({'width': 1280, 'height': 800})
        view.wait(lambda: page.timeline.clip is not None)
        page.timeline.go_to(0.4)
        view.wait(lambda: page.frame is not None and page.frame.time == 0.4)
        view.wait(lambda: view.page.evaluate(PAINTED))
        with view.drawing():
            view.page.evaluate(PICTURES)
            picture = iio.imread(view.page.screenshot())[..., :3].astype(float)
        eye = np.array(view.page.evaluate(EYE))
        whole = trimesh.Trimesh(posed(skin, pose), skin.triangles, process=False)
        middles = whole.triangles_center
        hits = whole.ray.intersects_first(np.tile(eye, (len(middles), 1)), middles - eye)
        pixels = np.round(view.pixels(middles) * SHARPNESS).astype(int)
        assert not view.errors
        view.close()
    expected = colors_of(content, skin.vertices[skin.triangles][..., [1, 2, 0]])
    height, width = picture.shape[:2]
    # Those that face the eye: a pixel at a limb's edge has half of what is behind it.
    facing = ((eye - middles) * whole.face_normals).sum(axis=1) / np.linalg.norm(
        eye - middles, axis=1)
    free = (pixels >= 0).all(axis=1) & (pixels < (0.73 * width, height)).all(axis=1)
    seen = (hits == np.arange(len(middles))) & (facing > 0.7) & free
    drawn = picture[pixels[:, 1].clip(0, height - 1), pixels[:, 0].clip(0, width - 1)]
    for words, color in LIMBS.items():
        mine = seen & (abs(expected - color).max(axis=1) < 3)
        assert mine.sum() > 20, words
        mean, wanted = drawn[mine].mean(axis=0), expected[mine].mean(axis=0)
        assert np.linalg.norm(mean - wanted) < 0.1 * np.linalg.norm(wanted), (words, mean, wanted)


def test_a_page_without_a_server_has_them_too(run, browser, tmp_path):
    recording, _ = run
    path = save_static(recording, tmp_path)
    view = View(browser, path.as_uri())
    view.wait(lambda: view.page.evaluate(PAINTED))
    assert not view.errors
    view.close()


def test_materials_and_images_are_read_as_they_are(run, tmp_path):
    _, skin = run
    appearance = skin.appearance
    assert len(appearance.materials) == len(appearance.textures) == 2
    assert all(texture.image.startswith(b'\x89PNG') for texture in appearance.textures)
    assert set(appearance.material_indices) == {0, 1}
    assert appearance.uvs.shape == (len(skin.vertices), 2)


def test_broken_looks_refuse_no_character(tmp_path):
    """Each left out, with a note where an image is missed."""
    path = painted(tmp_path)
    sound = read_character(path)
    content = path.read_bytes()
    for one, other in ((b'"baseColorTexture": {"index": 0}', b'"baseColorTexture": {"index": 9}'),
                       (b'"baseColorTexture": {"index": 0}', b'"baseColorTexture": {"index":[]}'),
                       (b'"source": 0', b'"source":-1'), (b'\x89PNG', b'\x00PNG'),
                       (b'"image/png"', b'"image/gif"'), (b'"TEXCOORD_0"', b'"TEXCOORD_7"')):
        assert one in content
        path.write_bytes(content.replace(one, other, 1))
        character = read_character(path)
        np.testing.assert_array_equal(character.vertices, sound.vertices)
        assert len(character.appearance.materials) == 2

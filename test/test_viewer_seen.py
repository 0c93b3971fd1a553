"""What should be seen is seen: the silhouette of each scene, whatever was shown before it."""
from __future__ import annotations

import dataclasses

import fit_rigs
import imageio.v3 as iio
import numpy as np
import pytest

pytest.importorskip('viser')
from browser import SHARPNESS, View, chromium
from page_client import served
from PIL import Image, ImageDraw
from scipy.ndimage import binary_dilation
from test_viewer_paint import PICTURES, painted, posed

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.fit.skin import skin_of
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import Ground, Placement, Scene, above_ground
from ragdoll_ros.viewer.drawing.joint_balls import joint_balls
from ragdoll_ros.viewer.drawing.meshes import MESHES
from ragdoll_ros.viewer.sources.simulation import SimulationSource

SIZE = {'width': 1000, 'height': 520}

AGREES = 0.97
"""Share of the pixels of each silhouette, the drawn and the expected, that are at most one pixel
from the other.
"""

DIFFERS = 12
"""Of 255: a pixel that is no background."""

ACTS = 10
"""Of one walk."""

HIDE = """hidden => {
  const {nodeRefFromName: nodes} = window.__viserMutable;
  for (const [name, node] of Object.entries(nodes)) {
    if (!/^.scene.(?!ground)/.test(name) || !node) continue;
    node.traverse(each => {
      each.ragdollMask ??= each.layers.mask;
      each.layers.mask = hidden ? 0 : each.ragdollMask;
    });
  }
  window.__viserMutable.requestRender?.();
}"""
"""Hides all but the ground, or shows it again."""


@pytest.fixture(scope='module')
def scenes(tmp_path_factory):
    """Scenes by their names: with painted skins, plain ones, both, and without any."""
    folder = tmp_path_factory.mktemp('seen')
    paint = dataclasses.replace(fit_rigs.fitted('vrm').doll, model=str(painted(folder)))
    plain = dataclasses.replace(fit_rigs.fitted('mixamo').doll,
                                model=str(fit_rigs.write(fit_rigs.RIGS['mixamo'], folder)))
    found = {name: load_scene(name) for name in ('drop', 'flight', 'ponytail')}
    for name, doll in (('paint', paint), ('plain', plain)):
        found[name] = dataclasses.replace(above_ground(doll), name=name)
    for name, dolls in (('paint first', (paint, plain)), ('plain first', (plain, paint))):
        found[name] = Scene(name, tuple(
            Placement(doll, position=(0.0, 2.2 * k, 1.5), name=f'doll {k}')
            for k, doll in enumerate(dolls)), Ground())
    return found


@pytest.fixture(scope='module')
def seen(scenes):
    with served(SimulationSource(scenes['drop'])) as page, chromium() as browser:
        view = View(browser, f'http://127.0.0.1:{page.server.get_port()}', SIZE)
        view.wait(lambda: page.editor is not None)
        yield Seen(page, view)
        assert not view.errors
        view.close()


class Seen:
    """A page and the browser that shows it."""

    def __init__(self, page, view):
        self.page, self.view = page, view

    def hold(self):
        """Pause, and wait for the picture of the state that the source then has."""
        source = self.page.source
        source.pause(True)
        self.view.wait(lambda: source.status.paused and self.page.frame is source.frame)

    def resume(self):
        self.page.source.pause(False)
        self.view.wait(lambda: not self.page.source.status.paused)

    def show(self, scene):
        """Restart with a scene, as the editor does, and wait until it is the page's."""
        self.page.editor.set_scene(scene, scene.name)
        self.wait_for(scene)

    def wait_for(self, scene):
        """Until page and editor have a scene."""
        self.view.wait(lambda: self.page.stage.scene == scene == self.page.editor.scene)

    def picture(self):
        """Colours (h, w, 3) of the page."""
        with self.view.drawing():
            self.view.page.evaluate(PICTURES)
            return iio.imread(self.view.page.screenshot())[..., :3].astype(int)

    def drawn(self):
        """The picture, and where it is no background (h, w) bool."""
        picture = self.picture()
        self.view.page.evaluate(HIDE, True)
        empty = self.picture()
        self.view.page.evaluate(HIDE, False)
        return picture, abs(picture - empty).max(axis=2) > DIFFERS

    def silhouette(self):
        """Where the bodies and skins of the frame are by their poses, (h, w) bool."""
        frame = self.page.frame
        image = Image.new('1', (int(SIZE['width'] * SHARPNESS), int(SIZE['height'] * SHARPNESS)))
        drawing = ImageDraw.Draw(image)
        for points, triangles in surfaces(frame, self.page.display.skin.value):
            pixels = self.view.pixels(points) * SHARPNESS
            for triangle in pixels[triangles]:
                drawing.polygon([tuple(corner) for corner in triangle], fill=1)
        return np.array(image)

    def panel(self):
        """Where the page's picture is free of the panel, (h, w) bool."""
        free = np.zeros((int(SIZE['height'] * SHARPNESS), int(SIZE['width'] * SHARPNESS)), bool)
        free[:, :int(0.66 * free.shape[1])] = True
        return free

    def shows_what_it_should(self, folder=None):
        """Whether the silhouettes agree, and painted skins have colours."""
        picture, drawn = self.drawn()
        expected, free = self.silhouette(), self.panel()
        drawn, expected = drawn & free, expected & free
        share = min(np.mean(binary_dilation(other)[one]) if one.any() else 0.0
                    for one, other in ((drawn, expected), (expected, drawn)))
        colors = picture[expected]
        vivid = ((colors.max(axis=1) - colors.min(axis=1)) > 90).mean() if len(colors) else 0.0
        if folder is not None:
            iio.imwrite(folder / 'picture.png', picture.astype(np.uint8))
            iio.imwrite(folder / 'drawn.png', (255 * drawn).astype(np.uint8))
            iio.imwrite(folder / 'expected.png', (255 * expected).astype(np.uint8))
        is_painted = 'paint' in self.page.stage.scene.name and self.page.display.skin.value
        return expected.sum() > 300 and share > AGREES and (vivid > 0.1 or not is_painted)

    def check(self, folder):
        """Hold, and wait until the page shows what it should."""
        self.hold()
        try:
            self.view.wait(self.shows_what_it_should)
        except AssertionError:
            self.shows_what_it_should(folder)
            raise AssertionError(f'{self.page.stage.scene.name}: see {folder}') from None


def surfaces(frame, skins):
    """Points (v, 3) m and triangles (f, 3) of what a frame shows; ``skins``: where there are."""
    scene, state = frame.scene, frame.state
    skinned = set()
    for placement, part in zip(scene.dolls, scene.bone_slices, strict=True):
        skin = skin_of(placement.doll) if skins else None
        own = state.poses(slice(part.start, part.stop))
        if skin is not None:
            pose = dataclasses.make_dataclass('Pose', ['positions', 'orientations'])(
                own.position, own.orientation)
            yield posed(skin, pose), skin.triangles
            skinned.update(range(part.start, part.stop))
            continue
        for bone, position, orientation in zip(scene.bones[part], own.position, own.orientation,
                                               strict=True):
            for piece in bone.shape.primitives:
                vertices, faces = MESHES[piece.kind]
                points = rotation.rotate(np.array(piece.orientation),
                                         vertices * np.array(piece.size)) + piece.position
                yield position + rotation.rotate(orientation, points), faces
    for bone, _, ball in joint_balls(scene):
        if bone not in skinned:
            vertices, faces = MESHES[ball.kind]
            yield state.poses(bone).apply(ball.position + vertices * np.array(ball.size)), faces


def test_a_plain_skin_after_a_painted_one_is_seen(seen, scenes, tmp_path):
    """And each again after the other, and after a doll without a skin."""
    for name in ('paint', 'plain', 'drop', 'plain', 'paint', 'plain first', 'paint first', 'plain'):
        seen.show(scenes[name])
        seen.check(tmp_path)


def act(seen, scenes, random):
    """Something after which something else may be seen."""
    page = seen.page

    def show():
        seen.show(scenes[random.choice(list(scenes))])

    def load():
        name = str(random.choice(['drop', 'flight', 'ponytail']))
        page.source.load(name)
        seen.wait_for(scenes[name])

    def change():
        """A bone of another mass, as by the form, which can be undone."""
        scene = page.editor.scene
        doll = scene.dolls[0].doll
        bone = doll.bones[int(random.integers(len(doll.bones)))]
        doll = doll.replace_bone(bone.name, mass=bone.mass * float(random.uniform(0.9, 1.1)))
        seen.show(dataclasses.replace(scene, dolls=(
            dataclasses.replace(scene.dolls[0], doll=doll), *scene.dolls[1:])))

    def step(action):
        action()
        seen.wait_for(page.editor.scene)

    def fall():
        seen.resume()
        before = page.frame
        seen.view.wait(lambda: page.frame is not before and page.frame.time > 0.3)

    def toggle_skin():
        page.display.skin.value = not page.display.skin.value

    random.choice([
        show, show, show, load, change, fall, toggle_skin, page.source.reset,
        lambda: step(page.editor.undo), lambda: step(page.editor.redo),
        lambda: seen.view.go(seen.view.page.url),
        lambda: page.source.set_engine(str(random.choice(['rigid', 'bullet', 'mujoco'])))])()


@pytest.mark.parametrize('seed', [pytest.param(seed, marks=[pytest.mark.slow] if seed > 1 else [])
                                  for seed in range(100)])
def test_what_should_be_seen_is_seen(seen, scenes, seed, tmp_path):
    """After scenes, changes, undo, engines and new pages at random."""
    random = np.random.default_rng(seed)
    for _ in range(ACTS):
        act(seen, scenes, random)
    seen.check(tmp_path)

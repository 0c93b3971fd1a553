"""A page in headless Chromium: what its three.js scene holds, what a mouse and keys do to it."""
from __future__ import annotations

import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import contextmanager

import numpy as np
import pytest
from conftest import ROOT

PATIENCE = 180.0
"""s that the page may take for anything, on a busy machine without a GPU."""

SIZE = {'width': 800, 'height': 520}
"""Of the page, as the mouse counts."""

SHARPNESS = 0.5
"""Pixels that are drawn to each of those: without a GPU, half of them take half the time."""

FLAGS = ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
         '--disable-background-networking', '--disable-component-update', '--disable-sync',
         '--use-angle=swiftshader', '--enable-unsafe-swiftshader']

REQUIRED = os.environ.get('RAGDOLL_BROWSER') == 'required'
"""Whether a missing browser is a failure (.ci/run) or a reason to skip."""

CONNECTED = "!String(window.__viserMutable.sendMessage).includes('websocket is not connected')"
"""Until then, viser's client only logs what it has to send."""

READY = "window.__viserMutable?.scene && window.__viserMutable.nodeRefFromName['']"

PLAIN = """() => {
  window.ragdollKeepsQuality = true;
  document.head.insertAdjacentHTML('beforeend',
    '<style>.mantine-Notification-root {display: none}</style>');
  const {scene} = window.__viserMutable;
  Object.defineProperty(scene, 'environment', {get: () => null, set() {}});
  const unshade = () => {
    scene.traverse(node => { if (node.isLight) node.castShadow = false; });
    requestAnimationFrame(unshade);
  };
  unshade();
}"""
"""No notes, as of software rendering, which no user with a GPU gets, lie over the picture, whose
quality stays. Neither reflections nor shadows: without a GPU, those cost each page that is opened
8 s of a processor before its first pictures, and two thirds of every further one."""

BLIND = """for (const name of ['clear', 'drawArrays', 'drawArraysInstanced', 'drawElements',
                    'drawElementsInstanced', 'drawRangeElements']) {
  const draw = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...what) {
    if (window.ragdollDraws) draw.apply(this, what);
  };
}"""
"""The page computes each picture and draws nothing of it: without a GPU, to draw takes three
quarters of the time of a processor that a page takes."""

DRAW = """async () => {
  window.ragdollDraws = true;
  window.__viserMutable.requestRender();
  for (let frame = 0; frame < 2; frame++) await new Promise(requestAnimationFrame);
}"""

BODIES = """() => {
  const {scene, nodeRefFromName: nodes} = window.__viserMutable;
  scene.updateMatrixWorld();
  const toWorld = nodes[''].matrixWorld.clone().invert();
  const bodies = {};
  for (const [name, node] of Object.entries(nodes)) node?.traverse(mesh => {
    const batch = name.split('/scene/bodies/')[1];
    if (!batch || !mesh.isInstancedMesh2) return;
    bodies[batch] = Array.from({length: mesh.instancesCount}, (_, index) =>
      toWorld.clone().multiply(mesh.matrixWorld).multiply(mesh.getMatrixAt(index)).elements);
  });
  return bodies;
}"""
"""Matrices that the graphics card gets of each instance, by batch, column by column; z up."""

LOOK = """async ([eye, at]) => {
  const {camera, cameraControl, nodeRefFromName: nodes} = window.__viserMutable;
  const [from, to] = [eye, at].map(
    point => camera.position.clone().set(...point).applyMatrix4(nodes[''].matrixWorld));
  cameraControl.setLookAt(...from, ...to, false);
  for (let frame = 0; frame < 2; frame++) await new Promise(requestAnimationFrame);
}"""
"""Places a page's camera, m, z up, and waits until a picture is drawn from there."""

TO_PIXELS = """points => {
  const {camera, canvas, nodeRefFromName: nodes} = window.__viserMutable;
  const frame = canvas.getBoundingClientRect();
  camera.updateMatrixWorld();
  return points.map(point => {
    const p = camera.position.clone().set(...point).applyMatrix4(nodes[''].matrixWorld);
    p.project(camera);
    return [frame.left + (p.x + 1) / 2 * frame.width, frame.top + (1 - p.y) / 2 * frame.height];
  });
}"""


def find_chromium():
    """Path of a Chromium or Chrome: the environment's CHROMIUM, or one on the path."""
    names = (os.environ.get('CHROMIUM'), 'chromium', 'google-chrome')
    return next(filter(None, (shutil.which(name) for name in names if name)), None)


def skip_or_fail(reason):
    (pytest.fail if REQUIRED else pytest.skip)(reason)


@contextmanager
def chromium(draws=False, sharpness=None):
    """A browser with nothing in its profile, as Playwright's context; skips where there is none.

    ``draws``: whether somebody looks at the picture of the scene; else it stays empty.
    ``sharpness``: pixels that are drawn to each of the mouse's, in place of SHARPNESS.
    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        skip_or_fail("no Playwright: pip install playwright, or '.[test]'")
    path = find_chromium()
    if path is None:
        skip_or_fail('no Chromium: apt-get install chromium (Debian), or CHROMIUM=/path/to/chrome')
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, \
            sync_playwright() as playwright:
        context = playwright.chromium.launch_persistent_context(
            profile, executable_path=path, headless=True, args=FLAGS, viewport=SIZE,
            device_scale_factor=sharpness or SHARPNESS)
        context.set_default_timeout(PATIENCE * 1000)
        if not draws:
            context.add_init_script(BLIND)
        yield context
        context.close()


class View:
    """One page of a viewer, at ``url``."""

    def __init__(self, context, url, size=SIZE):
        self.page = context.new_page()
        self.page.set_viewport_size(size)
        self.errors = []
        self.page.on('pageerror', lambda error: self.errors.append(str(error)))
        self.go(url)

    def go(self, url):
        """Go to an address, a viewer's, and wait until the page draws and is connected.

        A page whose first connection takes more than 5 s tries again each second, in vain where a
        busy machine takes longer to answer. It is loaded again then, as a user would.
        """
        from playwright.sync_api import TimeoutError as TooLate
        end = time.monotonic() + PATIENCE
        while True:
            self.page.goto(url)
            self.page.wait_for_function(READY)
            try:
                self.page.wait_for_function(CONNECTED, timeout=30_000)
                break
            except TooLate:
                assert time.monotonic() < end, f'{url} does not connect'
        self.page.evaluate(PLAIN)

    def bodies(self, scene):
        """Place of each bone as it is drawn, (n, 3) m, z up; NaN while not all are there.

        Read from three.js' instances; the page keeps parts of one kind in the scene's order, in
        batches that it counts: box_0, box_1.
        """
        batches, drawn = self.page.evaluate(BODIES), {}
        for name in sorted(batches, key=lambda name: int(name.split('_')[1])):
            drawn.setdefault(name.split('_')[0], []).extend(batches[name])
        kinds = [part.kind for bone in scene.bones for part in bone.shape.primitives]
        assert len(kinds) == len(scene.bones), 'bones of one part each'
        if {kind: len(matrices) for kind, matrices in drawn.items()} != Counter(kinds):
            return np.full((len(kinds), 3), np.nan)
        instances = {kind: iter(matrices) for kind, matrices in drawn.items()}
        return np.array([next(instances[kind])[12:15] for kind in kinds])

    def all_bodies(self, scene):
        """The same once all are there, which they are not for a moment after a change of one."""
        found = []
        self.wait(lambda: found.append(self.bodies(scene)) or np.isfinite(found[-1]).all())
        return found[-1]

    def has(self, name):
        """Whether a node of this name is drawn."""
        return self.page.evaluate('name => !!window.__viserMutable.nodeRefFromName[name]', name)

    def pixels(self, points):
        """Where points (n, 3) m of the world are on the page: (n, 2), as the mouse counts."""
        return np.array(self.page.evaluate(TO_PIXELS, np.asarray(points).tolist()))

    def look(self, eye, at):
        """Place the camera at a point (3,) m, looking at another one, z up."""
        self.page.evaluate(LOOK, [list(map(float, eye)), list(map(float, at))])

    @contextmanager
    def drawing(self):
        """For somebody who looks at the picture: it is drawn now, and again as it changes."""
        self.page.evaluate(DRAW)
        yield
        self.page.evaluate('window.ragdollDraws = false')

    def wait(self, condition, patience=PATIENCE):
        """Wait until a condition holds, s at the most; what it said. The page goes on meanwhile."""
        end = time.monotonic() + patience
        while not (said := condition()):
            assert time.monotonic() < end, f'not in time; notes: {self.notes()}; {self.errors}'
            self.page.wait_for_timeout(20)
        return said

    def notes(self):
        """Texts of the notifications on the page, as of what was refused, though not drawn."""
        return self.page.locator('.mantine-Notification-root').all_text_contents()

    def hold_at(self, scene, start):
        """Pause at the start, where the bones are at (n, 3) m, as the page draws it."""
        def held():
            if self.button('Pause').count():  # what was done before may have it go on only now
                self.press('Pause')
                self.button('Play').wait_for()
                self.press('Reset')
            return abs(self.bodies(scene) - start).max() < 1e-6

        self.press('Reset')
        self.wait(held)

    def button(self, name):
        return self.page.get_by_role('button', name=name, exact=True)

    def press(self, button):
        self.button(button).click()

    def tab(self, name):
        self.page.get_by_role('tab', name=name).click()

    def field(self, label):
        """The input beside a label of the panel."""
        return self.row(label).locator('input').last

    def row(self, label):
        """What stands in a line of the panel, beside a label."""
        return self.page.locator('.mantine-Flex-root',
                                 has=self.page.get_by_text(label, exact=True))

    def top(self, part):
        """How far below the page's upper edge a part of it begins, pixels."""
        return part.bounding_box()['y']

    def see(self, text):
        """Wait until a text stands somewhere on the page."""
        self.page.get_by_text(text).first.wait_for()

    def key(self, name):
        self.page.keyboard.press(name)

    def close(self):
        self.page.close()


def start_of(scene):
    """Place of each bone at the start of a scene (n, 3) m."""
    return np.array([placement.bone_pose(bone)[0]
                     for placement in scene.dolls for bone in placement.doll.bones])


@contextmanager
def opened(browser, url, scene, size=SIZE, first=False):
    """A page at an address, with all bones in it; no script of it has failed at the end.

    ``first``: of a scene that waits for its first page: until it falls, or lies, on a busy machine.
    """
    view = View(browser, url, size)
    try:
        view.wait(lambda: np.isfinite(view.bodies(scene)).all())
        # The page hears keys once its panel is drawn, which a busy browser does later.
        view.page.locator('.ragdoll-bar [data-do=toggle][aria-label]').wait_for()
        if first:
            start = start_of(scene)
            view.wait(lambda: abs(view.bodies(scene) - start).max() > 0.01)
        yield view
    finally:
        view.close()
    assert not view.errors, view.errors


@contextmanager
def editing(scene, folder):
    """The page of a shipped scene in a browser of its own, with a folder for its files."""
    with (chromium() as context,
          serving('--port', '0', '--scene', scene.name, '--folder', str(folder)) as url,
          opened(context, url, scene, {'width': 1280, 'height': 800}, first=True) as view):
        view.folder = folder
        yield view


@contextmanager
def serving(*arguments, module='ragdoll_ros.viewer.command'):
    """Run what serves a page, until SIGTERM, on which it must end well; give the page's address."""
    process = subprocess.Popen([sys.executable, '-m', module, *arguments], cwd=ROOT,
                               stdout=subprocess.PIPE, start_new_session=True)
    try:
        yield _address(process)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    assert process.returncode == 0


def _address(process):
    said, end = b'', time.monotonic() + PATIENCE
    while not (found := re.search(rb'(http://\S+)\n', said)):
        assert time.monotonic() < end and process.poll() is None, said
        if select.select([process.stdout], [], [], 1.0)[0]:
            said += os.read(process.stdout.fileno(), 1000)
    return found[1].decode()

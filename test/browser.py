"""A page in headless Chromium: what its three.js scene holds, what a mouse and keys do to it."""
from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import contextmanager

import numpy as np
import pytest

PATIENCE = 20.0
"""s that the page may take for anything: it draws some 6 pictures a second without a GPU."""

SIZE = {'width': 960, 'height': 600}

FLAGS = ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
         '--disable-background-networking', '--disable-component-update', '--disable-sync',
         '--use-angle=swiftshader', '--enable-unsafe-swiftshader']

REQUIRED = os.environ.get('RAGDOLL_BROWSER') == 'required'
"""Whether a missing browser is a failure (.ci/run) or a reason to skip."""

POSES = """names => {
  const {scene, nodeRefFromName: nodes} = window.__viserMutable;
  if (names.some(name => !nodes[name])) return null;
  scene.updateMatrixWorld();
  const toWorld = nodes[''].matrixWorld.clone().invert();
  return names.map(name => toWorld.clone().multiply(nodes[name].matrixWorld).elements);
}"""
"""Matrices of nodes, column by column, in the frame of the page's root: z up."""

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
def chromium():
    """A browser with nothing in its profile, as Playwright's context; skips where there is none."""
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
            profile, executable_path=path, headless=True, args=FLAGS, viewport=SIZE)
        context.set_default_timeout(PATIENCE * 1000)
        yield context
        context.close()


class View:
    """One page of a viewer, at ``url``."""

    def __init__(self, context, url):
        self.page = context.new_page()
        self.errors = []
        self.page.on('pageerror', lambda error: self.errors.append(str(error)))
        self.page.goto(url)

    def matrices(self, nodes):
        """Poses of scene nodes as the page draws them next: (n, 4, 4), world frame, z up."""
        self.page.wait_for_function(f'names => ({POSES})(names) !== null', arg=list(nodes))
        columns = self.page.evaluate(POSES, list(nodes))
        return np.array(columns).reshape(-1, 4, 4).transpose(0, 2, 1)

    def positions(self, nodes):
        """Places of scene nodes: (n, 3) m, world frame, z up."""
        return self.matrices(nodes)[:, :3, 3]

    def pixels(self, points):
        """Where points (n, 3) m of the world are on the page: (n, 2), as the mouse counts."""
        return np.array(self.page.evaluate(TO_PIXELS, np.asarray(points).tolist()))

    def wait(self, condition, *arguments):
        """Wait until a JavaScript function of the list of arguments gives true."""
        self.page.wait_for_function(condition, arg=list(arguments))

    def close(self):
        self.page.close()

"""The page's button that ends animations, in headless Chromium."""
from __future__ import annotations

import pytest

pytest.importorskip('viser')
from browser import chromium, opened, serving, start_of
from conftest import ROOT

from ragdoll_ros.files.doll import save_doll
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.physics.simulation import Simulation

FILE = ROOT / 'config/walker.glb'

TICKS = 10
"""In which who falls is 5 cm lower."""


@pytest.fixture(scope='module')
def path(tmp_path_factory):
    """A scene of the shipped figure, of boxes: of those the page draws one for each bone."""
    folder = tmp_path_factory.mktemp('walker')
    fit = fit_character(read_character(FILE), FitOptions(shape='box'))
    save_doll(fit.placed(str(FILE)).doll, folder / 'walker.yaml')
    (folder / 'walks.yaml').write_text(
        'dolls: [{doll: walker.yaml, velocity: [1, 0, 0], animation: {name: walk, loop: true}}]\n')
    return str(folder / 'walks.yaml')


@pytest.fixture(scope='module')
def view(path):
    with (chromium() as context, serving('--port', '0', '--scene', path) as url,
          opened(context, url, load_scene(path), first=True) as view):
        yield view


def test_the_button_fells_who_walks_and_a_reset_lets_it_walk(view, path):
    scene = load_scene(path)
    start = start_of(scene)
    with Simulation(scene) as simulation:
        walks = simulation.run(1)[0, :, :3]
        simulation.go_limp()
        fallen = simulation.run(TICKS)[-1, :, :3]
    view.hold_at(scene, start)

    def shows(places):
        # What is drawn are numbers of 32 bits.
        view.wait(lambda: abs(view.bodies(scene) - places).max() < 1e-5)

    view.press('Step')
    shows(walks)
    view.press('Go limp')
    for _ in range(TICKS):
        view.press('Step')
    shows(fallen)
    view.key('r')
    view.wait(lambda: abs(view.bodies(scene) - start).max() < 1e-6)


def test_a_scene_without_animations_has_no_such_button(view):
    view.row('Scene').locator('input').first.click()
    view.page.get_by_role('option', name='flight', exact=True).click()
    view.wait(lambda: not view.button('Go limp').count())

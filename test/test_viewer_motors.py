"""The page's slider for the strength of motors, in headless Chromium."""
from __future__ import annotations

import pytest

pytest.importorskip('viser')
from browser import chromium, opened, start_of
from page_client import served

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.simulation import Simulation
from ragdoll_ros.viewer.sources.simulation import SimulationSource

TICKS = 40
"""After which the doll has come down on its feet, and limp forearms hang 30 cm lower."""


def standing(folder):
    """Path of a scene of a doll above the ground, whose arms motors hold out to the sides."""
    path = folder / 'stands.yaml'
    path.write_text('ground: {}\ndolls: [{doll: doll, position: [0, 0, 0.02], motors: '
                    '{frequency: 10, strength: 0.9}}]\n')
    return str(path)


def places_after(scene, strength):
    """Places (n, 3) m of the bones TICKS after the strength was set, one tick after the start."""
    with Simulation(scene) as simulation:
        simulation.run(1)
        simulation.set_strength(strength)
        return simulation.run(TICKS)[-1, :, :3]


def slider(view):
    """By the name that a screen reader says."""
    return view.page.get_by_role('slider', name='Motor strength')


def set_by_key(view, key, value):
    """Press a key on the slider; wait until it has a value."""
    slider(view).focus()
    view.key(key)
    view.wait(lambda: float(slider(view).get_attribute('aria-valuenow')) == value)


def fells_the_doll(page, view, scene, is_set):
    """Set the strength to 0 by the keyboard, and see the doll go limp, tick by tick; then reset.

    ``is_set``: whether the simulation knows the strength.
    """
    limp, held = (places_after(scene, strength) for strength in (0.0, 0.9))
    assert abs(limp - held).max() > 0.3
    start = start_of(scene)
    view.hold_at(scene, start)
    assert float(slider(view).get_attribute('aria-valuenow')) == 0.9

    def step():
        before = page.frame.time
        view.press('Step')
        view.wait(lambda: page.frame.time > before)

    step()
    set_by_key(view, 'Home', 0)
    view.wait(is_set)
    for _ in range(TICKS):
        step()
    # What is drawn are numbers of 32 bits.
    view.wait(lambda: abs(view.bodies(scene) - limp).max() < 1e-5)
    view.press('Reset')
    view.wait(lambda: abs(view.bodies(scene) - start).max() < 1e-6)
    view.wait(lambda: float(slider(view).get_attribute('aria-valuenow')) == 0.9)


@pytest.fixture(scope='module')
def scene(tmp_path_factory):
    return load_scene(standing(tmp_path_factory.mktemp('stands')))


@pytest.fixture(scope='module')
def shown(scene):
    """A page on a simulation of its own, and the view of it."""
    with served(SimulationSource(scene)) as page, chromium() as context, opened(
            context, f'http://127.0.0.1:{page.server.get_port()}', scene) as view:
        yield page, view


def test_at_zero_the_doll_is_limp_and_a_reset_makes_it_stand(shown, scene):
    # Commands come one after the other, so that a step comes after the strength.
    fells_the_doll(*shown, scene, lambda: True)


def test_it_can_be_dragged(shown, scene):
    """By the mouse to the middle: what the simulation is told."""
    page, view = shown
    told = []
    set_strength = page.source.set_strength
    page.source.set_strength = lambda strength: (told.append(strength), set_strength(strength))
    track = view.page.locator('.mantine-Slider-root', has=slider(view)).bounding_box()
    mouse = view.page.mouse
    mouse.move(track['x'] + 0.8 * track['width'], track['y'] + track['height'] / 2)
    mouse.down()
    mouse.move(track['x'] + 0.5 * track['width'], track['y'] + track['height'] / 2, steps=5)
    mouse.up()
    view.wait(lambda: told and abs(told[-1] - 0.5) < 0.05)
    assert page.controls.motor_strength.value == told[-1]
    del page.source.set_strength


def test_a_scene_without_motors_has_no_slider(shown):
    page, view = shown
    page.source.load('flight')
    view.wait(lambda: not slider(view).count())
    page.source.load('walker_stumbles')
    view.wait(lambda: slider(view).count())

"""Later points of a body that already touches another: their impacts are found as the first is."""
from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from test_static_bodies import ACCURACIES, FLOOR, G, loose, scene, states

from ragdoll_ros import Box, Ground, Hull, Mesh, StaticBody, load_scene
from ragdoll_ros.model import rotation

pytest.importorskip('numba')

SIZE = np.array((0.3, 0.2, 0.1))


def _floors():
    corners = np.array([(-20, -7, 0), (20, -6, 0), (20, 20, 0), (-20, 20, 0)], float)
    box, faces = Box((40.0, 40.0, 1.0)).mesh()
    return {'box': FLOOR,
            'triangles': StaticBody('floor', Mesh(corners, [(0, 1, 2), (0, 2, 3)])),
            'hull': StaticBody('floor', Hull(box - (0.0, 0.0, 0.5), faces))}


FLOORS = _floors()
STARTS = {'edge': ((0.0, 0.3, 0.0, 1.0), (0.0, 0.0, 0.0)),
          'corner': ((0.2, 0.3, 0.1, 1.0), (0.0, 0.0, 0.0)),
          'nearly_flat': ((0.01, 0.02, 0.0, 1.0), (0.0, 0.0, 0.0)),
          'turning': ((0.1, 0.3, 0.0, 1.0), (3.0, -2.0, 1.0))}


def depths(rows, size=SIZE):
    """How deep (t,) m the deepest corner of a box is below z = 0."""
    upright = rotation.matrix(rows[:, 0, 3:7])[:, 2]
    return np.abs(upright) @ (size / 2) - rows[:, 0, 2]


def energies(rows, size=SIZE):
    """Energy (t,) J of a box of 1 kg."""
    inertia = (size @ size - size ** 2) / 12
    local = np.einsum('tji,tj->ti', rotation.matrix(rows[:, 0, 3:7]), rows[:, 0, 10:13])
    return ((rows[:, 0, 7:10] ** 2).sum(axis=1) / 2 + (local ** 2 @ inertia) / 2
            + G * rows[:, 0, 2])


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('floor', FLOORS)
@pytest.mark.parametrize('restitution', [0.0, 0.5])
@pytest.mark.parametrize('start', STARTS)
def test_a_box_that_lands_point_by_point_is_not_deep(start, restitution, floor, accuracy):
    """At most 0.1 mm, as what closes slowly in a step of 4 ms is 80 um deep; 0.3 to 0.5 mm with one
    gap for all points. No energy is gained, to the 1e-5 J that the account allows.
    """
    turn, spin = STARTS[start]
    box = loose(Box(tuple(SIZE)), position=(0, 0, 0.4), velocity=(0.3, 0.1, -1.0),
                orientation=turn, spin=spin)
    rows, told = states(scene(box, [FLOORS[floor]], restitution=restitution), 1.0, accuracy)
    assert depths(rows).max() < 1e-4
    assert np.diff(energies(rows)).max() < 1e-5
    assert told['energy_excess_J'] < 1e-5


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('restitution', [0.0, 0.5])
@pytest.mark.parametrize('start', STARTS)
def test_a_box_lands_on_a_box_as_on_the_ground(start, restitution, accuracy):
    turn, spin = STARTS[start]
    box = loose(Box(tuple(SIZE)), position=(0, 0, 0.4), velocity=(0.3, 0.1, -1.0),
                orientation=turn, spin=spin)
    on_box, _ = states(scene(box, [FLOOR], restitution=restitution), 0.4, accuracy)
    on_ground, _ = states(scene(box, ground=Ground(), restitution=restitution), 0.4, accuracy)
    np.testing.assert_allclose(on_box[:, 0, :3], on_ground[:, 0, :3], atol=1e-6)


def rocking(tilt, seconds, width, height):
    """Tilt (t,) rad each 10 ms of a block that rocks from edge to edge without sliding or bouncing:
    the angular velocity after each impact is 1 - 3/2 sin^2 of that before, the angle that of the
    diagonal (Housner, The behavior of inverted pendulum structures during earthquakes, 1963).
    """
    from scipy.integrate import solve_ivp
    slender, radius = math.atan2(width, height), math.hypot(width, height) / 2
    pull = G / (4 / 3 * radius)

    def rate(_, y):
        return y[1], -math.copysign(pull, side) * math.sin(slender - abs(y[0]))

    def upright(_, y):
        return side * y[0]
    upright.terminal, upright.direction = True, -1
    times, out = np.arange(1, round(100 * seconds) + 1) / 100, []
    time, state, side = 0.0, np.array((tilt, 0.0)), 1.0
    while time < seconds:
        found = solve_ivp(rate, (time, seconds + 1e-9), state, events=upright, rtol=1e-11,
                          atol=1e-12, dense_output=True)
        end = found.t[-1]
        out += [found.sol(t)[0] for t in times if time < t <= end]
        time, side = end, -side
        state = np.array((0.0, found.y[1, -1] * (1 - 1.5 * math.sin(slender) ** 2)))
    return np.array(out)


@pytest.mark.parametrize('accuracy, tolerance', [('draft', 2e-3), ('normal', 1e-3),
                                                 ('exact', 5e-5)])
@pytest.mark.parametrize('floor', FLOORS)
def test_a_block_rocks_as_housner_says(floor, accuracy, tolerance):
    """Edge by edge, four impacts within a second; the second order of a step in contact is left."""
    width, height, tilt = 0.2, 0.6, 0.1
    radius, slender = math.hypot(width, height) / 2, math.atan2(width, height)
    block = loose(Box((width, 0.3, height)), position=(0, 0, radius * math.cos(slender - tilt)),
                  orientation=(0, math.sin(tilt / 2), 0, math.cos(tilt / 2)))
    rows, _ = states(scene(block, [FLOORS[floor]], friction=math.inf, restitution=0.0), 1.0,
                     accuracy)
    tilts = 2 * np.arctan2(rows[:, 0, 4], rows[:, 0, 6])
    wanted = rocking(tilt, 1.0, width, height)
    assert np.count_nonzero(np.diff(np.sign(wanted))) >= 3
    np.testing.assert_allclose(tilts, wanted, atol=tolerance)
    assert depths(rows, np.array((width, 0.3, height))).max() < 1e-4


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('floor', ['box', 'triangles'])
@pytest.mark.parametrize('restitution', [0.0, 0.5])
def test_a_doll_falls_on_a_body_as_on_the_ground(restitution, floor, accuracy):
    """It touches at 0.28 s; until 0.4 s, with seven to nine impacts, all limbs are within 1e-6 m.
    Later differences of rounding grow, as against a plane.
    """
    drop = load_scene('drop')
    law = dataclasses.replace(drop.material, restitution=restitution)
    on_ground = dataclasses.replace(drop, material=law)
    on_body = dataclasses.replace(on_ground, ground=None, bodies=(FLOORS[floor],))
    rows, told = states(on_body, 0.4, accuracy)
    wanted, known = states(on_ground, 0.4, accuracy)
    assert told['impacts'] == known['impacts'] >= 7
    np.testing.assert_allclose(rows[..., :3], wanted[..., :3], atol=1e-6)

"""Bodies with `follow`: contacts with what moves follow closed forms, and its work is counted."""
from __future__ import annotations

import math

import numpy as np
import pytest

from ragdoll_ros import (
    Bone,
    Box,
    Follow,
    Placement,
    Ragdoll,
    Scene,
    Simulation,
    Sphere,
)
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import Material

pytest.importorskip('numba')

ACCURACIES = ('draft', 'normal', 'exact')
EXACT = Follow()
G = 9.8


def body(name, shape, mass=1.0, **start):
    """A placement of one bone."""
    return Placement(Ragdoll(name, (Bone(name, shape, mass, (0, 0, 0)),)), **start)


def scene(*placements, ground=None, gravity=0.0, **material):
    return Scene('world', placements, ground, Material(**{'friction': 0.0} | material),
                 gravity=(0, 0, -gravity))


def wall(name, x):
    return body(name, Box((0.2, 2, 2)), position=(x, 0, 0), follow=EXACT)


def run(simulation, seconds, **velocities):
    """States (t, n, 13) while bodies are driven at these velocities along x."""
    rows = []
    for _ in range(round(seconds / simulation.step)):
        for name, speed in velocities.items():
            simulation.drive_body(name, twist=(speed, 0, 0, 0, 0, 0))
        rows.append(simulation.advance().rows.copy())
    return np.array(rows)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_ball_between_walls_that_approach_gains_twice_their_speed_at_each(accuracy):
    """Faces at -1 and 1 m approach at u = 0.5 m/s; e = 1."""
    speed, u, radius = 3.0, 0.5, 0.1
    made = scene(body('ball', Sphere(radius), velocity=(speed, 0, 0)), wall('left', -1.1),
                 wall('right', 1.1), restitution=1.0)
    with Simulation(made, accuracy=accuracy) as simulation:
        rows = run(simulation, 1.2, left=u, right=-u)
        excess, (work, _) = simulation.energy_excess, simulation.work
    time, place, side = 0.0, 0.0, 1.0
    while True:
        # The gap to the wall at +-(1 - u t) closes at speed + u.
        there = time + (1 - u * time - radius - side * place) / (speed + u)
        if there > 1.2:
            break
        place += side * speed * (there - time)
        time, speed, side = there, speed + 2 * u, -side
    assert speed > 5
    # Impacts miss their velocity by IMPACT_COMPLIANCE, 1e-10 of it.
    assert rows[-1, 0, 7] == pytest.approx(side * speed, abs=1e-8)
    assert rows[-1, 0, 0] == pytest.approx(place + side * speed * (1.2 - time), abs=1e-8)
    assert work == pytest.approx((speed ** 2 - 9) / 2, rel=1e-8)
    assert abs(excess) < 1e-8 * work


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('mass', [0.01, 100.0])
def test_a_bat_gives_a_ball_its_speed_and_e_times_it(accuracy, mass):
    """It is (1 + e) u, whatever the ball's mass; the bat goes on. It does m u v' of work, of which
    impact takes m (1 - e^2) u^2 / 2.
    """
    u, e = 2.0, 0.6
    made = scene(body('ball', Sphere(0.1), mass, position=(0.33, 0, 0)), wall('bat', -0.1),
                 restitution=e)
    with Simulation(made, accuracy=accuracy) as simulation:
        rows = run(simulation, 0.3, bat=u)
        excess, (work, _) = simulation.energy_excess, simulation.work
        impulse = simulation.contact_impulses[0, 0]
    assert rows[-1, 0, 7] == pytest.approx((1 + e) * u, abs=1e-8)
    assert rows[:, 1, 7] == pytest.approx(u, abs=1e-12)
    assert rows[-1, 1, 0] == pytest.approx(-0.1 + u * 0.3, abs=1e-12)
    # It meets the ball after 0.23 m / u.
    assert rows[-1, 0, 0] == pytest.approx(0.33 + (1 + e) * u * (0.3 - 0.115), abs=1e-8)
    assert impulse == pytest.approx(mass * (1 + e) * u, rel=1e-8)
    assert work == pytest.approx(impulse * u, rel=1e-8)
    assert excess == pytest.approx(-mass * (1 - e * e) * u * u / 2, rel=1e-6)


@pytest.mark.parametrize('accuracy', ACCURACIES)
@pytest.mark.parametrize('w', [3.0, 30.0])
def test_a_bat_that_turns_hits_by_the_speed_of_its_point(accuracy, w):
    """Where it meets the ball, at the distance d from its axis, that is w d."""
    e, mass, center, radius = 0.5, 0.2, 0.8, 0.05
    bat = body('bat', Box((2.0, 0.01, 0.3)), follow=EXACT)
    made = scene(body('ball', Sphere(radius), mass, position=(0, center, 0)), bat, restitution=e)
    with Simulation(made, accuracy=accuracy) as simulation:
        while not simulation.kinetic_energy:
            simulation.drive_body('bat', twist=(0, 0, 0, 0, 0, w))
            row = simulation.advance().rows[0]
        excess = simulation.energy_excess
    # The ball's centre is its radius and half the bat's thickness off the bat's middle.
    sine = (radius + 0.005) / center
    speed, turned = w * center * math.sqrt(1 - sine ** 2), math.pi / 2 - math.asin(sine)
    assert row[7:9] == pytest.approx((-(1 + e) * speed * math.sin(turned),
                                      (1 + e) * speed * math.cos(turned)), rel=1e-8)
    assert excess == pytest.approx(-mass * (1 - e * e) * speed ** 2 / 2, rel=1e-8)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_board_of_a_centimetre_at_100_m_s_passes_nothing(accuracy):
    made = scene(body('ball', Sphere(0.03), position=(0.43, 0, 0)),
                 body('board', Box((0.01, 3, 3)), follow=EXACT), restitution=0.5)
    with Simulation(made, accuracy=accuracy) as simulation:
        rows = run(simulation, 0.05, board=100.0)
    assert rows[-1, 0, 7] == pytest.approx(150.0, rel=1e-8)
    assert (rows[:, 0, 0] > rows[:, 1, 0]).all()


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_box_on_a_conveyor_reaches_its_speed_as_coulomb_says(accuracy):
    """After u / mu g, with u^2 / 2 mu g of slip; the belt does m u^2 of work, half of it heat."""
    u, mu, mass = 1.5, 0.4, 3.0
    belt = body('belt', Box((8, 2, 0.2)), position=(0, 0, -0.1), follow=EXACT)
    made = scene(body('box', Box((0.2, 0.3, 0.2)), mass, position=(0, 0, 0.1)), belt, gravity=G,
                 friction=mu, restitution=0.0)
    with Simulation(made, accuracy=accuracy) as simulation:
        rows = run(simulation, 0.8, belt=u)
        excess, (work, _) = simulation.energy_excess, simulation.work
    assert rows[19, 0, 7] == pytest.approx(mu * G * 0.2, rel=1e-4)
    assert rows[-1, 0, 7] == pytest.approx(u, abs=1e-6)
    # It stops to slip within a step of order 2.
    assert rows[-1, 0, 0] == pytest.approx(u * 0.8 - u * u / (2 * mu * G), rel=1e-5)
    assert np.abs(rows[:, 0, [8, 9]]).max() < 1e-4
    assert rows[-1, 0, 2] == pytest.approx(0.1, abs=1e-6)
    assert work == pytest.approx(mass * u * u, rel=1e-8)
    assert excess == pytest.approx(-mass * u * u / 2, rel=1e-6)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_lift_does_the_work_of_a_weight(accuracy):
    """From rest to u at once, without a bounce, and up by 0.5 m: m u^2 and m g h, of which the
    start takes half of the former.
    """
    u, mass, height = 0.5, 20.0, 0.5
    lift = body('lift', Box((1, 1, 0.2)), position=(0, 0, -0.1), follow=EXACT)
    made = scene(body('box', Box((0.4, 0.4, 0.4)), mass, position=(0, 0, 0.2)), lift, gravity=G,
                 friction=0.5, restitution=0.5)
    with Simulation(made, accuracy=accuracy) as simulation:
        for _ in range(round(height / u / 0.01)):
            simulation.drive_body('lift', twist=(0, 0, u, 0, 0, 0))
            simulation.advance()
        row, excess, (work, _) = simulation.state.rows[0], simulation.energy_excess, simulation.work
    assert row[2] == pytest.approx(0.2 + height, abs=1e-6)
    assert work == pytest.approx(mass * (G * height + u * u), rel=1e-9)
    assert excess == pytest.approx(-mass * u * u / 2, rel=1e-6)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_a_turntable_carries_a_box_that_sticks_around(accuracy):
    """A box that turns with it moves on a circle, w^2 r being below mu g, and takes no work."""
    w, r = 1.2, 0.5
    table = body('table', Box((2, 2, 0.2)), position=(0, 0, -0.1), follow=EXACT)
    made = scene(body('box', Box((0.2, 0.2, 0.1)), position=(r, 0, 0.05), velocity=(0, w * r, 0),
                      spin=(0, 0, w)), table, gravity=G, friction=0.5, restitution=0.0)
    with Simulation(made, accuracy=accuracy) as simulation:
        for _ in range(100):
            simulation.drive_body('table', twist=(0, 0, 0, 0, 0, w))
            simulation.advance()
        row, work, excess = simulation.state.rows[0], simulation.work[0], simulation.energy_excess
        turned = rotation.rotation_vector(simulation.state.orientations[1])[2]
    assert turned == pytest.approx(w, abs=1e-9)
    # Contact steps are of order 2.
    assert math.hypot(*row[:2]) == pytest.approx(r, abs=1e-5)
    assert math.atan2(row[1], row[0]) == pytest.approx(w, abs=1e-5)
    assert row[7:9] == pytest.approx((-w * r * math.sin(w), w * r * math.cos(w)), abs=1e-5)
    assert work == pytest.approx(0, abs=1e-5) and excess == pytest.approx(0, abs=1e-5)


@pytest.mark.parametrize('accuracy', ACCURACIES)
def test_what_leans_on_a_body_follows_each_change_of_its_velocity_at_once(accuracy):
    """A box leans on a pin that speeds up in twenty jerks: it neither lags nor bounces."""
    cart = body('cart', Box((1, 1, 0.2)), position=(0, 0, -0.1), follow=EXACT)
    pin = body('pin', Box((0.05, 0.4, 0.2)), position=(-0.225, 0, 0.1), follow=EXACT)
    made = scene(body('box', Box((0.4, 0.4, 0.05)), position=(0, 0, 0.025)), pin, cart, gravity=G,
                 restitution=0.5)
    with Simulation(made, accuracy=accuracy) as simulation:
        for tick in range(20):
            for name in ('pin', 'cart'):
                simulation.drive_body(name, twist=(0.05 * (tick + 1), 0, 0, 0, 0, 0))
            state = simulation.advance()
            assert state.linear_velocities[0] == pytest.approx((0.05 * (tick + 1), 0, 0), abs=1e-8)
        assert state.positions[0, 0] == pytest.approx(state.positions[2, 0], abs=1e-8)
        # Each jerk of 0.05 m/s takes half of m du^2, without a bounce.
        assert simulation.energy_excess == pytest.approx(-20 * 0.05 ** 2 / 2, rel=1e-6)

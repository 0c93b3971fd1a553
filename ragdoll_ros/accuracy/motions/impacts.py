"""Reference motions with impacts, and on edges and faces: rocking, tipping, spinning."""
import functools
import math
from collections.abc import Callable

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Ground, Material, Placement, Scene
from ...model.shapes import Box, Cylinder, Shape, Sphere
from ..cases.comparison import FRICTION
from ..cases.trial import Trial
from ..references import closed_forms, impacts
from ..trajectory import Trajectory
from .motion import ReferenceMotion, orientations_about

GRAVITY = 9.8
PITCH = (0.0, 1.0, 0.0)
ROD = (0.02, 0.2, 1.0)
"""Size of the rods, m: thin across their plane of motion."""


def impact_motions() -> list[ReferenceMotion]:
    """All reference motions with impacts, or on an edge or a face."""
    return [rocking_block(), falling_rod(), *(dropped_rod(*rod) for rod in (
        ('rod_frictionless', 'without friction', 0.5, 0.0), ('rod_sticks', 'that sticks', 0.5, 2.0),
        ('rod_slides', 'that slides', 0.5, 0.1))), spinning_disc(), thin_disc(),
        balls('two_balls', 'Two balls, e = 0.8', (1.0, 2.0), 0.8),
        balls('three_balls', 'Three balls one after the other, e = 1', (1.0, 1.0, 1.0), 1.0)]


def _body(shape: Shape, material: Material, position: tuple[float, float, float],
          orientation: np.ndarray = rotation.IDENTITY, **placed: object) -> Scene:
    doll = Ragdoll('body', (Bone('body', shape, 1.0, (0.0, 0.0, 0.0)),))
    placement = Placement(doll, position=position, orientation=tuple(orientation), **placed)
    return Scene('body', (placement,), Ground(), material)


def _on_edge(name: str, title: str, reference: str, size: tuple[float, float, float], start: float,
             duration: float, rocks: bool) -> ReferenceMotion:
    """A box released on a lower edge, tilted by ``start`` rad; friction enough to stick."""
    half_width, half_height = size[0] / 2, size[2] / 2

    def truth(times: np.ndarray) -> Trajectory:
        angles = impacts.edge_angle(half_width, half_height, start, GRAVITY, times, rocks)
        centres = impacts.edge_centre(half_width, half_height, angles)
        return Trajectory.of_poses(times, centres[:, None],
                                   orientations_about(PITCH, angles[:, None]))
    centre = impacts.edge_centre(half_width, half_height, np.array([start]))[0]
    scene = _body(Box(size), Material(FRICTION, restitution=0.0), tuple(centre),
                  rotation.from_axis_angle(PITCH, start))
    extra = functools.partial(_peaks, truth) if rocks else lambda _: {}
    return ReferenceMotion(name, title, reference, Trial(scene, duration), truth, 'angle_worst_rad',
                           in_flight=False, extra=extra)


def _peaks(truth: Callable[[np.ndarray], Trajectory], found: Trajectory) -> dict[str, float]:
    """Relative error of the ninth peak of a rocking block."""
    exact, peaks = impacts.peaks(pitches(truth(found.times))), impacts.peaks(pitches(found))
    error = abs(peaks[8] / exact[8] - 1) if len(peaks) > 8 else math.inf
    return {'peak_9_error': float(error)}


def pitches(trajectory: Trajectory) -> np.ndarray:
    """Angles (t,) rad about y of a body that rotates about y alone."""
    _, y, _, w = trajectory.orientations[:, 0].T
    return 2 * np.arctan2(y, w)


def rocking_block() -> ReferenceMotion:
    """A slender block that rocks from edge to edge, released at 5 degrees."""
    return _on_edge('rocking_block', 'Block that rocks from 5°, 3 s', 'Housner 1963',
                    (0.2, 0.4, 0.8), math.radians(5), 3.0, True)


def falling_rod() -> ReferenceMotion:
    """A rod that tips over its edge; beyond 54 degrees friction 0.7 would not hold it."""
    return _on_edge('falling_rod', 'Rod that falls over, from 5° to 49°', 'a pendulum, upside down',
                    ROD, math.radians(5), 0.84, False)


def dropped_rod(name: str, title: str, restitution: float, friction: float) -> ReferenceMotion:
    """A rod dropped by 0.2 m at 30 degrees, moving forwards: its lower edge strikes once."""
    lean, drop, speed = math.radians(30), 0.2, 0.5
    arm = rotation.rotate(rotation.from_axis_angle(PITCH, lean),
                          np.array((ROD[0] / 2, 0.0, -ROD[2] / 2)))
    height = drop - arm[2]
    struck = math.sqrt(2 * drop / GRAVITY)
    fall = np.array((speed, 0.0, -GRAVITY * struck))
    inertia = (ROD[0] ** 2 + ROD[2] ** 2) / 12
    along, up = impacts.planar_impulse((arm[0], arm[2]), 1.0, inertia, (fall[0], fall[2]),
                                       restitution, friction)
    after = fall + np.array((along, 0.0, up))
    rate = (arm[2] * along - arm[0] * up) / inertia

    def truth(times: np.ndarray) -> Trajectory:
        early, late = np.minimum(times, struck)[:, None], np.maximum(times - struck, 0)[:, None]
        pull = np.array((0.0, 0.0, -GRAVITY / 2))
        centres = (np.array((0, 0, height)) + np.array((speed, 0, 0)) * early + pull * early ** 2
                   + after * late + pull * late ** 2)
        return Trajectory.of_poses(times, centres[:, None],
                                   orientations_about(PITCH, lean + rate * late))
    scene = _body(Box(ROD), Material(friction=friction, restitution=restitution),
                  (0.0, 0.0, height), rotation.from_axis_angle(PITCH, lean),
                  velocity=(speed, 0.0, 0.0))
    return ReferenceMotion(name, f'Dropped rod {title}, e = {restitution:g}, µ = {friction:g}',
                           "Newton's and Coulomb's laws", Trial(scene, 0.3), truth, in_flight=False)


def spinning_disc() -> ReferenceMotion:
    """A disc that spins on its face until friction stops it."""
    radius, thick, rate, friction = 0.2, 0.05, 10.0, 0.3

    def truth(times: np.ndarray) -> Trajectory:
        angles = impacts.spin_down(radius, friction, GRAVITY, rate, times)
        return Trajectory.of_poses(times, np.tile((0.0, 0.0, thick / 2), (len(times), 1, 1)),
                                   orientations_about((0.0, 0.0, 1.0), angles[:, None]))
    scene = _body(Cylinder(radius, thick), Material(friction=friction, restitution=0.0),
                  (0.0, 0.0, thick / 2), spin=(0.0, 0.0, rate))
    return ReferenceMotion('spinning_disc', 'Disc that spins on its face, µ = 0.3, 0.7 s',
                           'torque 2/3 µ m g r', Trial(scene, 0.7), truth, 'angle_worst_rad',
                           in_flight=False)


def thin_disc() -> ReferenceMotion:
    """A disc that slides and spins on its face; at 2 mm the pressure is uniform."""
    radius, thick, speed, rate, friction = 0.2, 0.002, 1.0, 10.0, 0.3

    def truth(times: np.ndarray) -> Trajectory:
        slid, angles = closed_forms.slide_and_spin(radius, friction, GRAVITY, speed, rate, times)
        centres = np.stack([slid, 0 * slid, 0 * slid + thick / 2], axis=1)
        return Trajectory.of_poses(times, centres[:, None],
                                   orientations_about((0.0, 0.0, 1.0), angles[:, None]))
    scene = _body(Cylinder(radius, thick), Material(friction=friction, restitution=0.0),
                  (0.0, 0.0, thick / 2), velocity=(speed, 0.0, 0.0), spin=(0.0, 0.0, rate))
    return ReferenceMotion('thin_disc', 'Disc that slides and spins on its face, µ = 0.3, 0.7 s',
                           'Coulomb over an even pressure, Farkas 2003', Trial(scene, 0.7), truth,
                           in_flight=False)


def balls(name: str, title: str, masses: tuple[float, ...], restitution: float) -> ReferenceMotion:
    """Balls in a row without gravity; the first one strikes at 2 m/s."""
    radius, gap, speed = 0.1, 0.05, 2.0
    starts = [index * (2 * radius + gap) for index in range(len(masses))]
    speeds = [speed, *[0.0] * (len(masses) - 1)]

    def truth(times: np.ndarray) -> Trajectory:
        places = impacts.balls_in_a_row(radius, masses, starts, speeds, restitution, times)
        positions = np.zeros((len(times), len(masses), 3))
        positions[:, :, 0] = places
        return Trajectory.of_poses(times, positions)
    placements = tuple(
        Placement(Ragdoll(f'ball_{index}', (Bone('ball', Sphere(radius), mass, (0.0, 0.0, 0.0)),)),
                  position=(start, 0.0, 0.0), velocity=(velocity, 0.0, 0.0))
        for index, (mass, start, velocity) in enumerate(zip(masses, starts, speeds, strict=True)))
    scene = Scene(name, placements, None, Material(friction=0.0, restitution=restitution),
                  gravity=(0.0, 0.0, 0.0))
    return ReferenceMotion(name, title, "Newton's law, momentum", Trial(scene, 0.5), truth,
                           in_flight=False)

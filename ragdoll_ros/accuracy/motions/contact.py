"""Contacts with a closed form: a bouncing ball, a block on a slope, a rolling ball."""
import itertools
import math

import numpy as np

from ...model import rotation
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Ground, Material, Placement, Scene
from ...model.shapes import Box, Sphere
from ..cases.trial import Trial, posed
from ..references import closed_forms
from ..trajectory import Trajectory
from .motion import ReferenceMotion, orientations_about

GRAVITY = 9.8
RADIUS = 0.1


def contact_motions() -> list[ReferenceMotion]:
    """All reference motions with contacts that have a closed form."""
    return [*map(bounce, (0.1, 0.5, 0.9, 1.0)), incline('incline_stick', 'Block that sticks', 0.6),
            incline('incline_slip', 'Block that slips', 0.2),
            incline('tilted_stick', 'Block that sticks under tilted gravity', 0.6, tilted=True),
            incline('tilted_slip', 'Block that slips under tilted gravity', 0.2, tilted=True),
            rolling_ball(),
            rolling_ball('backspin_ball', 'Ball with backspin that comes back',
                         'v falls to (5 v + 2 r w) / 7', 1.0, -4.0)]


def _ball(material: Material, height: float, **placed: object) -> Scene:
    doll = Ragdoll('ball', (Bone('ball', Sphere(RADIUS), 1.0, (0.0, 0.0, 0.0)),))
    placement = Placement(doll, position=(0.0, 0.0, RADIUS + height), **placed)
    return Scene('ball', (placement,), Ground(), material)


def bounce(restitution: float = 0.5, height: float = 1.0, bounces: int = 3) -> ReferenceMotion:
    """A ball dropped from ``height`` m; its n-th apex is at e^(2 n) times this height."""
    impacts = closed_forms.bounce_times(height, restitution, GRAVITY, bounces + 1)

    def truth(times: np.ndarray) -> Trajectory:
        heights = np.array([_flight_height(t, height, restitution, impacts) for t in times])
        positions = np.zeros((len(times), 1, 3))
        positions[:, 0, 2] = RADIUS + heights
        return Trajectory.of_poses(times, positions)

    def apexes(trajectory: Trajectory) -> dict[str, float]:
        heights = trajectory.positions[:, 0, 2] - RADIUS
        errors = {}
        for n, (begin, end) in enumerate(itertools.pairwise(impacts), start=1):
            inside = (trajectory.times > begin) & (trajectory.times < end)
            if inside.sum() < 3:  # too short a flight for a parabola
                break
            exact = closed_forms.bounce_apex(height, restitution, n)
            apex = _apex(trajectory.times[inside], heights[inside])
            errors[f'apex_{n}_error'] = abs(apex / exact - 1)
        return errors
    scene = _ball(Material(friction=0.0, restitution=restitution), height)
    duration = round(impacts[bounces] - 0.01, 2)
    name = 'bounce' if restitution == 0.5 else f'bounce_{restitution:g}'
    return ReferenceMotion(name, f'Ball that bounces {bounces} times, e = {restitution:g}',
                           'parabolas, heights e²ⁿ h', Trial(scene, duration), truth,
                           in_flight=False, extra=apexes)


def _apex(times: np.ndarray, heights: np.ndarray) -> float:
    """Apex of the parabola through the three highest samples, m."""
    top = int(np.clip(np.argmax(heights), 1, len(heights) - 2))
    a, b, c = np.polyfit(times[top - 1:top + 2] - times[top], heights[top - 1:top + 2], 2)
    return float(c - b * b / (4 * a)) if a < 0 else float(heights.max())


def _flight_height(t: float, height: float, restitution: float, impacts: list[float]) -> float:
    if t <= impacts[0]:
        return height - GRAVITY * t * t / 2
    n = max(index for index, impact in enumerate(impacts) if impact <= t)
    speed = restitution ** (n + 1) * math.sqrt(2 * GRAVITY * height)
    since = t - impacts[n]
    return max(0.0, speed * since - GRAVITY * since * since / 2)


def incline(name: str, title: str, friction: float, slope: float = math.radians(20),
            tilted: bool = False) -> ReferenceMotion:
    """A flat block on a slope of 20 degrees, or on level ground with ``tilted`` gravity."""
    lean = 0.0 if tilted else slope
    normal = (math.sin(lean), 0.0, math.cos(lean))
    downhill = np.array((math.cos(lean), 0.0, -math.sin(lean)))
    pull = GRAVITY * np.array((math.sin(slope - lean), 0.0, -math.cos(slope - lean)))
    doll = Ragdoll('block', (Bone('block', Box((0.3, 0.3, 0.1)), 1.0, (0.0, 0.0, 0.0)),))
    orientation = tuple(rotation.from_axis_angle((0, 1, 0), lean))
    start = 0.05 * np.array(normal)
    scene = Scene('incline', (Placement(doll, position=start, orientation=orientation),),
                  Ground(normal), Material(friction=friction, restitution=0.0), tuple(pull))

    def truth(times: np.ndarray) -> Trajectory:
        slid = closed_forms.incline_slide(slope, friction, GRAVITY, times)
        return Trajectory.of_poses(times, (start + slid[:, None] * downhill)[:, None],
                                   np.tile(orientation, (len(times), 1, 1)))
    where = 'of 20°' if tilted else 'on a slope of 20°'
    return ReferenceMotion(name, f'{title} {where}, µ = {friction:g}, 1 s', "Coulomb's law",
                           Trial(scene, 1.0), truth, in_flight=False)


def rolling_ball(name: str = 'rolling_ball', title: str = 'Ball that slides, then rolls',
                 reference: str = 'v falls to 5/7, then stays', speed: float = 2.0,
                 rim: float = 0.0, friction: float = 0.3) -> ReferenceMotion:
    """A ball that starts sliding on the ground; ``rim`` is radius times spin, m/s, forwards > 0."""
    scene = _ball(Material(friction=friction, restitution=0.0), 0.0, velocity=(speed, 0.0, 0.0),
                  spin=(0.0, rim / RADIUS, 0.0))

    def truth(times: np.ndarray) -> Trajectory:
        positions = np.zeros((len(times), 1, 3))
        positions[:, 0, 0] = closed_forms.ball_slide_then_roll(speed, friction, GRAVITY, times, rim)
        positions[:, 0, 2] = RADIUS
        angles = closed_forms.ball_slide_then_roll_angle(speed, friction, GRAVITY, RADIUS, times,
                                                         rim)
        return Trajectory.of_poses(
            times, positions, orientations_about((0.0, 1.0, 0.0), angles[:, None]))
    start = posed(scene.dolls[0])
    return ReferenceMotion(name, f'{title}, µ = {friction:g}, 1.5 s', reference,
                           Trial(scene, 1.5, start), truth, in_flight=False)

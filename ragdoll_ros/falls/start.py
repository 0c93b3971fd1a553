"""Initial conditions of a fall from its drawn values: scene, coordinates, pushes."""
import math
from dataclasses import dataclass, replace

import numpy as np

from ..model import rotation
from ..model.coordinates import DofLayout, GeneralizedState
from ..model.forward_kinematics import bone_motions
from ..model.push import Push
from ..model.ragdoll import Ragdoll
from ..model.rotation import sine_and_cosine
from ..model.scene import SECOND, Ground, Material, Placement, Scene
from .bodies import turned
from .recipe import Recipe
from .walking import SIDES, gait

GRAVITY = (0.0, 0.0, -9.8)


@dataclass(frozen=True)
class JointRelease:
    """Joint ``angles`` released ``at`` ns; None: all that are still held."""

    at: int
    angles: list[str] | None


@dataclass(frozen=True)
class BoneHold:
    """A ``bone`` whose centre of mass a hand holds from ``at`` to ``until``, ns: in place, or while
    the hand moves to a point, with minimum jerk (Flash and Hogan 1985, J Neurosci 5:1688).
    """

    at: int
    until: int
    bone: str
    to: tuple[float, float, float] | None = None
    """Where the hand moves, m, world frame; None: nowhere."""
    takes: int = 1
    """Duration of that movement, ns."""

    def place(self, start: np.ndarray, time: int) -> np.ndarray:
        """Position (3,) m, at ``time`` ns, of the hand that was at ``start`` (3,) when it
        grabbed.
        """
        share = min(max((time - self.at) / self.takes, 0.0), 1.0)
        return start + share ** 3 * (10 - 15 * share + 6 * share ** 2) * (np.array(self.to) - start)


@dataclass(frozen=True)
class Start:
    """Initial conditions of fall ``number`` of a recipe; ``drawn`` is from Recipe.draw."""

    number: int
    drawn: dict
    scene: Scene
    clearance: float
    """Height of the lowest point above the ground, m."""
    angles: dict[str, float]
    """Nonzero joint angles, rad, by name."""
    pushes: tuple[Push, ...]
    limp: tuple[JointRelease, ...]
    """In order of time; without any, no joint is held."""
    grabs: tuple[BoneHold, ...] = ()

    @property
    def last_event(self) -> int:
        """Time, ns, of the last end of a push or grab or joint release; 0 without any."""
        ends = [round((push.start + push.duration) * SECOND) for push in self.pushes]
        return max([0, *ends, *(limp.at for limp in self.limp),
                    *(grab.until for grab in self.grabs)])

    def coordinates(self, bound: GeneralizedState) -> GeneralizedState:
        """Generalized state of the start: ``bound``, the scene's own, with the joint angles of the
        start.
        """
        layout = DofLayout([placement.doll for placement in self.scene.dolls])
        angles = layout.joint_angles(bound.q)
        for name, angle in self.angles.items():
            angles[self.scene.angle_names.index(name)] = angle
        return GeneralizedState(layout.with_joint_angles(bound.q, angles), bound.v)


def start_of(recipe: Recipe, number: int) -> Start:
    """Initial conditions of fall ``number``; they depend on recipe and number alone."""
    drawn = recipe.draw(number)
    start, ground = drawn['start'], drawn['ground']
    doll = _with_friction(recipe.doll(drawn['who']), ground)
    heading = rotation.from_axis_angle((0, 0, 1), math.radians(start['heading_deg']))
    sine, cosine = sine_and_cosine(math.radians(start['lean_towards_deg']))
    lean = rotation.from_axis_angle((-sine, cosine, 0.0), math.radians(start['lean_deg']))
    orientation = (_uniform_orientation(*start['shares']) if start['tumbled']
                   else rotation.multiply(heading, lean))
    faced = orientation if start['tumbled'] else heading
    placement = Placement(doll, orientation=tuple(orientation),
                          velocity=tuple(rotation.rotate(faced, start['velocity'])),
                          spin=tuple(rotation.rotate(faced, start['spin'])))
    angles = _angles(doll, start)
    if start.get('level_soles'):
        angles.update(_ankles(doll, angles, lean, start.get('walk', {}).get('swing')))
    if 'walk' in start:
        step = gait(doll, angles, **start['walk'])
        placement = replace(placement, angles=angles, rates=step.rates,
                            velocity=tuple(rotation.rotate(orientation, step.velocity)),
                            spin=tuple(rotation.rotate(orientation, step.spin)))
    scene = Scene(recipe.name, (placement,), _ground(ground, recipe.stiffness), gravity=GRAVITY,
                  material=Material(ground['friction'], restitution=ground['restitution']),
                  step=1 / recipe.rate, bodies=turned(recipe.bodies, heading))
    return Start(number, drawn, scene, start['clearance'], angles,
                 tuple(_push(push, heading) for push in drawn['pushes']),
                 tuple(sorted((JointRelease(round(each['at'] * SECOND), each.get('angles'))
                               for each in drawn['limp']), key=lambda limp: limp.at)),
                 tuple(_hold(grab, heading) for grab in drawn.get('grabs', ())))


def _uniform_orientation(first: float, second: float, third: float) -> np.ndarray:
    """Uniformly distributed orientation (4,) from three numbers in [0, 1) (Shoemake, Uniform Random
    Rotations, Graphics Gems III, 1992).
    """
    (s1, c1), (s2, c2) = (sine_and_cosine(2 * math.pi * share) for share in (second, third))
    low, high = math.sqrt(1 - first), math.sqrt(first)
    return np.array([low * s1, low * c1, high * s2, high * c2])


def _with_friction(doll: Ragdoll, ground: dict) -> Ragdoll:
    """The doll with bones that have the coefficients ``friction_under`` in contact with the ground.

    A contact has the geometric mean of both sides' friction; if one is infinite, that of the other.
    On a ground without friction they are 0.
    """
    under = ground.get('friction_under', {})
    if not under:
        return doll
    full = ground['friction']
    own = {name: value if math.isinf(full) else value ** 2 / full if full else 0.0
           for name, value in under.items()}
    return replace(doll, bones=tuple(
        replace(bone, friction=own[bone.name]) if bone.name in own else bone
        for bone in doll.bones))


def _ground(drawn: dict, stiffness: float) -> Ground:
    """A plane whose normal is tilted downhill."""
    sine, cosine = sine_and_cosine(math.radians(drawn['slope_deg']))
    y, x = sine_and_cosine(math.radians(drawn['downhill_deg']))
    return Ground((sine * x, sine * y, cosine), stiffness=stiffness)


def _angles(doll: Ragdoll, start: dict) -> dict[str, float]:
    """Initial joint angles, rad, by name."""
    limits = {name: pair for joint in doll.joints
              for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True)}
    angles = {name: limits[name][0] + share * (limits[name][1] - limits[name][0])
              for name, share in start['angle_shares'].items()}
    return {**angles, **{name: math.radians(angle) for name, angle in start['angles_deg'].items()}}


def _ankles(doll: Ragdoll, angles: dict[str, float], lean: np.ndarray,
            swing: str | None) -> dict[str, float]:
    """Angles of a person's ankles, rad, without those of the swinging leg, at which the soles are
    level while the root has the orientation ``lean``; within the ranges of the ankles.
    """
    limits = {name: pair for joint in doll.joints
              for name, pair in zip(joint.angle_names, joint.angle_limits, strict=True)}
    motions, found = bone_motions(doll, angles, {}), {}
    for side in set(SIDES) - {swing}:
        shin = rotation.multiply(lean, motions[f'{side}_shin'].turn)
        # The vertical in the shin's axes, which pitch, then roll, must make the foot's z axis.
        x, y, z = rotation.rotate(rotation.inverse(shin), (0.0, 0.0, 1.0)).tolist()
        for axis, angle in (('p', math.atan2(x, z)), ('r', -math.asin(y))):
            name = f'{SIDES[side]}_{axis}_ankle'
            found[name] = min(max(angle, limits[name][0]), limits[name][1])
    return found


def _hold(drawn: dict, heading: np.ndarray) -> BoneHold:
    at, duration = drawn['at'], drawn['duration']
    to = tuple(rotation.rotate(heading, drawn['to']).tolist()) if 'to' in drawn else None
    return BoneHold(round(at * SECOND), round((at + duration) * SECOND), drawn['bone'], to,
                    round(drawn.get('takes', duration) * SECOND))


def _push(drawn: dict, heading: np.ndarray) -> Push:
    sine, cosine = sine_and_cosine(math.radians(drawn['towards_deg']))
    up, along = sine_and_cosine(math.radians(drawn['upwards_deg']))
    force = drawn['force'] * rotation.rotate(heading, (along * cosine, along * sine, up))
    return Push(drawn['bone'], tuple(force), start=drawn['at'], duration=drawn['duration'])

"""A swing: a chain of point masses on massless rods, attached to a point of a bone.

Frozen, validated data. SI units; points and directions: doll's frame, bind pose.

- ``stiffness`` k, N m/rad: the torque on a link is k times the angle to its rest direction. The
  first link's rest direction is fixed in the bone, each further one's in the link before it.
- ``damping`` zeta, a ratio: the torque is -2 zeta J sqrt(k/J + |gravity| g/reach) times the angular
  rate relative to the same frame; J and reach as in physics/swing/chains.py (m l^2 and l for one
  mass). 1 is critical where gravity acts along the rest direction, overdamped elsewhere.
- ``gravity``: factor of the scene's gravity; 0 for none, negative values rise.

The masses have full inertia in the world frame: the bone's motion acts on them.
"""
from dataclasses import dataclass

from . import errors
from .errors import set_fields
from .vectors import Vector, finite_floats, unit_vector

MODES = ('spring', 'pendulum', 'free')
LENGTH_RANGE = (1e-3, 1e3)
"""m; the motion of the shortest is still resolved."""
MASS_RANGE = (1e-9, 1e6)
MAX_STIFFNESS = 1e15
MAX_DAMPING = 1e4
MAX_GRAVITY = 10.0
COLLIDER_RADIUS_RANGE = (1e-3, 1e3)
"""m; a tip's way in the shortest step is still less than the smallest."""


@dataclass(frozen=True)
class Link:
    """A massless rod of ``length`` m with a point ``mass`` (kg) at its end.

    ``direction`` is its rest direction (doll's frame, bind pose); None: its swing's. ``riders`` are
    the names of the doll's riders that it moves, with their skin. ``radius`` m is that of its mass
    in contact with colliders.
    """

    length: float
    mass: float = 1.0
    stiffness: float = 0.0
    damping: float = 0.0
    direction: Vector | None = None
    riders: tuple[str, ...] = ()
    radius: float = 0.0

    def __post_init__(self) -> None:
        set_fields(self, riders=tuple(self.riders), **{key: float(getattr(self, key))
                            for key in ('length', 'mass', 'stiffness', 'damping', 'radius')})
        errors.check_range('length', self.length, *LENGTH_RANGE)
        errors.check_range('mass', self.mass, *MASS_RANGE)
        errors.check_range('stiffness', self.stiffness, 0, MAX_STIFFNESS)
        errors.check_range('damping', self.damping, 0, MAX_DAMPING)
        errors.check_range('radius', self.radius, 0, COLLIDER_RADIUS_RANGE[1])
        if self.direction is not None:
            set_fields(self, direction=unit_vector('direction', self.direction))


@dataclass(frozen=True)
class Collider:
    """A sphere about the point ``at``, m, or, with ``to``, a capsule around the segment from ``at``
    to ``to``. It is fixed to ``bone``, with a ``radius`` in m. Points are in the doll's frame, bind
    pose.
    """

    bone: str
    radius: float
    at: Vector
    to: Vector | None = None

    def __post_init__(self) -> None:
        set_fields(self, radius=float(self.radius), at=finite_floats('at', self.at))
        errors.check_range('radius', self.radius, *COLLIDER_RADIUS_RANGE)
        if self.to is not None:
            set_fields(self, to=finite_floats('to', self.to))


@dataclass(frozen=True)
class Swing:
    """A chain of ``links`` attached to the point ``root`` (m) of ``bone``.

    ``mode``: 'spring' (links return to their rest directions), 'pendulum' (no springs), 'free'
    (no rods: each mass falls from its rest position with ``velocity`` m/s, world axes, which only
    this mode has). ``independent``: each link swings as if nothing hung on it, as the spring bones
    of VRM do; else it carries the masses beyond it. Its masses do not enter ``colliders``: they
    lose their speed towards them, and slide without friction.
    """

    name: str
    bone: str
    root: Vector
    direction: Vector
    links: tuple[Link, ...]
    gravity: float = 1.0
    mode: str = 'spring'
    velocity: Vector = (0.0, 0.0, 0.0)
    independent: bool = False
    colliders: tuple[Collider, ...] = ()

    def __post_init__(self) -> None:
        set_fields(self, root=finite_floats('root', self.root), colliders=tuple(self.colliders),
                   direction=unit_vector('direction', self.direction), links=tuple(self.links),
                   gravity=float(self.gravity), velocity=finite_floats('velocity', self.velocity))
        errors.check_range('gravity', self.gravity, -MAX_GRAVITY, MAX_GRAVITY)
        if self.mode not in MODES:
            raise errors.WrongForm('mode', self.mode, 'one of ' + ', '.join(MODES))
        if not self.links:
            raise errors.WrongForm('links', (), 'at least one link')
        for index, link in enumerate(self.links):
            if self.mode != 'spring' and link.stiffness:
                raise errors.WrongForm(f'links[{index}].stiffness', link.stiffness,
                                       f'0 for a {self.mode}, or mode: spring')
        if not isinstance(self.independent, bool):
            raise errors.WrongForm('independent', self.independent, 'true or false')
        if self.mode != 'free' and any(self.velocity):
            raise errors.WrongForm('velocity', self.velocity, 'none, or mode: free')
        if self.mode == 'free' and self.colliders:
            raise errors.WrongForm('colliders', f'{len(self.colliders)} of a free swing',
                                   'none, or another mode')

    def directions(self) -> tuple[Vector, ...]:
        """Rest direction of each link (doll's frame, bind pose)."""
        return tuple(link.direction or self.direction for link in self.links)


def strand(links: int, length: float, mass: float = 0.1,
           stiffness: float | tuple[float, float] = 0.0, damping: float = 0.0,
           rigidity: float | None = None) -> tuple[Link, ...]:
    """``links`` links of equal length that share ``length`` m and ``mass`` kg.

    ``stiffness`` (N m/rad) varies linearly from the root to the tip; one number is for all links.
    Instead, ``rigidity`` E I (N m^2) is that of a uniform strap clamped at its root: the springs
    are E I links/length, the first twice that; the last mass is half of the others, as half a
    link's mass is at the root. The lowest frequency is then 5 % below the strap's for 4 links, 1.3
    % for 8.
    """
    errors.check_range('links', links, 1, 1000)
    if rigidity is not None:
        if stiffness:
            raise errors.WrongForm('rigidity', rigidity, 'none beside a stiffness')
        springs = [rigidity * links / length * (1 + (index == 0)) for index in range(links)]
        masses = [mass / links * (1 - (index == links - 1) / 2) for index in range(links)]
    else:
        root, tip = stiffness if isinstance(stiffness, (tuple, list)) else (stiffness, stiffness)
        springs = [root + (tip - root) * index / max(links - 1, 1) for index in range(links)]
        masses = [mass / links] * links
    return tuple(Link(length / links, *of_one, damping)
                 for of_one in zip(masses, springs, strict=True))

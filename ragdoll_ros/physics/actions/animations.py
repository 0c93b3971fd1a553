"""Animations: the dolls of a scene that their animations move, until each goes limp.

In an interval, a doll without motors moves at the constant velocities that take it to the pose of
its animation at the interval's end; there it gets the animation's velocities. A doll with motors is
not moved: the animation sets the targets of its motors. Times in ns.
"""
from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ...model.dof_layout import GeneralizedState
from ...model.scene import SECOND, Placement, Scene
from ...model.scene_change import SceneChange
from ...model.state import State
from ..engine.protocol import Drives, Engine, Spring, Springs, Wrenches
from .joint_springs import JointSprings


@dataclasses.dataclass
class _Animated:
    """A doll that an animation moves."""

    placement: Placement
    doll: int
    begin: int
    """ns, when the animation began."""
    known: tuple[int, GeneralizedState] | None = None
    """The last instant, and the state then: the end of an interval is the beginning of the next."""

    @property
    def limp_at(self) -> int | None:
        """Time, ns, at which the doll goes limp; None: only when it is told to."""
        limp_at = self.placement.animation.limp_at
        return None if math.isinf(limp_at) else self.begin + round(limp_at * SECOND)

    def at(self, time: int) -> GeneralizedState:
        """Its coordinates and velocities at ``time``."""
        if self.known is None or self.known[0] != time:
            self.known = time, self._evaluate(time)
        return self.known[1]

    def moving(self, time: int, end: int) -> GeneralizedState:
        """Coordinates at ``time``, and the constant velocities that take the doll to its
        coordinates at ``end``, if the animation goes on until then without beginning anew.
        """
        q, target = self.at(time).q, self._evaluate(time, end - time).q
        layout = self.placement.animation.motion.layout
        return GeneralizedState(q, layout.displacement(q, target) * (SECOND / (end - time)))

    def _evaluate(self, time: int, further: int = 0) -> GeneralizedState:
        """See Playback.at()."""
        frame = self.placement.pose
        return self.placement.animation.at(frame, np.array(self.placement.velocity),
                                           (time - self.begin) / SECOND, further / SECOND)

    def changes(self, time: int) -> Iterator[int]:
        """Times after ``time`` when the animation ends or begins anew, or the doll goes limp."""
        left = self.placement.animation.left((time - self.begin) / SECOND)
        if math.isfinite(left):
            yield time + max(1, math.ceil(left * SECOND))
        if self.limp_at is not None and self.limp_at > time:
            yield self.limp_at


class Animations:
    """All animated dolls of a scene that are not limp yet; false if there is none."""

    def __init__(self, scene: Scene | None, time: int) -> None:
        """Begin the animations of a scene at ``time``; ``scene`` None: no animations."""
        self._animated = {doll: _Animated(placement, doll, time) for doll, placement in enumerate(
            scene.dolls if scene else ()) if placement.animation}

    def __len__(self) -> int:
        return len(self._animated)

    @property
    def dolls(self) -> list[int]:
        """Indices of the dolls."""
        return list(self._animated)

    @property
    def kinematic(self) -> list[int]:
        """Indices of the dolls without motors, which move as their animations say."""
        return [doll for doll, each in self._animated.items() if each.placement.is_animated]

    def aim(self, springs: JointSprings, time: int, end: int) -> None:
        """Let the targets of motors move with the animations from ``time`` to ``end``."""
        for doll, each in self._animated.items():
            if not each.placement.is_animated:
                state, layout = each.moving(time, end), each.placement.animation.motion.layout
                springs.follow(doll, layout.joint_angles(state.q), layout.joint_rates(state), time)

    def change_scene(self, change: SceneChange, time: int) -> None:
        """Let the dolls that stay go on, and those that come begin at ``time``."""
        after = Animations(change.after, time)._animated
        for doll, old in enumerate(change.old_dolls.tolist()):
            if old in self._animated:
                after[doll] = dataclasses.replace(self._animated[old], doll=doll)
            elif old >= 0:
                after.pop(doll, None)
        self._animated = after

    def save(self) -> object:
        """Save which dolls are animated, for go_back()."""
        return dict(self._animated)

    def go_back(self, saved: object, engine: Engine) -> None:
        """Animate again the dolls that were animated at save(); tell a new ``engine`` which."""
        self._animated = dict(saved)
        self.restore(engine)

    def due(self, time: int) -> list[int]:
        """Dolls that go limp at ``time``, or should have before."""
        return [doll for doll, each in self._animated.items()
                if each.limp_at is not None and each.limp_at <= time]

    def pushed(self, loads: tuple[Wrenches, Springs, Drives], state: State,
               doll_of_bone: np.ndarray) -> list[int]:
        """Dolls on which one of the ``loads`` pushes or pulls harder than the animation bears."""
        return sorted({doll for bone, force in _forces(loads, state)
                       if (doll := int(doll_of_bone[bone])) in self._animated
                       and force > self._animated[doll].placement.animation.limp_above})

    def next_change(self, time: int, end: int) -> int:
        """Earliest time after ``time`` at which a motion changes or a doll goes limp, at most
        ``end``.
        """
        return min((at for each in self._animated.values() for at in each.changes(time)
                    if at < end), default=end)

    def begin_interval(self, engine: Engine, time: int, end: int) -> None:
        """Set coordinates and velocities of the dolls without motors so that they are at ``end``
        where their animations are then.
        """
        self._set(engine, lambda each: each.moving(time, end))

    def end_interval(self, engine: Engine, time: int) -> None:
        """Set poses and velocities of the dolls without motors to those of their animations."""
        self._set(engine, lambda each: each.at(time))

    def release(self, engine: Engine, dolls: Iterable[int], time: int) -> None:
        """Let dolls go limp, from the pose and with the velocities of that instant."""
        for doll in dolls:
            each = self._animated.pop(doll)
            if each.placement.is_animated:
                engine.set_kinematic(doll, False)
                engine.set_doll(doll, _with(engine, {doll: each.at(time)}))

    def restore(self, engine: Engine) -> None:
        """Tell the engine, whose state was set, which dolls are animated."""
        for doll, placement in enumerate(engine.scene.dolls):
            if placement.is_animated:
                engine.set_kinematic(doll, doll in self._animated)

    def _set(self, engine: Engine, state: Callable[[_Animated], GeneralizedState]) -> None:
        if kinematic := self.kinematic:
            engine.set_motion(kinematic, _with(
                engine, {doll: state(self._animated[doll]) for doll in kinematic}))


def _forces(loads: tuple[Wrenches, Springs, Drives],
            state: State) -> Iterator[tuple[int, float]]:
    """Bone of each load, and the norm of its force, N; of a hand's spring without the damping.
    Joint springs have none.
    """
    wrenches, springs, drives = loads
    for wrench in wrenches:
        yield wrench.bone, float(np.linalg.norm(wrench.force))
    for spring in springs:
        if isinstance(spring, Spring):
            away = state.poses(spring.bone).apply(spring.point) - spring.position
            yield spring.bone, min(spring.most, spring.stiffness * float(np.linalg.norm(away)))
    for drive in drives:
        missing = drive.targets[0] - state.linear_velocities[drive.bone]
        yield drive.bone, min(drive.most[0], drive.gains[0] * float(np.linalg.norm(missing)))


def _with(engine: Engine, states: dict[int, GeneralizedState]) -> GeneralizedState:
    """Coordinates and velocities of all dolls: the engine's, with ``states`` of some dolls."""
    here, layout = engine.coordinates, engine.layout
    for doll, state in states.items():
        here.q[layout.doll_q[doll]], here.v[layout.doll_v[doll]] = state.q, state.v
    return here

"""Simulation: integrates a scene tick by tick under pushes, drives, grabs and joint springs."""
from __future__ import annotations

import dataclasses
import itertools
import math
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, cast

import numpy as np

from ..model import errors
from ..model.biomechanical_limits import BiomechanicalLimits
from ..model.compound import has_hull
from ..model.coordinates import GeneralizedState, changed_coordinates, placed_coordinates
from ..model.drive import Drive
from ..model.mesh import Surface
from ..model.push import Push
from ..model.scene import SECOND, STEP_RANGE, Placement, Scene, checked_angles
from ..model.scene_change import SceneChange
from ..model.state import State
from ..model.vectors import finite_floats, unit_vector
from .accuracy import Accuracy, resolve_accuracy
from .actions.animations import Animations
from .actions.body_motion import MotionCommand
from .actions.driven_bodies import DrivenBodies
from .actions.grab import DRAG_TIME, Grab, Hands, checked_point
from .actions.joint_springs import JointSpring, JointSprings
from .actions.push_queue import PushQueue
from .engine.capabilities import Capability, require
from .engine.protocol import Contacts, Drives, Engine, Overlap, Springs, Wrenches
from .engine.registry import resolve_engine
from .prepared_change import PreparedChange
from .rigid_body import GroundHeights, JointGap
from .sensors.impacts import Impact, ImpactRecorder
from .sleeping import SleepDetector
from .stability import StabilityTest
from .swing.pose import SwingState

if TYPE_CHECKING:
    from .swing.swings import SwingSimulation

MAX_SAMPLES_PER_TICK = 200  # those of a sensor of 1 kHz in the longest tick
MAX_TICKS = 10 ** 9  # of one run
MAX_WORKERS = 64  # threads, each with its own workspace


def _deprecated(old: str, new: str) -> property:
    """Alias of attribute ``new`` that warns; kept for one version."""
    def warned() -> str:
        warnings.warn(f'Simulation.{old} is now {new}', DeprecationWarning, stacklevel=3)
        return new
    return property(lambda simulation: getattr(simulation, warned()),
                    lambda simulation, value: setattr(simulation, warned(), value),
                    doc=f'Deprecated name of {new}.')


class Simulation:
    """A scene in motion. The same actions at the same ticks give the same states to the bit.

    Args:
        scene: dolls, ground, gravity, material.
        step: tick, s; None: the scene's.
        accuracy: 'draft', 'normal', 'exact', or an Accuracy.
        engine: 'auto', 'rigid', 'bullet', 'mujoco', or a class that implements Engine.
        workers: threads that integrate separate clusters of dolls, 1 to 64; 'auto': one for each
            processor. States do not depend on it.

    Raises:
        OutOfRange: step, accuracy, engine or workers is not valid.
        MissingEngine: the engine's library is not installed or does not work.
        WrongForm: the engine is not rigid, and a joint has passive torques, a doll has motors or a
            fixed root, a body follows, or a shape is a mesh, a height field or a hull.

    Example:
        >>> from ragdoll_ros import Push, Simulation, load_scene
        >>> with Simulation(load_scene('drop')) as simulation:
        ...     simulation.push(Push('torso', force=(500, 0, 0), duration=0.2))
        ...     for _ in range(100):
        ...         state = simulation.advance()
        >>> state.positions.shape, simulation.time
        ((10, 3), 1000000000)
    """

    time: int
    """Simulated time since the start, ns."""
    substates: tuple[State, ...]
    """States at the start of the last tick and at the end of each of its sub-intervals."""
    asleep: bool
    """Whether all dolls sleep, so that advance() does not integrate."""

    def __init__(self, scene: Scene, step: float | None = None, accuracy: str | Accuracy = 'normal',
                 engine: str | type[Engine] = 'auto', workers: int | str = 1) -> None:
        if workers == 'auto':
            workers = len(os.sched_getaffinity(0))
        errors.check_range('workers', cast(int, workers), 1, MAX_WORKERS)
        self.scene = scene
        self.step = scene.step if step is None else step
        self._samples_per_tick = 1
        self.reset_count = 0
        """Number of starts: the first, and one for each reset() and place()."""
        choice = resolve_engine(engine)
        for capability in _needed(scene):
            require(capability, choice.make.capabilities, choice.name)
        self.engine_name, self.engine_reason = choice.name, choice.reason
        """Name of the engine, and why 'auto' did not select rigid."""
        self._make = partial(choice.make, workers=int(workers))
        self._impact_recorder: ImpactRecorder | None = None
        self._placed: GeneralizedState | None = None
        self._overlaps: tuple[Overlap, ...] | None = None
        if any(placement.is_posed for placement in scene.dolls):
            self._placed = placed_coordinates(scene.dolls)
        self._engine = self._make_engine(resolve_accuracy(accuracy))
        self._follows = any(placement.follow for placement in scene.dolls)
        self._plays = True
        """Whether animations begin at each reset(); not after place()."""
        self._start = self._engine.save()
        self._sleep_detector = SleepDetector(scene)
        self._stability_test = StabilityTest(scene, self._engine.layout)
        self._swings = _swings(scene)
        self.reset()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def state(self) -> State:
        """Poses and velocities of all bones."""
        return self._engine.state

    @property
    def swings(self) -> SwingState | None:
        """State of all swing masses; None for a scene without swings."""
        return self._swings.state if self._swings else None

    @property
    def step(self) -> float:
        """Tick, s; may be changed between ticks."""
        return self.tick / SECOND

    @step.setter
    def step(self, step: float) -> None:
        errors.check_range('step', step, *STEP_RANGE)
        self.tick = round(step * SECOND)
        """Tick, ns."""

    @property
    def accuracy(self) -> Accuracy:
        """Step sizes and tolerances; may be changed between ticks."""
        return self._engine.accuracy

    @accuracy.setter
    def accuracy(self, accuracy: str | Accuracy) -> None:
        self._engine.accuracy = resolve_accuracy(accuracy)

    @property
    def samples_per_tick(self) -> int:
        """Equal sub-intervals of a tick; ``substates`` has the state at the end of each.

        May be changed between ticks. It changes step lengths, and so the last digits of states.
        """
        return self._samples_per_tick

    @samples_per_tick.setter
    def samples_per_tick(self, count: int) -> None:
        errors.check_range('samples_per_tick', count, 1, MAX_SAMPLES_PER_TICK)
        self._samples_per_tick = int(count)

    starts = _deprecated('starts', 'reset_count')
    parts = _deprecated('parts', 'samples_per_tick')
    trail = _deprecated('trail', 'substates')

    @property
    def capabilities(self) -> frozenset[Capability]:
        """What the engine can do beyond what all engines can do."""
        return self._engine.capabilities

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of all dolls, J."""
        return float(self._engine.doll_totals.kinetic.sum())

    @property
    def energy_excess(self) -> float:
        """Energy, J, minus that at the start and all work since; negative after losses."""
        return float(self._engine.energy_excesses.sum())

    @property
    def work(self) -> tuple[float, float]:
        """Work since the start, J: of pushes, and of hands and joint springs."""
        return self._engine.work

    @property
    def kinetic_energies(self) -> np.ndarray:
        """Kinetic energy of each doll (d,) J."""
        return self._engine.doll_totals.kinetic

    @property
    def energy_excesses(self) -> np.ndarray:
        """Energy excess of each doll (d,) J; changes, summed over a cluster, are meaningful."""
        return self._engine.energy_excesses

    @property
    def cluster_of_doll(self) -> np.ndarray:
        """Number (d,) of the cluster in which each doll was integrated in the last tick."""
        return self._engine.cluster_of_doll

    @property
    def energy_error(self) -> float:
        """Relative energy gain in a tick above which Guard takes a state for diverged."""
        return self._engine.energy_error

    @property
    def pushes(self) -> tuple[Push, ...]:
        """Active pushes; a drive appears as the push that it exerts on a bone at rest."""
        return self._pushes.active(self.time)

    @property
    def grabs(self) -> tuple[Grab, ...]:
        """Active grabs."""
        return self._hands.grabs

    @property
    def holds(self) -> tuple[JointSpring, ...]:
        """Joint springs, those of motors included."""
        return self._joint_springs.joint_springs(self.time)

    @property
    def contacts(self) -> Contacts:
        """All contact points."""
        return self._engine.contacts()

    @property
    def initial_overlaps(self) -> tuple[Overlap, ...]:
        """What overlaps at the start by more than 1 mm, the deepest first, except bones of a doll
        that overlap as deep at joint angles of zero; computed when it is first read. Raises
        WrongForm: the engine is not rigid.
        """
        if self._overlaps is None:
            self._require(Capability.OVERLAPS)
            placed = self._placed or placed_coordinates(self.scene.dolls)
            self._overlaps = self._engine.overlaps(placed)
        return self._overlaps

    @property
    def contact_impulses(self) -> np.ndarray:
        """Impulse (n, 3) N s of all contacts on each bone since the start, those of impacts
        included, world frame; the same while it sleeps. Raises WrongForm: the engine is not rigid.
        """
        self._require(Capability.CONTACT_IMPULSES)
        return self._engine.contact_impulses.copy()

    def record_impacts(self, limits: BiomechanicalLimits | None) -> None:
        """Record the impacts of each tick from the next one on in ``impacts``, with the force that
        the contact law of ``limits`` gives, see load_limits(); None: no more. States do not depend
        on it. Raises WrongForm: the engine is not rigid, the only one that finds times of impact.

        >>> simulation.record_impacts(None)
        """
        if limits is not None:
            self._require(Capability.IMPACTS)
        if limits is not None or self._impact_recorder is not None:
            self._engine.log_impacts(limits is not None)
        self._impact_recorder = None if limits is None else ImpactRecorder(self.scene, limits)

    @property
    def impacts(self) -> tuple[Impact, ...]:
        """Impacts of bones in the last tick, by time, faster than 0.02 m/s. What rests, slides or
        is clamped has none. Raises WrongForm without record_impacts().
        """
        return tuple(self._recorded_impacts().impacts)

    @property
    def dropped_impacts(self) -> int:
        """Number of impacts since record_impacts() that are in no tick's ``impacts``, as a log was
        full: that of a cluster has room for eight a bone in each call of Engine.advance().
        """
        return self._recorded_impacts().dropped

    @property
    def bones_on_ground(self) -> np.ndarray:
        """Which bones (n,) touch the ground or a static body; cheaper than ``contacts``."""
        return self._engine.bones_on_ground()

    @property
    def coordinates(self) -> GeneralizedState:
        """Generalised coordinates and velocities of all dolls."""
        return self._engine.coordinates

    @property
    def joint_angles(self) -> np.ndarray:
        """Joint angles (k,) rad, in the order of Scene.angle_names."""
        return self._engine.joint_angles

    @property
    def joint_rates(self) -> np.ndarray:
        """Time derivatives of the joint angles (k,) rad/s."""
        return self._engine.joint_rates

    def push(self, push: Push | Drive, channel: str | None = None) -> None:
        """Queue a push or a drive.

        Args:
            push: force and torque on a bone, from ``push.start`` on or from now.
            channel: a new push replaces the last one on the same channel; None: no channel.

        Raises:
            UnknownBone: the scene has no such bone.
            OutOfRange: the start is in the past, or 1000 pushes are queued.

        >>> simulation.push(Push('head', force=(0, 50, 0)), channel='keys')
        """
        self._pushes.add(push, channel, self.time)

    def release(self, channel: str) -> bool:
        """End the push on a channel; returns whether there was one.

        >>> simulation.release('no such channel')
        False
        """
        return self._pushes.release(channel)

    def drive_body(self, name: str, pose: Sequence[float] | None = None,
                   twist: Sequence[float] | None = None,
                   joint_angles: Mapping[str, float] | None = None,
                   rates: Mapping[str, float] | None = None) -> None:
        """Move a body with `follow`, or a robot of several links: from now on at constant velocity
        until the next call, or for 0.2 s of simulated time. Then it stands, and is one of
        ``stale_bodies``.

        A body that follows exactly is at the end of the next tick where pose and twist, or angles
        and rates, take it. If a pose, or that of a link, is too far away to be reached in a tick at
        10 m/s, the body jumps: it is placed there, without an impact. Jumps are counted, but not
        that of the first pose. Work on dolls is work of pushes.

        Joints that are not named continue their motions, until 0.2 s after their last command; so
        does the frame where only joints are given. Limits of joints are not checked: the caller
        keeps them.

        Args:
            name: of the body or the robot.
            pose: (7,) of its frame, world frame: x, y, z, m, and quaternion x, y, z, w; None: from
                where it is.
            twist: (6,) world frame: velocity of the frame's origin, m/s, angular velocity, rad/s;
                None: at rest.
            joint_angles: of a robot: rad, or m of joints that slide, by the names of its joints;
                those in ``rates`` alone start from where they are. A joint that mimics another may
                be named, but follows that one.
            rates: rad/s or m/s; zero for those in ``joint_angles`` alone.

        Raises:
            UnknownDoll: the scene has no such body with `follow`, and no such robot.
            UnknownJoint: the robot has no such joint.
            NotFinite, NotUnit, WrongForm, OutOfRange: for what is no pose, twist, angle or rate.

        >>> simulation.drive_body('robot', twist=(1, 0, 0, 0, 0, 0))  # doctest: +SKIP
        >>> simulation.drive_body('arm', rates={'elbow': 0.5})  # doctest: +SKIP
        """
        command = MotionCommand(pose, twist, joint_angles, rates)
        for doll, placed in self._driven.drive(name, command, self.time, self.tick, self.state):
            layout, here = self._engine.layout, self._engine.coordinates
            here.q[layout.root_positions[doll]] = placed.position
            here.q[layout.root_orientations[doll]] = placed.orientation
            self._engine.set_doll(doll, here)
            self.asleep = False

    @property
    def stale_bodies(self) -> tuple[str, ...]:
        """Names of bodies with `follow` that drive_body() has not moved for 0.2 s, or never; of a
        robot, if its frame or a joint that was moved before has not been moved for 0.2 s.
        """
        return self._driven.stale(self.time)

    def body_pose(self, name: str) -> np.ndarray:
        """Pose (7,) of the frame of a body with `follow`, or of a robot, in the world frame: x, y,
        z, m, and quaternion x, y, z, w. Raises UnknownDoll: the scene has none of this name.

        >>> simulation.body_pose('robot')  # doctest: +SKIP
        """
        return np.concatenate(self._driven.pose(name, self.time, self.state))

    def grab(self, hand: str, bone: str, point: Sequence[float] = (0.0, 0.0, 0.0),
             target: Sequence[float] | None = None) -> None:
        """Attach a hand to a point of a bone by a spring; it releases what it held before.

        Args:
            hand: any name.
            bone: name of the bone.
            point: (3,) m in the bone's frame, from its centre of mass.
            target: (3,) m, world frame: where to move the hand, see drag(); None: nowhere.

        Raises:
            UnknownBone: the scene has no such bone.
            NotFinite, OutOfRange: point or target is invalid or far away, or 20 hands are in use.

        >>> simulation.grab('right', 'head')
        """
        self._hands.grab(hand, bone, point, target, self.state)

    def drag(self, hand: str, target: Sequence[float], within: float = DRAG_TIME) -> None:
        """Move a hand to ``target`` (3,) m, world frame, at constant velocity ``within`` s of
        simulated time. Does nothing for a hand that holds nothing. Raises NotFinite, OutOfRange.

        >>> simulation.drag('right', target=(0, 0, 1.5), within=0.5)
        """
        self._hands.drag(hand, target, within)

    def let_go(self, hand: str) -> None:
        """Release what a hand holds; the bone keeps its velocity.

        >>> simulation.let_go('right')
        """
        self._hands.let_go(hand)

    def hold(self, angle: str, stiffness: float, damping: float = 0.0,
             target: float | None = None, max_torque: float = math.inf) -> None:
        """Put a spring on a joint angle, torque -stiffness (angle - target) - damping rate.

        It replaces the angle's spring, if any. Only the rigid engine has joint springs.

        Args:
            angle: one of Scene.angle_names.
            stiffness: N m/rad.
            damping: N m s/rad.
            target: rad; None: the current angle.
            max_torque: N m, to which the torque is limited.

        Raises:
            UnknownJoint: the scene has no such angle.
            NotFinite, OutOfRange: a number is not finite or out of range.
            WrongAxes: the joint is a ball joint without limits, which has no angles.
            WrongForm: the engine is not rigid.

        >>> simulation.hold('left_shin', stiffness=300, damping=5)
        """
        self._require(Capability.JOINT_SPRINGS)
        self._joint_springs.hold(angle, stiffness, damping, target, max_torque,
                                 self.joint_angles)

    def set_pose_target(self, joint_angles: Mapping[str, float] | None = None,
                        rates: Mapping[str, float] | None = None) -> None:
        """Set targets of joint springs, those of motors or of hold(); others stay.

        Args:
            joint_angles: rad, by Scene.angle_names; a target in ``rates`` alone moves on from where
                it is.
            rates: rad/s, at which the targets move on for 0.2 s, then they stand; 0 where none is
                given. Damping is relative to this rate.

        Raises:
            UnknownJoint: the scene has no such angle.
            NotFinite, OutOfRange, WrongForm: for a number, or an angle without a spring.

        >>> simulation.hold('left_shin', stiffness=300, damping=5, max_torque=50)
        >>> simulation.set_pose_target({'left_shin': 0.5})
        """
        self._joint_springs.set_targets(joint_angles or {}, rates or {}, self.time)

    def set_strength(self, strength: float | Mapping[str, float],
                     names: str | Sequence[str] | None = None) -> None:
        """Set the strength of joint springs, by which stiffness, damping and max_torque are
        multiplied. At 0 a joint is limp.

        Args:
            strength: 0 to 1; or several, by the names of joint angles or bones, without ``names``.
            names: the name of a doll; or names of joint angles, or of bones, whose joints are those
                above them; None: all dolls.

        Raises:
            UnknownDoll, UnknownJoint: the scene has none of this name.
            OutOfRange: for a strength that is none.
            WrongForm: for names beside strengths by name.

        >>> simulation.set_strength(0.3, ['left_shin'])
        >>> simulation.set_strength({'left_shin': 0.3, 'head': 1.0})
        """
        if isinstance(strength, Mapping):
            if names is not None:
                raise errors.WrongForm('names', names, 'no names beside strengths by name')
        else:
            errors.check_range('strength', strength, 0.0, 1.0)
            if names is None or isinstance(names, str):
                names = self._angles_of(None if names is None else self._doll_index(names))
            strength = dict.fromkeys(names, strength)
        self._joint_springs.set_strengths(strength)

    @property
    def animated(self) -> tuple[str, ...]:
        """Names of the dolls that their animations move."""
        return tuple(self.scene.dolls[doll].name for doll in self._animations.dolls)

    @property
    def powered(self) -> tuple[str, ...]:
        """Names of the dolls that their animations, or springs on their joints, move."""
        bones = {spring.bone for spring in self._joint_springs.springs(self.time)}
        dolls = {*self._animations.dolls, *self.scene.doll_of_bone[list(bones)].tolist()}
        return tuple(self.scene.dolls[doll].name for doll in sorted(dolls))

    def go_limp(self, angles: str | Sequence[str] | None = None) -> None:
        """Let a doll go limp: end its animation, from which it falls with the pose and velocities
        of this instant, and remove the springs of its joint angles.

        Args:
            angles: the name of a doll; or names of joint angles, whose springs alone are removed;
                None: all dolls.

        Raises:
            UnknownDoll, UnknownJoint: the scene has none of this name.

        >>> simulation.go_limp(['left_shin'])
        >>> simulation.go_limp('doll')
        """
        if isinstance(angles, str):
            doll = self._doll_index(angles)
            self._release([doll], 'go_limp')
            angles = self._angles_of(doll)
        elif angles is None:
            self._release(self._animations.dolls, 'go_limp')
        self._joint_springs.go_limp(angles)

    def advance(self) -> State:
        """Integrate over one tick; returns the state at its end. Raises Closed after close().

        >>> simulation.advance().positions.shape
        (10, 3)
        """
        begin, substates = self.time, [self.state]
        self._clear_impacts()
        for sample in range(1, self._samples_per_tick + 1):
            end = begin + self.tick * sample // self._samples_per_tick
            if self.asleep and not self._pushes and not self._springs and not (
                    self._animations or (
                        self._follows and self._driven.moving_bones(self.time))):
                self.time = end
            while self.time < end:
                change = self._pushes.next_change(self.time) if self._pushes else None
                until = end if change is None else min(end, change)
                if self._follows:
                    until = min(until, self._driven.next_change(self.time, end))
                if self._animations:
                    until = min(until, self._animations.next_change(self.time, end))
                if self._joint_springs:
                    until = min(until, self._joint_springs.next_change(self.time, end))
                self._advance_until(until)
            substates.append(self.state)
        self.substates = tuple(substates)
        if self._pushes:
            self._pushes.drop_ended(self.time)
        self._put_to_sleep()
        if self._swings:
            self._swings.advance(self.time, self.state)
        return self.state

    def run(self, ticks: int) -> np.ndarray:
        """Advance by so many ticks; returns the rows (ticks, n, 13) of the states at their ends.

        Args:
            ticks: 0 or more.

        Raises:
            OutOfRange: ``ticks`` is negative.

        Example:
            >>> simulation.run(100)[-1, :, :3].shape  # positions after 1 s
            (10, 3)
        """
        errors.check_range('ticks', ticks, 0, MAX_TICKS)
        rows = np.empty((int(ticks), *self.state.rows.shape))
        for row in rows:
            row[:] = self.advance().rows
        return rows

    def place(self, coordinates: GeneralizedState) -> State:
        """Set pose and velocities of all dolls, for now and for later resets, and reset().

        Animations do not begin any more. With engine rigid, bones of a doll that overlap here and
        also as the doll is placed in the scene do not collide until they separate; other engines
        disable collision for good between those that overlap here by more than
        allowed_penetration(). A doll that is deeper in the ground than that is lifted onto it.
        Raises OutOfRange for lengths other than the scene's, NotFinite, NotUnit for orientations.

        >>> simulation.place(simulation.coordinates) is simulation.state
        True
        """
        layout = self._engine.layout
        q, v = np.array(coordinates.q, float), np.array(coordinates.v, float)
        if (q.shape, v.shape) != ((layout.sizes[0],), (layout.sizes[1],)):
            raise errors.OutOfRange('coordinates', (q.shape, v.shape), f'{layout.sizes} numbers')
        errors.check_finite('coordinates', (*q.tolist(), *v.tolist()))
        layout.check_orientations(q)
        self._placed, self._overlaps, self._plays = GeneralizedState(q, v), None, False
        for doll in self._animations.kinematic:
            self._engine.set_kinematic(doll, False)
        self._engine.set_coordinates(self._placed)
        self._engine.discard(self._start)
        self._start = self._engine.save()
        return self.reset()

    def set_state(self, doll: str, position: Sequence[float] | None = None,
                  orientation: Sequence[float] | None = None,
                  velocity: Sequence[float] | None = None, spin: Sequence[float] | None = None,
                  joint_angles: Mapping[str, float] | None = None,
                  joint_rates: Mapping[str, float] | None = None) -> State:
        """Set pose and velocities of a doll's root, joint angles and rates from now on; what is not
        given stays. An animated doll goes limp.

        Simulated time continues, and other dolls go on as before. The change of energy counts as
        work of pushes. A doll that would be deep in the ground is lifted onto it. Its bones that
        overlap at new angles do not collide until they separate; with other engines than rigid,
        never again. If it has swings, all swings restart at rest.

        Args:
            doll: name of its placement in the scene.
            position: (3,) m, of the root's centre of mass, world frame; None: as it is.
            orientation: quaternion x, y, z, w, world frame; None: as it is.
            velocity: (3,) m/s, of the root's centre of mass, world frame; None: as it is.
            spin: (3,) rad/s, world frame; None: as it is.
            joint_angles: rad, by the doll's own names of angles; others are as they are.
            joint_rates: rad/s, likewise.

        Raises:
            UnknownDoll, UnknownJoint: the scene has no such doll, or the doll no such angle.
            NotFinite, NotUnit, WrongForm, OutOfRange: for a vector or quaternion that is none, a
                position that is too far away, an angle outside its limits, the velocity of a root
                that is fixed, or a robot's link.

        >>> simulation.set_state('doll', velocity=(0, 0, 2)).linear_velocities[0].round(6).tolist()
        [0.0, 0.0, 2.0]
        """
        index, layout = self._doll_index(doll), self._engine.layout
        if (robot := self.scene.robot_of_body.get(doll)) is not None:
            raise errors.WrongForm('doll', doll, f'none: drive_body() moves the robot {robot}')
        for name, given in (('velocity', velocity), ('spin', spin)):
            if self.scene.dolls[index].fixed_root and given is not None and any(given):
                raise errors.WrongForm(name, given, f'none: the root of {doll} is fixed')
        self._release([index], 'set_state')
        here = self._engine.coordinates
        for values, own, name, given, checked in (
                (here.q, layout.root_positions, 'position', position, checked_point),
                (here.v, layout.root_velocities, 'velocity', velocity, finite_floats),
                (here.v, layout.root_angular_velocities, 'spin', spin, finite_floats)):
            if given is not None:
                values[own[index]] = checked(name, given)
        if orientation is not None:
            here.q[layout.root_orientations[index]] = unit_vector(
                'orientation', orientation, 'a quaternion x, y, z, w, not zero', 4)
        if joint_angles:
            here = GeneralizedState(layout.with_joint_angles(here.q, self._with_given(
                index, 'joint_angles', joint_angles, layout.joint_angles(here.q))), here.v)
        if joint_rates:
            here = GeneralizedState(here.q, layout.with_joint_rates(here, self._with_given(
                index, 'joint_rates', joint_rates, layout.joint_rates(here))))
        self._engine.set_doll(index, here)
        self._driven.hold(index, self.state, self.time)
        self._sleep_detector.restart(np.arange(len(self.scene.dolls)) == index)
        self.asleep = False
        if self._swings and self.scene.dolls[index].doll.swings:
            self._swings.reset(self.time, self.state)
        return self.state

    def add(self, placement: Placement) -> State:
        """Add a doll as it is placed; it is the last one of ``scene``, which is another object.

        Simulated time continues. Other dolls keep their states to the bit, and their pushes, grabs,
        joint springs and swings. The doll's energy is added to that at the start: energy_excess and
        work stay. reset() restores the start of the new scene. With two dolls or more, all bones
        and angles are named doll/bone. Only the rigid engine adds and removes dolls.

        Raises:
            DuplicateName: a doll or body of the scene has its name.
            WrongForm: the engine is not rigid.

        >>> simulation.add(Placement(load_doll('man'), 'man', (0, 2, 1))).positions.shape
        (26, 3)
        >>> simulation.remove('man').positions.shape
        (10, 3)
        """
        return self.carry_out(self.prepare_add([placement]))

    def remove(self, doll: str) -> State:
        """Remove a doll and all that acts on it. What it touched wakes; all others keep their
        states to the bit. Its energy is taken from that at the start: energy_excess and work stay.

        Raises:
            UnknownDoll: the scene has no such doll.
            WrongForm: it is the only doll, or a robot's link, or the engine is not rigid.
        """
        return self.carry_out(self.prepare_remove(doll))

    def prepare_add(self, placements: Sequence[Placement]) -> PreparedChange:
        """Prepare to add dolls, for carry_out(). This is most of the work, and may be done in
        another thread while the simulation advances. Raises what add() raises.
        """
        dolls = list(self.scene.dolls)
        for placement in placements:
            # Equal dolls share what is computed for them.
            doll = next((one.doll for one in dolls if one.doll == placement.doll), placement.doll)
            dolls.append(dataclasses.replace(placement, doll=doll))
        return self._prepare_dolls(dolls)

    def prepare_remove(self, doll: str) -> PreparedChange:
        """Prepare to remove a doll, as prepare_add(). Raises what remove() raises."""
        index = self._doll_index(doll)
        return self._prepare_dolls(self.scene.dolls[:index] + self.scene.dolls[index + 1:])

    def carry_out(self, prepared: PreparedChange) -> State:
        """Carry out a prepared change of dolls; those that stay keep their states to the bit.

        Raises:
            WrongForm: other dolls have come or gone since it was prepared.
        """
        if prepared.change.before is not self.scene:
            raise errors.WrongForm('prepared', 'for another scene', 'that of this scene')
        old, change = self._engine, prepared.change
        clusters, gone = old.cluster_of_doll, change.new_dolls < 0
        self._sleep_detector.restart(np.isin(clusters, clusters[gone]))
        self.scene, self._overlaps, self._placed = change.after, None, prepared.placed
        self._follows = any(placement.follow for placement in self.scene.dolls)
        self._engine, self._start = prepared.engine, prepared.start
        self._engine.continue_from(old, change)
        if self._impact_recorder is not None:
            dropped = self._impact_recorder.dropped
            self.record_impacts(self._impact_recorder.limits)
            self._impact_recorder.dropped = dropped
        old.close()
        self._carry_over(prepared)
        return self.state

    def checkpoint(self) -> tuple[int, object, object]:
        """Save time and state for go_back(); cheap enough for every tick."""
        return self.time, self._engine.checkpoint(), self._animations.save()

    def go_back(self, checkpoint: tuple[int, object, object]) -> State:
        """Restore a checkpoint; pushes and hands are kept, swings start at rest.

        A new engine is made, as a diverged state may have damaged the old one: a NaN stays in
        PyBullet's broad phase.
        """
        self.time, engine_checkpoint, animated = checkpoint
        accuracy = self.accuracy
        self._engine.close()
        self._engine = self._make_engine(accuracy)
        self._start = self._engine.save()
        self._engine.restore_checkpoint(engine_checkpoint)
        if self._impact_recorder is not None:
            self._engine.log_impacts(True)
        self._clear_impacts()
        self._driven.forget_twists()
        self._animations.go_back(animated, self._engine)
        self._sleep_detector.restart()
        self.asleep = bool(self._engine.sleeping.all())
        if self._swings:
            self._swings.reset(self.time, self.state)
        return self.state

    def reset(self, keep_time: bool = False) -> State:
        """Restore and return the initial state, to the bit. Ends all pushes, grabs and springs of
        hold(); motors and animations begin anew, the latter not after place().

        Args:
            keep_time: whether simulated time continues; else it is 0 again.

        >>> simulation.reset().positions.shape, simulation.time
        ((10, 3), 0)
        """
        self.reset_count += 1
        self._engine.restore(self._start)
        if not keep_time:
            self.time = 0
        self._clear_impacts()
        self.substates = (self.state,)
        self._pushes = PushQueue(self.scene)
        self._hands, self._joint_springs = Hands(self.scene), JointSprings(self.scene)
        self._driven = DrivenBodies(self.scene, self.state)
        self._animations = Animations(self.scene if self._plays else None, self.time)
        self._animations.restore(self._engine)
        self._sleep_detector.restart()
        self.asleep = False
        self._release(self._animations.due(self.time), 'limp_at')
        if self._swings:
            self._swings.reset(self.time, self.state)
        return self.state

    def measures(self) -> dict[str, float]:
        """Error measures and counters, of now or since the start; keys end in units. See
        docs/accuracy_explained.md.

        >>> simulation.measures()['joint_gap_m'] < 1e-3
        True
        """
        engine = self._engine
        return {
            **engine.measures(),
            'joint_gap_m': float(self._gap.gaps(self.state).max(initial=0.0)),
            'limit_overshoot_rad': max(0.0, float(
                engine.layout.limit_violations(self.coordinates.q).max(initial=0.0))),
            'sinking_m': max(0.0, -float(
                self._heights(self.state)[self._resting].min(initial=np.inf))),
            **({'stale_bodies': len(self.stale_bodies), 'body_jumps_total': self._driven.jumps}
               if self._follows else {}),
            'asleep': self.asleep}

    def ledger(self) -> dict[str, int]:
        """What the steps of engine rigid since the start are made of: counts of trials, of what was
        rejected, of contact solves, and cycles of the processor in each stage. See
        docs/performance.md; empty for other engines.
        """
        return self._engine.ledger()

    def close(self) -> None:
        """Release the engine; further calls do nothing."""
        capabilities = self._engine.capabilities
        self._engine.close()
        self._engine = cast(Engine, _ClosedEngine(capabilities))

    def _doll_index(self, doll: str) -> int:
        names = [placement.name for placement in self.scene.dolls]
        if doll not in names:
            raise errors.UnknownDoll('doll', doll, errors.one_of(names, doll))
        return names.index(doll)

    def _angles_of(self, doll: int | None) -> Sequence[str]:
        """Names of the joint angles of a doll; None: of all."""
        if doll is None:
            return self.scene.angle_names
        return self.scene.angle_names_of(self.scene.dolls[doll])

    def _with_given(self, doll: int, key: str, given: Mapping[str, float],
                    values: np.ndarray) -> np.ndarray:
        """Replace in ``values`` (k,), angles or rates of all dolls, those that are ``given`` for a
        doll by its own names; returns ``values``.
        """
        placement = self.scene.dolls[doll]
        names = self.scene.angle_names
        for name, value in checked_angles(placement.doll, key, given).items():
            values[names.index(self.scene.qualified(placement, name))] = value
        return values

    def _require(self, capability: Capability) -> None:
        """Raise WrongForm if the engine lacks a capability."""
        require(capability, self.capabilities, self.engine_name)

    def _make_engine(self, accuracy: Accuracy) -> Engine:
        """A new engine at the start of the scene."""
        engine: Engine = self._make(self.scene, accuracy)
        if self._placed is not None:
            engine.set_coordinates(self._placed)
        return engine

    def _prepare_dolls(self, dolls: Sequence[Placement]) -> PreparedChange:
        """Prepare a change of the dolls: an engine at the start of the scene after it."""
        self._require(Capability.SCENE_CHANGES)
        change = SceneChange(self.scene, dataclasses.replace(self.scene, dolls=tuple(dolls)))
        placed = self._placed
        if placed is not None or any(placement.is_posed for placement in dolls):
            placed = changed_coordinates(placed or placed_coordinates(self.scene.dolls), change)
        engine = self._engine.with_dolls(change.after)
        if placed is not None:
            engine.set_coordinates(placed)
        return PreparedChange(change, placed, engine, engine.save(), SleepDetector(change.after),
                              StabilityTest(change.after, engine.layout), _swings(change.after))

    def _carry_over(self, prepared: PreparedChange) -> None:
        """Let all that is beside the engine go on in the scene after a change."""
        change = prepared.change
        self.asleep, self.substates = bool(self._engine.sleeping.all()), (self.state,)
        self._pushes.change_scene(change)
        self._driven.change_scene(change, self.state)
        self._animations.change_scene(change, self.time)
        self._animations.restore(self._engine)
        self._hands.change_scene(change)
        self._joint_springs = self._joint_springs.changed(change)
        detector, self._sleep_detector = self._sleep_detector, prepared.sleep_detector
        self._sleep_detector.continue_from(detector, change)
        self._stability_test = prepared.stability_test
        for name in ('_gap', '_heights'):
            self.__dict__.pop(name, None)
        before, self._swings = self._swings, prepared.swings
        if self._swings and before:
            self._swings = before.changed(self._swings, change, self.time, self.state)
        elif self._swings:
            self._swings.reset(self.time, self.state)

    def _advance_until(self, end: int) -> None:
        """Integrate until ``end``, ns; no push begins or ends before."""
        if self._animations:
            self._animations.aim(self._joint_springs, self.time, end)
        loads: tuple[Wrenches, Springs, Drives] = (), self._springs, ()
        if self._follows:
            dolls, twists = self._driven.twists(self.time, end, self.state)
            if len(dolls):
                self._engine.set_twists(dolls, twists)
                self.asleep = False
            loads = (), loads[1], self._driven.drives(self.time, self.state,
                                                      self._engine.sleeping)
        if self._pushes:
            loads = (self._pushes.wrenches(self.time, self.state), loads[1],
                     [*loads[2], *self._pushes.drives(self.time)])
        if self._animations:
            self._release(self._animations.pushed(loads, self.state, self.scene.doll_of_bone),
                          'limp_above')
        if self._animations:
            self._animations.begin_interval(self._engine, self.time, end)
            self.asleep = False
        if any(loads):
            self.asleep = False
        if not self.asleep:
            duration = (end - self.time) / SECOND
            self._engine.advance(duration, *loads)
            if self._impact_recorder:
                self._impact_recorder.add(self._engine.impacts, self.time)
            self._hands.move(duration)
        self.time = end
        if self._animations:
            self._animations.end_interval(self._engine, end)
            self._release(self._animations.due(end), 'limp_at')

    def _release(self, dolls: Sequence[int], reason: str) -> None:
        """Let the animated ones of ``dolls`` go limp, and remove the springs of their joints."""
        animated = [doll for doll in dolls if doll in self._animations.dolls]
        if animated:
            self._animations.release(self._engine, animated, self.time)
            for doll in animated:
                self._joint_springs.go_limp(self._angles_of(doll))
            self._went_limp([self.scene.dolls[doll].name for doll in animated], reason)

    def _went_limp(self, dolls: Sequence[str], reason: str) -> None:
        """Called after dolls have gone limp, for LoggedSimulation."""

    def _clear_impacts(self) -> None:
        """Forget the impacts of the last tick."""
        if self._impact_recorder:
            self._impact_recorder.impacts.clear()

    def _recorded_impacts(self) -> ImpactRecorder:
        """The recorder of impacts. Raises WrongForm: there is none."""
        if self._impact_recorder is None:
            raise errors.WrongForm('impacts', 'not recorded',
                                   'record_impacts(load_limits()) before the tick')
        return self._impact_recorder

    def _put_to_sleep(self) -> None:
        """Put clusters to sleep that have been still for long enough and rest on the ground."""
        detector = self._sleep_detector
        driven = self._driven.moving_bones(self.time) if self._follows else []
        if self.asleep or not self.accuracy.sleep or detector.all_move(self._engine, driven):
            return
        loaded = (*self._pushes.bones(self.time), *(spring.bone for spring in self._springs),
                  *driven,
                  *(self.scene.bone_slices[doll].start for doll in self._animations.kinematic))
        dolls = detector.find_ready(self._engine, self.tick, loaded)
        if not np.count_nonzero(dolls):  # a tenth of what any() costs
            return
        if Capability.COPIES in self._engine.capabilities:
            dolls &= ~self._disturb_unstable(dolls)
        if dolls.any():
            self._engine.put_to_sleep(dolls)
            self.asleep = bool(self._engine.sleeping.all())

    def _disturb_unstable(self, dolls: np.ndarray) -> np.ndarray:
        """Which of ``dolls`` (d,) that are about to sleep do not rest in a stable equilibrium.
        Disturb those in an unstable one, and watch all of them. Clusters that were watched since an
        earlier test do rest.
        """
        engine, detector = self._engine, self._sleep_detector
        clusters = engine.cluster_of_doll
        untested = dolls & (np.bincount(clusters, ~detector.watched) > 0)[clusters]
        if not untested.any():
            return untested
        verdict = self._stability_test.judge(engine, untested, detector.max_kinetic)
        if verdict.departing.any():
            engine.set_velocities(verdict.departing, verdict.velocities)
        unstable = untested & ~verdict.stable
        detector.watch(unstable, self._stability_test.durations(clusters),
                       engine.doll_totals.kinetic)
        return unstable

    @property
    def _resting(self) -> np.ndarray:
        """(n,) bones that the ground bears: those that yield, but not of animated dolls without
        motors.
        """
        if not self._animations:
            return self.scene.yielding_bones
        animated = np.isin(self.scene.doll_of_bone, self._animations.kinematic)
        return self.scene.yielding_bones & ~animated

    @cached_property
    def _gap(self) -> JointGap:
        return JointGap(self.scene)

    @cached_property
    def _heights(self) -> GroundHeights:
        return GroundHeights(self.scene)

    @property
    def _springs(self) -> Springs:
        """Springs of hands and of joint angles."""
        return self._hands.springs + self._joint_springs.springs(self.time)


def _needed(scene: Scene) -> Iterator[Capability]:
    """Capabilities without which an engine would leave out a part of a scene."""
    if any(any(joint.passive) for placement in scene.dolls for joint in placement.doll.joints):
        yield Capability.PASSIVE_TORQUES
    if any(placement.follow for placement in scene.dolls):
        yield Capability.DRIVEN_BODIES
    if any(placement.fixed_root for placement in scene.dolls):
        yield Capability.FIXED_ROOTS
    if any(placement.motors for placement in scene.dolls):
        yield Capability.JOINT_SPRINGS
    shapes = itertools.chain((body.shape for body in scene.bodies),
                             (bone.shape for bone in scene.bones))
    if any(isinstance(shape, Surface) or has_hull(shape) for shape in shapes):
        yield Capability.SURFACES


def _swings(scene: Scene) -> SwingSimulation | None:
    """The swings of a scene, if it has any."""
    if not any(placement.doll.swings for placement in scene.dolls):
        return None
    # Imported here: its kernels are compiled, or loaded, for few scenes.
    from .swing.swings import SwingSimulation
    return SwingSimulation(scene)


class _ClosedEngine:
    """Replaces the engine after close()."""

    def __init__(self, capabilities: frozenset[Capability]) -> None:
        self.capabilities = capabilities

    def close(self) -> None:
        """Do nothing."""

    def __getattr__(self, name: str) -> object:
        raise errors.Closed('the simulation is closed: build another one')

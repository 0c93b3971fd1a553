"""LoggedSimulation reports each action as an event; apply_event repeats one.

An event has a name, mostly that of a Simulation method or property, and arguments as numbers,
texts, lists and mappings; that of ``add`` is a Placement. The event ``limp`` is for information and
not repeated. The caller of advance() counts the ticks between events. The same scene and the same
events at the same ticks give the same states to the bit. Event names are part of the log format:
they do not change with the names in the code.
"""
import dataclasses
import hashlib
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..model import errors
from ..model.coordinates import GeneralizedState
from ..model.drive import Drive
from ..model.push import Push
from ..model.scene import SECOND
from ..model.state import State
from .accuracy import Accuracy
from .actions.grab import DRAG_TIME
from .prepared_change import PreparedChange
from .simulation import Simulation


class LoggedSimulation(Simulation):
    """A Simulation that calls ``on_event(name, arguments)`` after each action."""

    on_event: Callable[[str, dict], object] = staticmethod(lambda name, arguments: None)

    @property
    def conditions(self) -> dict:
        """Engine, accuracy, tick in s, and samples per tick (event field ``parts``)."""
        return {'engine': self.engine_name, 'accuracy': dataclasses.asdict(self.accuracy),
                'step': self.step, 'parts': self.samples_per_tick}

    @Simulation.step.setter
    def step(self, step: float) -> None:
        Simulation.step.fset(self, step)
        self.on_event('step', {'step': self.step})

    @Simulation.samples_per_tick.setter
    def samples_per_tick(self, count: int) -> None:
        Simulation.samples_per_tick.fset(self, count)
        self.on_event('parts', {'parts': self.samples_per_tick})

    @Simulation.accuracy.setter
    def accuracy(self, accuracy: str | Accuracy) -> None:
        Simulation.accuracy.fset(self, accuracy)
        self.on_event('accuracy', dataclasses.asdict(self.accuracy))

    def push(self, push: Push | Drive, channel: str | None = None) -> None:
        super().push(push, channel)
        self.on_event('drive' if isinstance(push, Drive) else 'push',
                      {**vars(push), 'channel': channel})

    def release(self, channel: str) -> bool:
        ended = super().release(channel)
        if ended:
            self.on_event('release', {'channel': channel})
        return ended

    def drive_body(self, name: str, pose: Sequence[float] | None = None,
                   twist: Sequence[float] | None = None,
                   joint_angles: Mapping[str, float] | None = None,
                   rates: Mapping[str, float] | None = None) -> None:
        super().drive_body(name, pose, twist, joint_angles, rates)
        joints = {'joint_angles': joint_angles, 'rates': rates}
        self.on_event('drive_body', {
            'name': name, 'twist': None if twist is None else list(map(float, twist)),
            'pose': None if pose is None else list(map(float, pose)),
            **{key: {joint: float(value) for joint, value in values.items()}
               for key, values in joints.items() if values is not None}})

    def grab(self, hand: str, bone: str, point: Sequence[float] = (0.0, 0.0, 0.0),
             target: Sequence[float] | None = None) -> None:
        super().grab(hand, bone, point, target)
        self.on_event('grab', {'hand': hand, 'bone': bone, 'point': list(map(float, point)),
                               'target': None if target is None else list(map(float, target))})

    def drag(self, hand: str, target: Sequence[float], within: float = DRAG_TIME) -> None:
        super().drag(hand, target, within)
        self.on_event('drag', {'hand': hand, 'target': list(map(float, target)), 'within': within})

    def let_go(self, hand: str) -> None:
        super().let_go(hand)
        self.on_event('let_go', {'hand': hand})

    def hold(self, angle: str, stiffness: float, damping: float = 0.0,
             target: float | None = None, max_torque: float = math.inf) -> None:
        super().hold(angle, stiffness, damping, target, max_torque)
        self.on_event('hold', {'angle': angle, 'stiffness': float(stiffness),
                               'damping': float(damping),
                               'target': None if target is None else float(target),
                               **({} if math.isinf(max_torque)
                                  else {'max_torque': float(max_torque)})})

    def set_pose_target(self, joint_angles: Mapping[str, float] | None = None,
                        rates: Mapping[str, float] | None = None) -> None:
        super().set_pose_target(joint_angles, rates)
        given = {'joint_angles': joint_angles, 'rates': rates}
        self.on_event('set_pose_target', {
            key: {name: float(value) for name, value in values.items()}
            for key, values in given.items() if values})

    def set_strength(self, strength: float | Mapping[str, float],
                     names: str | Sequence[str] | None = None) -> None:
        super().set_strength(strength, names)
        self.on_event('set_strength', {
            'strength': ({name: float(value) for name, value in strength.items()}
                         if isinstance(strength, Mapping) else float(strength)),
            'names': names if names is None or isinstance(names, str) else list(names)})

    def go_limp(self, angles: str | Sequence[str] | None = None) -> None:
        super().go_limp(angles)
        self.on_event('go_limp', {'angles': angles if angles is None or isinstance(angles, str)
                                  else list(angles)})

    def _went_limp(self, dolls: Sequence[str], reason: str) -> None:
        # For information: what a scene and its actions say happens again by itself.
        self.on_event('limp', {'dolls': list(dolls), 'time': self.time / SECOND, 'reason': reason})

    def place(self, coordinates: GeneralizedState) -> State:
        # place() includes a reset(), which is no event of its own.
        on_event, self.on_event = self.on_event, LoggedSimulation.on_event
        try:
            state = super().place(coordinates)
        finally:
            self.on_event = on_event
        self.on_event('place', {key: list(map(float, value))
                                for key, value in vars(coordinates).items()})
        return state

    def set_state(self, doll: str, position: Sequence[float] | None = None,
                  orientation: Sequence[float] | None = None,
                  velocity: Sequence[float] | None = None, spin: Sequence[float] | None = None,
                  joint_angles: Mapping[str, float] | None = None,
                  joint_rates: Mapping[str, float] | None = None) -> State:
        given = {'position': position, 'orientation': orientation, 'velocity': velocity,
                 'spin': spin}
        joints = {'joint_angles': joint_angles, 'joint_rates': joint_rates}
        state = super().set_state(doll, **given, **joints)
        self.on_event('set_state', {
            'doll': doll,
            **{key: list(map(float, values)) for key, values in given.items()
               if values is not None},
            **{key: {name: float(value) for name, value in values.items()}
               for key, values in joints.items() if values}})
        return state

    def carry_out(self, prepared: PreparedChange) -> State:
        state, change = super().carry_out(prepared), prepared.change
        for placement, doll in zip(change.before.dolls, change.new_dolls, strict=True):
            if doll < 0:
                self.on_event('remove', {'doll': placement.name})
        for placement, doll in zip(change.after.dolls, change.old_dolls, strict=True):
            if doll < 0:
                # That of the scene: its doll may be one that others share.
                self.on_event('add', {'placement': placement})
        return state

    def reset(self, keep_time: bool = False) -> State:
        state = super().reset(keep_time)
        self.on_event('reset', {**self.conditions, **({'keep_time': True} if keep_time else {})})
        return state

    def go_back(self, checkpoint: tuple[int, object]) -> State:
        # No tick lies between the checkpoint and now: apply_event restores the current state.
        state = super().go_back(checkpoint)
        self.on_event('go_back', {})
        return state


def apply_event(simulation: Simulation, name: str, arguments: dict) -> None:
    """Repeat a logged action. Raises WrongForm for an unknown event or wrong arguments, else what
    the action raises.
    """
    try:
        _ACTIONS[name](simulation, **arguments)
    except errors.RagdollError:
        raise
    except (KeyError, TypeError, ValueError):
        raise errors.WrongForm(name, arguments, 'an event: ' + ', '.join(_ACTIONS)) from None


def accuracy_from(fields: dict) -> Accuracy:
    """Accuracy from its fields in an event; raises a ModelError for wrong fields."""
    try:
        accuracy = Accuracy(**fields)
        errors.check_positive('accuracy', (accuracy.step, accuracy.flight_error, accuracy.substeps,
                                           accuracy.solve_error))
    except TypeError:
        names = [field.name for field in dataclasses.fields(Accuracy)]
        raise errors.WrongForm('accuracy', fields, 'numbers: ' + ', '.join(names)) from None
    return accuracy


def state_digest(state: State) -> str:
    """SHA-256 of a state's rows (n, 13): little-endian float64, bone by bone."""
    return hashlib.sha256(np.ascontiguousarray(state.rows, '<f8')).hexdigest()


def _call_of(method: str) -> Callable[..., object]:
    """Make a function that calls a method of Simulation with the arguments of an event."""
    def call(simulation: Simulation, **arguments: object) -> object:
        return getattr(simulation, method)(**arguments)
    return call


_ACTIONS: dict[str, Callable[..., object]] = {
    'push': lambda simulation, channel, **push: simulation.push(Push(**push), channel),
    'drive': lambda simulation, channel, **drive: simulation.push(Drive(**drive), channel),
    **{name: _call_of(name) for name in (
        'release', 'grab', 'drag', 'let_go', 'hold', 'set_pose_target', 'set_strength', 'go_limp',
        'set_state', 'drive_body', 'add', 'remove')},
    'step': lambda simulation, step: setattr(simulation, 'step', step),
    'parts': lambda simulation, parts: setattr(simulation, 'samples_per_tick', parts),
    'accuracy': lambda simulation, **fields: setattr(simulation, 'accuracy', accuracy_from(fields)),
    'place': lambda simulation, q, v: simulation.place(GeneralizedState(np.array(q), np.array(v))),
    'go_back': lambda simulation: simulation.go_back(simulation.checkpoint()),
    # The other fields of 'reset' are the conditions, for readers that start there.
    'reset': lambda simulation, keep_time=False, **_: simulation.reset(keep_time)}

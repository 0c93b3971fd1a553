"""The node's parameters: declared with description and range, checked, changed live."""
from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, fields

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..files.scene import load_scene
from ..model import errors
from ..model.drive import FORCE_PER_SPEED, TORQUE_PER_SPEED
from ..model.errors import RagdollError
from ..model.ragdoll import WORLD
from ..model.scene import STEP_RANGE, Scene
from ..physics.accuracy import ACCURACIES
from ..physics.engine.registry import ENGINES, check_engine
from ..physics.logged_simulation import LoggedSimulation
from ..physics.sensors.imu import ImuErrors
from ..physics.simulation import MAX_WORKERS
from .imu_parameters import check_worn
from .messages.tf import TREES
from .written import as_numbers, unknown


def _setting(default: object, description: str, span: tuple[float, float] | None = None,
             constraints: str = '', scene_default: Callable | None = None) -> object:
    """A parameter; ``scene_default`` takes its default from the scene, where a scene has one."""
    return dataclasses.field(default=default, metadata={
        'description': description, 'span': span, 'constraints': constraints,
        'scene_default': scene_default})


@dataclass(frozen=True)
class Settings:
    """Values of all parameters that can be set."""

    scene: str = _setting(
        'drop', 'Scene to simulate: a name in config/ or a path; a doll stands above the ground',
        constraints='a file, or the name of a shipped one; set again, it is read again')
    rate: float = _setting(
        100.0, 'Ticks, and messages, in a second of simulated time, Hz',
        (1 / STEP_RANGE[1], 1 / STEP_RANGE[0]), scene_default=lambda scene: 1 / scene.step)
    real_time_factor: float = _setting(
        1.0, 'Seconds simulated in each second on the wall', (0.001, 100.0),
        scene_default=lambda scene: min(max(scene.pace, 0.001), 100.0))
    start_paused: bool = _setting(
        False, 'Stand at the start, paused, until ~/pause lets the doll go')
    pushed_bone: str = _setting(
        '', 'Bone that ~/force and cmd_vel push', constraints='one of bone_names',
        scene_default=lambda scene: scene.qualified(scene.dolls[0], scene.dolls[0].doll.root.name))
    push_timeout: float = _setting(
        0.1, 'Simulated time that a push lasts unless the next one comes first, s', (0.001, 60.0))
    cmd_vel_timeout: float = _setting(
        0.6, 'Simulated time that a message on cmd_vel lasts, s', (0.001, 60.0))
    force_per_speed: float = _setting(
        FORCE_PER_SPEED, 'Force for each m/s that the pushed bone lacks of cmd_vel, N/(m/s)',
        (0.0, 1e5))
    torque_per_speed: float = _setting(
        TORQUE_PER_SPEED, 'Torque for each rad/s that it lacks, N m/(rad/s)', (0.0, 1e4))
    max_force: float = _setting(
        10000.0, 'Longest force, N, and ten times the longest torque, N m; longer is clamped',
        (0.0, 1e5))
    frame_id: str = _setting(WORLD, 'Name of the world frame in all messages',
                             constraints='no bone of bone_names, no slash at its beginning')
    publish_clock: bool = _setting(False, 'Publish simulated time on /clock and stamp by it')
    publish_tf: str = _setting('all', 'Frames on /tf: of all links, of the roots alone, or none',
                               constraints='one of ' + ', '.join(TREES))
    dump_directory: str = _setting(
        '', 'Directory for the states before one that could not be; empty: where ROS has its logs')
    accuracy: str = _setting('normal', 'How finely to simulate',
                             constraints='one of ' + ', '.join(ACCURACIES))
    engine: str = _setting('auto', 'What simulates; another one starts anew',
                           constraints='one of ' + ', '.join(ENGINES))
    workers: int = _setting(
        1, 'Threads over which dolls are spread that do not touch, 0: as many as there are cores; '
        'another number starts anew', (0, MAX_WORKERS))
    imus: tuple[str, ...] = _setting(
        ('',), "Bones that wear an inertial sensor, each heard on ~/imu/<bone>/data_raw: 'bone', "
        "'bone x y z' (m from its centre of mass along its axes) or 'bone x y z roll pitch yaw' "
        '(rad)', constraints='bones of bone_names; an empty text is none')
    imu_rate: float = _setting(
        100.0, 'Samples of each inertial sensor in a second of simulated time, Hz', (1.0, 1000.0),
        constraints='a multiple of rate, where there are imus')
    imu_noise_acceleration: float = _setting(
        0.0, "Standard deviation of a sample's specific force, m/s^2", (0.0, 1000.0))
    imu_noise_rate: float = _setting(
        0.0, "Standard deviation of a sample's angular rate, rad/s", (0.0, 1000.0))
    imu_bias: tuple[float, ...] = _setting(
        (0.0,) * 6, 'Added to each sample: x, y, z, m/s^2, and x, y, z, rad/s',
        constraints='6 numbers')
    imu_range: tuple[float, ...] = _setting(
        (0.0, 0.0), 'Where samples are clipped: m/s^2 and rad/s; 0: nowhere',
        constraints='2 numbers, zero or above')
    imu_seed: int = _setting(
        0, "Of the sensors' noise: the same seed, the same noise", (0, 2 ** 31 - 1))

    @property
    def imu_flaws(self) -> ImuErrors:
        """What each sensor adds. Raises a ModelError for what can not be."""
        try:
            return ImuErrors(self.imu_noise_acceleration, self.imu_noise_rate, self.imu_bias,
                         self.imu_range)
        except errors.ModelError as error:
            raise type(error)(f'imu_{error.path}', error.value, error.expected) from None


SPECS = {field.name: field for field in fields(Settings)}
REAL = {name for name, field in SPECS.items() if isinstance(field.default, float)}
BONE_NAMES = 'bone_names'


class WrongParameters(RagdollError):
    """Start values that cannot be."""


class Parameters:
    """Declares the parameters and keeps ``settings`` equal to them.

    ``overrides``: the start values that the node was given, by name.

    A change is first prepared by ``prepare(changed, settings, scene)``, which may raise a
    RagdollError with the reason to refuse it, and then carried out by ``apply(changed)``. A new
    scene brings its own rate, pace and pushed bone, except for those that were set otherwise.
    """

    def __init__(self, node: Node, overrides: dict[str, Parameter]) -> None:
        self._node = node
        self.settings = Settings()
        overrides.update((given.name, given) for given in as_numbers(overrides.values(), REAL))
        found: list[str] = []
        self._declare('scene', found)
        self.scene = load_scene(self.settings.scene)
        for name, default in scene_defaults(self.scene).items():
            self.settings = dataclasses.replace(self.settings, **{name: default})
        for name in SPECS:
            if name != 'scene':
                self._declare(name, found)
        try:
            check(self.settings, self.scene)
        except RagdollError as error:
            found.append(str(error))
        if found:
            raise WrongParameters('\n'.join(found))
        self._bone_names = ParameterDescriptor(
            description='Names of all bones, in the order of ~/poses', read_only=True)
        # What a dump of another scene's parameters brings along would not be true.
        node.declare_parameter(BONE_NAMES, list(self.scene.bone_names), self._bone_names,
                               ignore_override=True)
        declared = [name for name in overrides if node.has_parameter(name)]
        for sentence in unknown(overrides, {*SPECS, *declared}):
            node.get_logger().warning(sentence)

    def watch(self, prepare: Callable[[set[str], Settings, Scene], None],
              apply: Callable[[set[str]], None]) -> None:
        """From now on let changes through."""
        self._prepare, self._apply = prepare, apply
        self._node.add_pre_set_parameters_callback(lambda given: as_numbers(given, REAL))
        self._node.add_on_set_parameters_callback(self._on_set)
        self._node.add_post_set_parameters_callback(self._after_set)

    def stands(self, parameter: Parameter) -> bool:
        """Whether it is read-only and has this value: a dump holds all, and is set as a whole."""
        node, name = self._node, parameter.name
        return (node.has_parameter(name) and node.describe_parameter(name).read_only
                and node.get_parameter(name).value == parameter.value)

    def _declare(self, name: str, found: list[str]) -> None:
        """Declare a parameter and take its start value; a wrong one is noted in ``found``."""
        spec, value = SPECS[name], getattr(self.settings, name)
        try:
            value = self._node.declare_parameter(name, value, _descriptor(spec)).value
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            found.append(f'{name}: {error}')
        self.settings = dataclasses.replace(self.settings, **{name: _plain(value)})

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        given = _given(parameters)
        try:
            scene = load_scene(given['scene']) if 'scene' in given else self.scene
            settings = dataclasses.replace(self.settings, **{**self._followed(scene), **given})
            check(settings, scene)
            changed = self._changed(given, settings)
            self._prepare(changed, settings, scene)
        except RagdollError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self._next = (changed, settings, scene)
        return SetParametersResult(successful=True)

    def _after_set(self, parameters: list[Parameter]) -> None:
        changed, self.settings, self.scene = self._next
        if not changed:
            return
        self._apply(changed)
        self._node.set_parameters([Parameter(name, value=getattr(self.settings, name))
                                   for name in changed - set(_given(parameters))])
        if 'scene' in changed:
            self._set_bone_names()

    def _changed(self, given: dict, settings: Settings) -> set[str]:
        """Names of what becomes different; a scene that is set again is read again."""
        changed = {name for name in SPECS
                   if getattr(settings, name) != getattr(self.settings, name)}
        return changed | ({'scene'} & set(given))

    def _followed(self, scene: Scene) -> dict:
        """The scene's defaults for what still is at the default of the scene before."""
        before = scene_defaults(self.scene)
        return {name: value for name, value in scene_defaults(scene).items()
                if getattr(self.settings, name) == before[name]}

    def _set_bone_names(self) -> None:
        """Change the read-only parameter, as only the node may."""
        descriptor = self._node.describe_parameter(BONE_NAMES)
        descriptor.read_only = False
        self._node.set_parameters([Parameter(
            BONE_NAMES, Parameter.Type.STRING_ARRAY, list(self.scene.bone_names))])
        descriptor.read_only = True


def scene_defaults(scene: Scene) -> dict:
    """The defaults that are a scene's, by parameter."""
    return {name: spec.metadata['scene_default'](scene) for name, spec in SPECS.items()
            if spec.metadata['scene_default']}


def check(settings: Settings, scene: Scene) -> None:
    """Raise a RagdollError for what no range can tell."""
    if settings.accuracy not in ACCURACIES:
        raise errors.OutOfRange('accuracy', settings.accuracy, 'one of ' + ', '.join(ACCURACIES))
    if settings.publish_tf not in TREES:
        raise errors.OutOfRange('publish_tf', settings.publish_tf, 'one of ' + ', '.join(TREES))
    check_engine(settings.engine)
    names = scene.bone_names
    if settings.pushed_bone not in names:
        raise errors.UnknownBone('pushed_bone', settings.pushed_bone,
                                 errors.one_of(names, settings.pushed_bone))
    frame = settings.frame_id
    if not frame or frame.startswith('/'):
        raise errors.OutOfRange('frame_id', frame, 'a name without a slash at its beginning')
    if frame in names:
        raise errors.DuplicateName('frame_id', frame, 'a name that no bone bears')
    settings.imu_flaws  # noqa: B018 - raises for what can not be
    check_worn(settings.imus, names)
    parts = settings.imu_rate / settings.rate
    if any(settings.imus) and (parts < 1 - 1e-9 or abs(parts / round(parts) - 1) > 1e-9):
        raise errors.OutOfRange('imu_rate', settings.imu_rate,
                                f'a multiple of rate, {settings.rate:g}')


def step_of(settings: Settings) -> float:
    """Tick in s; a rate that is at its range's end but for rounding gives the step's end."""
    return min(max(1 / settings.rate, STEP_RANGE[0]), STEP_RANGE[1])


def parts_of(settings: Settings) -> int:
    """Parts that a tick is gone in for the sensors' samples."""
    return round(settings.imu_rate / settings.rate) if any(settings.imus) else 1


def make_simulation(scene: Scene, settings: Settings) -> LoggedSimulation:
    """Build the simulation that the settings ask for."""
    simulation = LoggedSimulation(scene, step_of(settings), settings.accuracy, settings.engine,
                                    settings.workers or 'auto')
    simulation.samples_per_tick = parts_of(settings)
    return simulation


def _given(parameters: list[Parameter]) -> dict:
    return {parameter.name: _plain(parameter.value) for parameter in parameters
            if parameter.name in SPECS}


def _plain(value: object) -> object:
    """A value as Settings have it: rclpy gives lists and arrays."""
    return value if isinstance(value, (str, bool, int, float)) else tuple(value)


def _descriptor(spec: dataclasses.Field) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=spec.metadata['description'],
                                     additional_constraints=spec.metadata['constraints'])
    if spec.metadata['span']:
        lower, upper = spec.metadata['span']
        if isinstance(spec.default, int):
            descriptor.integer_range = [IntegerRange(from_value=lower, to_value=upper, step=1)]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(lower), to_value=float(upper))]
    return descriptor

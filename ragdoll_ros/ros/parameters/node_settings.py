"""Parameter table of the node: names, defaults, descriptions, ranges and validation."""
from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields

from ...files.limits import DEFAULT_LIMITS, load_limits
from ...model import errors
from ...model.drive import FORCE_PER_SPEED, TORQUE_PER_SPEED
from ...model.ragdoll import WORLD
from ...model.scene import STEP_RANGE, Scene
from ...physics.accuracy import ACCURACIES
from ...physics.engine.registry import ENGINES, check_engine
from ...physics.sensors.imu import ImuErrors
from ...physics.sensors.response import RANGES, ImuResponse
from ...physics.simulation import MAX_WORKERS
from ..imu.imu_parameters import check_imus
from ..messages.tf import PUBLISH_TF
from .body_frames import parse_body_frames


def _parameter(default: object, description: str, limits: tuple[float, float] | None = None,
               constraints: str = '', scene_default: Callable | None = None) -> object:
    """A parameter; ``scene_default(scene)`` returns the default of a scene that has its own."""
    return dataclasses.field(default=default, metadata={
        'description': description, 'range': limits, 'constraints': constraints,
        'scene_default': scene_default})


@dataclass(frozen=True)
class NodeSettings:
    """Values of all parameters that can be set; see the descriptions."""

    scene: str = _parameter(
        'drop', 'Scene to simulate: a name in config/ or a path; a doll is put above the ground',
        constraints='a file or the name of a shipped one; setting it again reloads it')
    rate: float = _parameter(
        100.0, 'Ticks and messages per second of simulated time, Hz',
        (1 / STEP_RANGE[1], 1 / STEP_RANGE[0]), scene_default=lambda scene: 1 / scene.step)
    real_time_factor: float = _parameter(
        1.0, 'Simulated time per wall time', (0.001, 100.0),
        scene_default=lambda scene: min(max(scene.pace, 0.001), 100.0))
    start_paused: bool = _parameter(False, 'Start paused, until ~/pause resumes')
    pushed_bone: str = _parameter(
        '', 'Bone that ~/force, cmd_vel and ~/push in the world frame push',
        constraints='one of bone_names',
        scene_default=lambda scene: scene.first_pushed_bone)
    push_timeout: float = _parameter(
        0.1, 'Simulated time that a push acts unless the next one comes first, s', (0.001, 60.0))
    cmd_vel_timeout: float = _parameter(
        0.6, 'Simulated time that a message on cmd_vel acts, s', (0.001, 60.0))
    stamped_cmd_vel: bool = _parameter(
        False, "Take TwistStamped on cmd_vel, Nav2's default since Kilted, instead of Twist")
    force_per_speed: float = _parameter(
        FORCE_PER_SPEED, 'Force per velocity error of the pushed bone to cmd_vel, N/(m/s)',
        (0.0, 1e5))
    torque_per_speed: float = _parameter(
        TORQUE_PER_SPEED, 'Torque per angular velocity error, N m/(rad/s)', (0.0, 1e4))
    max_force: float = _parameter(
        10000.0, 'Largest force, N; the largest torque is 0.1 m times that; input is clamped',
        (0.0, 1e5))
    frame_id: str = _parameter(WORLD, 'Name of the world frame in all messages',
                               constraints='not in bone_names, no leading slash')
    publish_clock: bool = _parameter(
        False, 'Publish simulated time on /clock and stamp messages with it')
    publish_tf: str = _parameter(
        'all', 'Frames on /tf: of all links, of the root links only, or none',
        constraints='one of ' + ', '.join(PUBLISH_TF))
    dump_directory: str = _parameter(
        '', "Directory for dumps of the states before a bad one; empty: ROS's log directory")
    accuracy: str = _parameter('normal', 'Accuracy of the simulation',
                               constraints='one of ' + ', '.join(ACCURACIES))
    engine: str = _parameter('auto', 'Physics engine; a change restarts the scene',
                             constraints='one of ' + ', '.join(ENGINES))
    workers: int = _parameter(
        1, 'Threads for dolls that do not touch, 0: one per core; a change restarts the scene',
        (0, MAX_WORKERS))
    impact_limits: str = _parameter(
        DEFAULT_LIMITS, 'Limits to which ~/impacts compares: a name in config/limits/ or a path',
        constraints='a file or the name of a shipped one')
    impact_marker_lifetime: float = _parameter(
        2.0, 'Time for which RViz shows a marker of ~/impacts/markers, s', (0.01, 3600.0))
    body_frames: tuple[str, ...] = _parameter(
        ('',), "Frames of /tf that move bodies with follow, or robots: each 'body frame'",
        constraints='driven bodies of the scene; an empty string is none')
    imus: tuple[str, ...] = _parameter(
        ('',), 'Bones with an inertial sensor, each published on ~/imu/<bone>/data_raw: '
        "'bone', 'bone x y z' (m from its centre of mass, bone frame) or "
        "'bone x y z roll pitch yaw' (rad)",
        constraints='bones of bone_names; an empty string is none')
    imu_rate: float = _parameter(
        100.0, 'Samples of each inertial sensor per second of simulated time, Hz', (1.0, 1000.0),
        constraints='a multiple of rate, where there are imus')
    imu_mount_frequency: float = _parameter(
        0.0, 'Natural frequency of each inertial sensor on soft tissue, Hz; 0: rigid on the bone',
        RANGES['mount_frequency'])
    imu_mount_damping: float = _parameter(
        ImuResponse.mount_damping, 'Damping ratio of that mount', RANGES['mount_damping'])
    imu_bandwidth: float = _parameter(
        0.0, "-3 dB frequency of each inertial sensor's low-pass filter of order 2, Hz; 0: none",
        RANGES['bandwidth'])
    imu_noise_acceleration: float = _parameter(
        0.0, "Standard deviation of a sample's specific force, m/s^2", (0.0, 1000.0))
    imu_noise_rate: float = _parameter(
        0.0, "Standard deviation of a sample's angular rate, rad/s", (0.0, 1000.0))
    imu_bias: tuple[float, ...] = _parameter(
        (0.0,) * 6, 'Bias of each sample: x, y, z, m/s^2, and x, y, z, rad/s',
        constraints='6 numbers')
    imu_range: tuple[float, ...] = _parameter(
        (0.0, 0.0), 'Limits at which samples saturate: m/s^2 and rad/s; 0: unlimited',
        constraints='2 numbers, zero or above')
    imu_seed: int = _parameter(0, "Seed of the sensors' noise", (0, 2 ** 31 - 1))

    @property
    def step(self) -> float:
        """Length of a tick, s, clipped to STEP_RANGE against rounding of the rate."""
        return min(max(1 / self.rate, STEP_RANGE[0]), STEP_RANGE[1])

    @property
    def samples_per_tick(self) -> int:
        """Samples of the inertial sensors in a tick; 1 without sensors."""
        return round(self.imu_rate / self.rate) if any(self.imus) else 1

    @property
    def imu_flaws(self) -> ImuErrors:
        """Noise, bias and range of each sensor. Raises a ModelError for invalid ones."""
        try:
            return ImuErrors(self.imu_noise_acceleration, self.imu_noise_rate, self.imu_bias,
                         self.imu_range)
        except errors.ModelError as error:
            raise type(error)(f'imu_{error.path}', error.value, error.expected) from None

    @property
    def imu_response(self) -> ImuResponse:
        """Soft mount and low-pass filter of each sensor; the descriptors limit their values."""
        return ImuResponse(self.imu_mount_frequency, self.imu_mount_damping, self.imu_bandwidth)


SPECS = {field.name: field for field in fields(NodeSettings)}
"""Dataclass field of each parameter; its metadata has the parts of the descriptor."""

BONE_NAMES = 'bone_names'


def scene_defaults(scene: Scene) -> dict:
    """Defaults that come from the scene, by parameter."""
    return {name: spec.metadata['scene_default'](scene) for name, spec in SPECS.items()
            if spec.metadata['scene_default']}


class InvalidSettings(errors.RagdollError):
    """Several values that are not valid."""


def check(settings: NodeSettings, scene: Scene) -> None:
    """Raise a RagdollError with all invalid values, except those outside a descriptor's range,
    which rclpy refuses.
    """
    found = [*_wrong_words(settings), *_wrong_names(settings, scene), *_wrong_sensors(settings,
                                                                                   scene)]
    if len(found) == 1:
        raise found[0]
    if found:
        raise InvalidSettings('\n'.join(map(str, found)))


def _wrong_words(settings: NodeSettings) -> Iterator[errors.RagdollError]:
    for name, words in (('accuracy', ACCURACIES), ('publish_tf', PUBLISH_TF)):
        if getattr(settings, name) not in words:
            yield errors.OutOfRange(name, getattr(settings, name), 'one of ' + ', '.join(words))
    yield from _raised(lambda: check_engine(settings.engine))
    yield from _raised(lambda: load_limits(settings.impact_limits))


def _wrong_names(settings: NodeSettings, scene: Scene) -> Iterator[errors.RagdollError]:
    names, frame = scene.bone_names, settings.frame_id
    if settings.pushed_bone not in names:
        yield errors.UnknownBone('pushed_bone', settings.pushed_bone,
                                 errors.one_of(names, settings.pushed_bone))
    if not frame or frame.startswith('/'):
        yield errors.OutOfRange('frame_id', frame, 'a name without a leading slash')
    if frame in names:
        yield errors.DuplicateName('frame_id', frame, 'a name that is no bone')


def _wrong_sensors(settings: NodeSettings, scene: Scene) -> Iterator[errors.RagdollError]:
    yield from _raised(lambda: settings.imu_flaws)
    yield from _raised(lambda: check_imus(settings.imus, scene.bone_names))
    yield from _raised(lambda: parse_body_frames(settings.body_frames, scene))
    samples = settings.imu_rate / settings.rate
    if any(settings.imus) and (samples < 1 - 1e-9 or abs(samples / round(samples) - 1) > 1e-9):
        yield errors.OutOfRange('imu_rate', settings.imu_rate,
                                f'a multiple of rate, {settings.rate:g}')


def _raised(checked: Callable[[], object]) -> Iterator[errors.RagdollError]:
    """The error that a check raises, if it raises one."""
    try:
        checked()
    except errors.RagdollError as error:
        yield error

"""The node's parameters: declared, validated, changed at run time; values: node_settings.py."""
from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Callable, Collection, Iterable

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ...files.scene import load_scene
from ...model.errors import RagdollError
from ...model.scene import Scene
from ...model.scene_change import SceneChange
from ...physics.logged_simulation import LoggedSimulation
from ..imu.imu_parameters import renamed_imus
from .body_frames import kept_body_frames
from .node_settings import BONE_NAMES, SPECS, NodeSettings, check, scene_defaults

DOUBLES = {name for name, field in SPECS.items() if isinstance(field.default, float)}
"""Parameters of type double."""

QOS_OVERRIDES = 'qos_overrides.'
"""Prefix of the parameters that rclpy declares for QoS overrides."""

MIN_SIMILARITY = 0.7
"""Similarity ratio, of 1, of an unknown name to a known one above which that is suggested."""


class InvalidParameters(RagdollError):
    """Parameter overrides that are not valid."""


class Parameters:
    """Declares the parameters and keeps ``settings`` equal to them.

    ``overrides``: the parameter overrides of the node, by name.

    A change is prepared by ``prepare(changed, settings, scene)``, which may raise a RagdollError
    with the reason for a refusal, and then carried out by ``apply(changed)``. A new scene sets
    rate, real-time factor and pushed bone, unless they differ from the last scene's.
    """

    def __init__(self, node: Node, overrides: dict[str, Parameter]) -> None:
        self._node = node
        self.settings = NodeSettings()
        overrides.update((given.name, given) for given in as_doubles(overrides.values()))
        found: list[str] = []
        self._declare('scene', found)
        broken = self._load_scene()
        for name, default in scene_defaults(self.scene).items():
            self.settings = dataclasses.replace(self.settings, **{name: default})
        for name in SPECS:
            if name != 'scene':
                self._declare(name, found)
        try:
            check(self.settings, self.scene)
        except RagdollError as error:
            if not broken:
                found.append(str(error))
        if broken and not found:
            raise broken
        if found:
            raise InvalidParameters('\n'.join([*map(str, filter(None, [broken])), *found]))
        # An override, as in a dump of another scene's parameters, would be wrong.
        node.declare_parameter(BONE_NAMES, list(self.scene.bone_names), ParameterDescriptor(
            description='Names of all bones, in the order of ~/poses', read_only=True),
            ignore_override=True)
        declared = [name for name in overrides if node.has_parameter(name)]
        for warning in unknown_parameters(overrides, {*SPECS, *declared}):
            node.get_logger().warning(warning)

    def add_callbacks(self, load: Callable[[str], Scene],
                      prepare: Callable[[set[str], NodeSettings, Scene], None],
                      apply: Callable[[set[str]], None]) -> None:
        """Register the callbacks that let changes through from now on."""
        self._load, self._prepare, self._apply = load, prepare, apply
        self._node.add_pre_set_parameters_callback(as_doubles)
        self._node.add_on_set_parameters_callback(self._on_set)
        self._node.add_post_set_parameters_callback(self._after_set)

    def follow(self, change: SceneChange) -> None:
        """Take the scene after a change of its dolls. Sensors and the pushed bone stay on their
        bones, under their new names; entries of what is gone are left out.
        """
        names, self.scene = change.bone_names, change.after
        named = {'pushed_bone': names.get(self.settings.pushed_bone)
                 or scene_defaults(change.after)['pushed_bone'],
                 'imus': renamed_imus(self.settings.imus, change),
                 'body_frames': kept_body_frames(self.settings.body_frames, change.after)}
        renamed = [Parameter(name, value=value) for name, value in named.items()
                   if value != getattr(self.settings, name)]
        if renamed:
            self.settings = dataclasses.replace(self.settings, **named)
            self._node.set_parameters(renamed)
        self._set_bone_names(self.scene.bone_names)

    def with_scene(self, name: str, scene: Scene) -> NodeSettings:
        """The settings with another scene. Raises a RagdollError if they do not fit it."""
        settings = self._settings_with({'scene': name}, scene)
        check(settings, scene)
        return settings

    def unload(self) -> None:
        """Empty the parameter bone_names, as there is no world."""
        self._set_bone_names([])

    def is_unchanged_read_only(self, parameter: Parameter) -> bool:
        """Whether it is read-only and has this value, as in a parameter dump that is loaded."""
        node, name = self._node, parameter.name
        return (node.has_parameter(name) and node.describe_parameter(name).read_only
                and node.get_parameter(name).value == parameter.value)

    def _load_scene(self) -> RagdollError | None:
        """Load the scene; if it is broken, give the error, and go on with the default one, so that
        the faults of other parameters are told as well.
        """
        try:
            self.scene = load_scene(self.settings.scene)
        except RagdollError as error:
            self.scene = load_scene(NodeSettings.scene)
            return error
        return None

    def _declare(self, name: str, found: list[str]) -> None:
        """Declare a parameter and store its value; an error is appended to ``found``."""
        spec, value = SPECS[name], getattr(self.settings, name)
        try:
            value = self._node.declare_parameter(name, value, _descriptor(spec)).value
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            found.append(f'{name}: {error}')
        self.settings = dataclasses.replace(self.settings, **{name: _plain(value)})

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        given = _settable(parameters)
        try:
            scene = self._load(given['scene']) if 'scene' in given else self.scene
            settings = self._settings_with(given, scene)
            changed = self._changed(given, settings)
            if changed:  # what has been checked need not be again, as dolls come and go
                check(settings, scene)
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
                                   for name in changed - set(_settable(parameters))])
        if 'scene' in changed:
            self._set_bone_names(self.scene.bone_names)

    def _changed(self, given: dict, settings: NodeSettings) -> set[str]:
        """Names of parameters with a new value; a scene that is set again is reloaded."""
        changed = {name for name in SPECS
                   if getattr(settings, name) != getattr(self.settings, name)}
        return changed | ({'scene'} & set(given))

    def _settings_with(self, given: dict, scene: Scene) -> NodeSettings:
        return dataclasses.replace(self.settings, **{**self._new_scene_defaults(scene), **given})

    def _new_scene_defaults(self, scene: Scene) -> dict:
        """The scene's defaults of the parameters that are at the default of the last scene."""
        before = scene_defaults(self.scene)
        return {name: value for name, value in scene_defaults(scene).items()
                if getattr(self.settings, name) == before[name]}

    def _set_bone_names(self, names: Iterable[str]) -> None:
        """Set the parameter bone_names, which is read-only for all others."""
        descriptor = self._node.describe_parameter(BONE_NAMES)
        descriptor.read_only = False
        self._node.set_parameters([Parameter(
            BONE_NAMES, Parameter.Type.STRING_ARRAY, list(names))])
        descriptor.read_only = True


def make_simulation(scene: Scene, settings: NodeSettings) -> LoggedSimulation:
    """Create a simulation with these settings."""
    simulation = LoggedSimulation(scene, settings.step, settings.accuracy, settings.engine,
                                    settings.workers or 'auto')
    simulation.samples_per_tick = settings.samples_per_tick
    return simulation


def as_doubles(parameters: Iterable[Parameter]) -> list[Parameter]:
    """The parameters, with integers converted to double where a double is declared."""
    return [Parameter(parameter.name, Parameter.Type.DOUBLE, float(parameter.value))
            if parameter.name in DOUBLES and parameter.type_ == Parameter.Type.INTEGER
            else parameter for parameter in parameters]


def unknown_parameters(names: Iterable[str], known: Collection[str]) -> list[str]:
    """A warning for each unknown name, with the most similar known one if there is one."""
    warnings = []
    for name in names:
        if name not in known and not name.startswith(QOS_OVERRIDES):
            similar = difflib.get_close_matches(name, known, 1, MIN_SIMILARITY)
            warnings.append(f'no parameter {name}: it is ignored'
                            + (f'; did you mean {similar[0]}?' if similar else ''))
    return warnings


def _settable(parameters: list[Parameter]) -> dict:
    return {parameter.name: _plain(parameter.value) for parameter in parameters
            if parameter.name in SPECS}


def _plain(value: object) -> object:
    """The value as NodeSettings has it: rclpy's lists and arrays become tuples."""
    return value if isinstance(value, (str, bool, int, float)) else tuple(value)


def _descriptor(spec: dataclasses.Field) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=spec.metadata['description'],
                                     additional_constraints=spec.metadata['constraints'])
    if spec.metadata['range']:
        lower, upper = spec.metadata['range']
        if isinstance(spec.default, int):
            descriptor.integer_range = [IntegerRange(from_value=lower, to_value=upper, step=1)]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(lower), to_value=float(upper))]
    return descriptor

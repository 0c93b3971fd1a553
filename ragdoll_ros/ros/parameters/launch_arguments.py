"""Arguments of the launch files: checked before anything starts, all faults at once.

A node that has been started runs on when the launch of the next one fails: nothing ends it.
"""
from __future__ import annotations

import os
from collections.abc import Callable

from ...files.scene import load_scene
from ...model import errors
from .node_settings import SPECS

BOOLEANS = {'true': True, '1': True, 'false': False, '0': False}

PARAMETERS = {'scene': 'scene', 'pace': 'real_time_factor', 'rate': 'rate',
              'publish_clock': 'publish_clock', 'use_sim_time': 'use_sim_time'}
"""Parameter of the node that an argument sets, unless it is empty."""

NEEDED = {'rviz': 'rviz2', 'robot_state_publisher': 'robot_state_publisher',
          'foxglove': 'foxglove_bridge'}
"""Package that an argument needs, if it is true."""

EMPTY = ('params_file', 'use_sim_time', 'publish_clock', 'rate', 'pace', 'scene')
"""Arguments that may be empty: then the parameter file or the node decides."""


class InvalidLaunchArguments(errors.RagdollError):
    """Launch arguments that are not valid, or need what is not installed."""


def node_parameters(given: dict[str, str], is_installed: Callable[[str], bool]) -> dict:
    """Return the parameters of the node for the launch arguments ``given``.
    ``is_installed(package)``: whether a ROS package is installed.

    Raises InvalidLaunchArguments.
    """
    found: list[str] = []
    values = {}
    for name, text in given.items():
        if name in ('namespace', 'params_file', 'scene') or (not text and name in EMPTY):
            values[name] = text
        elif name in ('pace', 'rate'):
            values[name] = _number(name, text, found)
        else:
            values[name] = _boolean(name, text, found)
    if values['scene']:
        try:
            load_scene(values['scene'])
        except errors.RagdollError as error:
            found.append(f'scene:={values["scene"]}: {error}')
    if values['params_file'] and not os.path.isfile(values['params_file']):
        found.append(f'params_file:={values["params_file"]}: expected a parameter file')
    if values['params_file'] and values['robot_state_publisher'] and not values['scene']:
        found.append('robot_state_publisher:=true with a params_file needs scene:=... as well')
    found += [f'{name}:=true needs {package}, which is not installed: sudo apt install '
              f'ros-$ROS_DISTRO-{package.replace("_", "-")}'
              for name, package in NEEDED.items() if values[name] and not is_installed(package)]
    if found:
        raise InvalidLaunchArguments('\n'.join(found))
    parameters = {parameter: values[name] for name, parameter in PARAMETERS.items()
                  if values[name] != ''}
    if values['robot_state_publisher']:
        parameters['publish_tf'] = 'root'
    return parameters


def _boolean(name: str, text: str, found: list[str]) -> bool:
    if text.lower() not in BOOLEANS:
        found.append(f'{name}:={text}: expected true or false')
    return BOOLEANS.get(text.lower(), False)


def _number(name: str, text: str, found: list[str]) -> float:
    lower, upper = SPECS[PARAMETERS[name]].metadata['range']
    try:
        value = float(text)
    except ValueError:
        value = float('nan')
    if not lower <= value <= upper:
        found.append(f'{name}:={text}: expected a number from {lower:g} to {upper:g}')
    return value

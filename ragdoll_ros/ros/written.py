"""Parameters as people write them: whole numbers for any number, names with a slip in them."""
from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

from rclpy.parameter import Parameter

OF_ROS = 'qos_overrides.'
"""Begins the names of what rclpy declares for a topic, if it does at all."""

LIKE = 0.7
"""How much two names must have in common, of 1, for one to be a slip for the other."""


def as_numbers(parameters: Iterable[Parameter], real: Collection[str]) -> list[Parameter]:
    """The parameters, whole numbers being as good as others where a ``real`` one is wanted."""
    return [Parameter(parameter.name, Parameter.Type.DOUBLE, float(parameter.value))
            if parameter.name in real and parameter.type_ == Parameter.Type.INTEGER else parameter
            for parameter in parameters]


def unknown(names: Iterable[str], known: Collection[str]) -> list[str]:
    """A sentence for each name that is not known, with the known one that is most like it."""
    told = []
    for name in names:
        if name not in known and not name.startswith(OF_ROS):
            like = difflib.get_close_matches(name, known, 1, LIKE)
            told.append(f'no parameter {name}: it is ignored'
                        + (f'; did you mean {like[0]}?' if like else ''))
    return told

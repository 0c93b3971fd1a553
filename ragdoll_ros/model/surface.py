"""Checks of surface properties: friction, rolling friction, restitution and color, which a bone or
a static body may have, and the stiffness of the ground or a static body.
"""
from typing import Any

from . import errors
from .errors import set_fields
from .vectors import finite_floats


def check_stiffness(stiffness: float) -> None:
    """Raise NotPositive unless it is a number above zero, N/m; infinity is rigid."""
    if not stiffness > 0:
        raise errors.NotPositive('stiffness', stiffness, 'above zero, N/m; .inf is rigid')


def check_surface(owner: Any, max_rolling_friction: float) -> None:
    """Check friction, rolling_friction, restitution and color of a frozen dataclass, where given.

    Raises OutOfRange, NotFinite, WrongForm; ``color`` becomes a tuple.
    """
    for key, most in (('friction', float('inf')), ('rolling_friction', max_rolling_friction),
                      ('restitution', 1)):
        if getattr(owner, key) is not None:
            errors.check_range(key, getattr(owner, key), 0, most)
    if owner.color is not None:
        set_fields(owner, color=finite_floats('color', owner.color, 4))
        for part in owner.color:
            errors.check_range('color', part, 0, 1)

"""Follow: that a body of a scene moves as it is told, exactly or by limited forces."""
import math
from dataclasses import dataclass

from . import errors


@dataclass(frozen=True)
class Follow:
    """How a body follows the motion that Simulation.drive_body() gives it.

    By default exactly: nothing that it touches changes its velocity, as of infinite mass (a
    kinematic body in Box2D). With limits it is moved by forces, and gives way to what is stronger.

    Args:
        max_force: N, at its centre of mass.
        max_torque: N m.

    Raises:
        NotPositive: a limit is not above 0.

    Example:
        >>> Follow().is_exact, Follow(max_force=500, max_torque=50).is_exact
        (True, False)
    """

    max_force: float = math.inf
    max_torque: float = math.inf

    def __post_init__(self) -> None:
        for key in ('max_force', 'max_torque'):
            if not getattr(self, key) > 0:
                raise errors.NotPositive(key, getattr(self, key), 'a number above 0')

    @property
    def is_exact(self) -> bool:
        """Whether no force can be too large for it."""
        return self == Follow()

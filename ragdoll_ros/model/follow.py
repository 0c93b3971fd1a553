"""Follow: how a driven body of a scene follows a given motion, exactly or by limited forces."""
import math
from dataclasses import dataclass

from . import errors


@dataclass(frozen=True)
class Follow:
    """How a body follows the motion that Simulation.drive_body() gives it.

    By default it follows exactly: no contact changes its velocity, as if its mass were infinite (a
    kinematic body in Box2D). With limits it is moved by forces, and yields to stronger ones.

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
        """Whether it follows exactly: both limits are infinite."""
        return self == Follow()

"""Errors of the package: one root class, and a subclass for each fault of a model."""
from __future__ import annotations

import bisect
import contextlib
import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any

MAX_LISTED_NAMES = 40
"""Up to this many valid names are listed; of more, those next to the wrong one in the alphabet."""


def one_of(names: Sequence[str], wrong: str) -> str:
    """Text that lists the valid names; of more than MAX_LISTED_NAMES only five, those next to
    ``wrong`` in the alphabet.
    """
    if len(names) <= MAX_LISTED_NAMES:
        return 'one of ' + ', '.join(names)
    ordered = sorted(names)
    place = max(0, min(bisect.bisect(ordered, wrong) - 2, len(ordered) - 5))
    return f'one of {len(names)} names, such as {", ".join(ordered[place:place + 5])}'


class RagdollError(ValueError):
    """Root of all errors that this package raises. A ValueError.

    Example:
        >>> try:
        ...     Sphere(-1)
        ... except RagdollError as error:
        ...     print(error)
        sphere: NotPositive: -1.0; expected above zero
    """


class ModelError(RagdollError):
    """One wrong value: its path in the model, the value, what is expected."""

    def __init__(self, path: str, value: object, expected: str) -> None:
        super().__init__(path, value, expected)
        self.path = path
        self.value = value
        self.expected = expected

    def at(self, prefix: str) -> ModelError:
        """The same error with its path under ``prefix``."""
        joint = '' if not self.path or self.path.startswith('[') else '.'
        return type(self)(f'{prefix}{joint}{self.path}', self.value, self.expected)

    def __str__(self) -> str:
        value = repr(self.value)
        shown = value if len(value) <= 60 else value[:57] + '...'
        where = self.path and f'{self.path}: '
        return f'{where}{type(self).__name__}: {shown}; expected {self.expected}'


class Closed(RagdollError):
    """A simulation is used after close()."""


class NotPositive(ModelError):
    """A number that must be above zero and is not."""


class NotFinite(ModelError):
    """NaN or infinity where a finite number is needed."""


class NotUnit(ModelError):
    """A direction or a quaternion of length zero."""


class OutOfRange(ModelError):
    """A number outside its range."""


class LimitsReversed(ModelError):
    """A lower joint limit above the upper one."""


class WrongAxes(ModelError):
    """A joint of an unknown kind, or whose axes or limits do not fit its kind."""


class OffCentre(ModelError):
    """A compound shape whose centre of mass is not its origin."""


class NotPrincipal(ModelError):
    """A compound shape whose axes are not principal axes of inertia."""


class UnknownJoint(ModelError):
    """No joint or joint angle has the name."""


class UnknownBone(ModelError):
    """No bone, or rider of a skeleton, has the name."""


class UnknownDoll(ModelError):
    """No doll, driven body or robot has the name."""


class UnknownAnimation(ModelError):
    """No animation has the name."""


class DuplicateName(ModelError):
    """A name that must be unique is used twice, or is reserved."""


class ConnectedTwice(ModelError):
    """A bone, link or node with two parents."""


class JointCycle(ModelError):
    """Joints that form a loop."""


class Detached(ModelError):
    """Bones that do not form one tree, as there is none or several have no parent; or a root where
    a bone with a parent is needed.
    """


class WrongForm(ModelError):
    """A structure other than the schema's, or a value of another form."""


class Unreadable(ModelError):
    """A file that is missing, or cannot be parsed or written."""


class ModelErrors(RagdollError):
    """All errors of one file."""

    def __init__(self, file: str, errors: list[ModelError]) -> None:
        super().__init__(file, errors)
        self.file = file
        self.errors = errors

    def __str__(self) -> str:
        count = f'{len(self.errors)} error{"s" * (len(self.errors) != 1)}'
        return '\n'.join([f'{self.file}: {count}', *(
            f'  {error}' if error.path else f'  file: {error}' for error in self.errors)])


@contextlib.contextmanager
def naming(path: str) -> Iterator[None]:
    """Context in which a ModelError, OSError or ValueError becomes ModelErrors that name the file
    ``path``; the latter two as Unreadable. ModelErrors pass unchanged.
    """
    try:
        yield
    except ModelErrors:
        raise
    except ModelError as error:
        raise ModelErrors(path, [error]) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        unreadable = Unreadable('', reason, 'a file that can be read')
        raise ModelErrors(path, [unreadable]) from None


def check_finite(path: str, values: object) -> None:
    """Raise NotFinite unless every number in ``values`` (a number or a tuple of them) is finite."""
    numbers = values if isinstance(values, tuple) else (values,)
    if not all(math.isfinite(number) for number in numbers):
        raise NotFinite(path, values, 'finite numbers')


def check_positive(path: str, values: object) -> None:
    """Raise NotFinite or NotPositive unless every number in ``values`` is finite and above zero."""
    numbers = values if isinstance(values, tuple) else (values,)
    check_finite(path, values)
    if not all(number > 0 for number in numbers):
        raise NotPositive(path, values, 'above zero')


def check_range(path: str, value: float, lower: float, upper: float) -> None:
    """Raise OutOfRange unless lower <= value <= upper."""
    if not lower <= value <= upper:
        raise OutOfRange(path, value, f'{lower:g} to {upper:g}')


def set_fields(instance: Any, **values: object) -> None:
    """Set fields of a frozen dataclass in its __post_init__."""
    names = {field.name for field in dataclasses.fields(instance)}
    for name, value in values.items():
        if name not in names:
            raise AttributeError(name)
        object.__setattr__(instance, name, value)

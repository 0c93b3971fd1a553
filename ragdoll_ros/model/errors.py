"""What can be wrong with a model: one root, and a named error for each kind."""
from __future__ import annotations

import bisect
import dataclasses
import math
from collections.abc import Sequence

MAX_LISTED_NAMES = 40
"""Names that an error lists; of more, those beside which the wrong one would stand."""


def one_of(names: Sequence[str], wrong: str) -> str:
    """What is expected instead of a wrong name."""
    if len(names) <= MAX_LISTED_NAMES:
        return 'one of ' + ', '.join(names)
    ordered = sorted(names)
    place = max(0, min(bisect.bisect(ordered, wrong) - 2, len(ordered) - 5))
    return f'one of {len(names)} names, such as {", ".join(ordered[place:place + 5])}'


class RagdollError(ValueError):
    """Root of every error that this package raises on purpose."""


class ModelError(RagdollError):
    """One wrong value: where it stands, what it is, what would be right."""

    def __init__(self, path: str, value: object, expected: str) -> None:
        super().__init__(path, value, expected)
        self.path = path
        self.value = value
        self.expected = expected

    def at(self, prefix: str) -> ModelError:
        """The same error, seen from one level further out."""
        joint = '' if not self.path or self.path.startswith('[') else '.'
        return type(self)(f'{prefix}{joint}{self.path}', self.value, self.expected)

    def __str__(self) -> str:
        value = repr(self.value)
        shown = value if len(value) <= 60 else value[:57] + '...'
        where = self.path and f'{self.path}: '
        return f'{where}{type(self).__name__}: {shown}; expected {self.expected}'


class Closed(RagdollError):
    """Something is asked of a simulation that was closed."""


class NotPositive(ModelError):
    """A size, a mass or a duration that is not above zero."""


class NotFinite(ModelError):
    """NaN or infinity where a finite number is needed."""


class NotUnit(ModelError):
    """A direction or a quaternion of length zero."""


class OutOfRange(ModelError):
    """A number outside its range."""


class LimitsReversed(ModelError):
    """A lower joint limit above the upper one."""


class WrongAxes(ModelError):
    """A joint with another number of axes or limits than its kind has."""


class OffCentre(ModelError):
    """Shapes of a bone whose centre of mass is not the bone's."""


class NotPrincipal(ModelError):
    """Shapes of a bone whose principal axes of inertia are not the bone's."""


class UnknownJoint(ModelError):
    """A name that no joint angle has."""


class UnknownBone(ModelError):
    """A name that no bone bears."""


class DuplicateName(ModelError):
    """A name that two things bear."""


class ConnectedTwice(ModelError):
    """A bone that is the child of two joints."""


class JointCycle(ModelError):
    """Joints that close a ring."""


class Detached(ModelError):
    """A second bone without a parent: not one tree."""


class WrongForm(ModelError):
    """A file whose structure is not what the schema says."""


class Unreadable(ModelError):
    """A file that is missing, is no YAML, or is no text."""


class ModelErrors(RagdollError):
    """All errors of one file at once."""

    def __init__(self, file: str, errors: list[ModelError]) -> None:
        super().__init__(file, errors)
        self.file = file
        self.errors = errors

    def __str__(self) -> str:
        count = f'{len(self.errors)} error{"s" * (len(self.errors) != 1)}'
        return '\n'.join([f'{self.file}: {count}', *(
            f'  {error}' if error.path else f'  file: {error}' for error in self.errors)])


def check_finite(path: str, values: object) -> None:
    """Raise NotFinite unless every number in ``values`` (a number or a tuple of them) is finite."""
    numbers = values if isinstance(values, tuple) else (values,)
    if not all(math.isfinite(number) for number in numbers):
        raise NotFinite(path, values, 'finite numbers')


def check_positive(path: str, values: object) -> None:
    """Raise NotPositive unless every number in ``values`` is finite and above zero."""
    numbers = values if isinstance(values, tuple) else (values,)
    check_finite(path, values)
    if not all(number > 0 for number in numbers):
        raise NotPositive(path, values, 'above zero')


def check_range(path: str, value: float, lower: float, upper: float) -> None:
    """Raise OutOfRange unless lower <= value <= upper."""
    if not lower <= value <= upper:
        raise OutOfRange(path, value, f'{lower:g} to {upper:g}')


def set_fields(instance: object, **values: object) -> None:
    """Set fields of a frozen dataclass while it is being made."""
    names = {field.name for field in dataclasses.fields(instance)}
    for name, value in values.items():
        if name not in names:
            raise AttributeError(name)
        object.__setattr__(instance, name, value)

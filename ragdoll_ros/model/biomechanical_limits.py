"""BiomechanicalLimits: force limits and stiffness of the regions of the body."""
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from . import errors
from .errors import set_fields

SIDES = ('left_', 'right_')
"""Before the names of bones that a body has twice."""


@dataclass(frozen=True)
class BodyRegion:
    """A region of the body as a linear spring with force limits.

    Raises:
        NotFinite, NotPositive: for its fields.
    """

    force: float
    """N: limit where it is clamped."""
    transient_force: float
    """N: limit of the peak force of a blow."""
    stiffness: float
    """N/m."""
    bones: tuple[str, ...]
    """Names of its bones, without left_ or right_."""
    effective_mass: float | None = None
    """kg, of the source's own formula; None: not given."""
    head: bool = False
    """Whether head injury criteria are told of it."""

    def __post_init__(self) -> None:
        set_fields(self, bones=tuple(self.bones))
        for name in ('force', 'transient_force', 'stiffness', 'effective_mass'):
            value = getattr(self, name)
            if value is not None:
                errors.check_finite(name, value)
                errors.check_positive(name, value)
                set_fields(self, **{name: float(value)})


@dataclass(frozen=True)
class BiomechanicalLimits:
    """Regions of the body by name, and the ``source`` of their numbers.

    Raises:
        DuplicateName: a bone is in two regions.
    """

    source: str
    regions: Mapping[str, BodyRegion]

    def __post_init__(self) -> None:
        found: dict[str, str] = {}
        for name, region in self.regions.items():
            for bone in region.bones:
                if bone in found:
                    raise errors.DuplicateName(f'regions.{name}.bones', bone,
                                               f'a bone that is not of {found[bone]} as well')
                found[bone] = name
        set_fields(self, regions=MappingProxyType(dict(self.regions)))

    def region_of(self, bone: str) -> str:
        """Name of the region of a doll's bone; '' if it has none."""
        names = bone, *(bone.removeprefix(side) for side in SIDES)
        return next((region for region, one in self.regions.items()
                     if not set(names).isdisjoint(one.bones)), '')

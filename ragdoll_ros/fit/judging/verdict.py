"""Whether to believe a doll: good, doubtful or wrong, and why."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...model.ragdoll import Ragdoll
from ..pipeline import Fit
from ..roles.names import doll_roles
from ..roles.person import is_person
from .attachment import find_gaps, find_wrong_root
from .coverage import find_uncovered
from .doubts import extent, find_doubts
from .finding import Finding
from .proportions import find_masses
from .symmetry import find_asymmetries
from .trial import find_in_a_fall


@dataclass(frozen=True)
class Verdict:
    """What all measures have found."""

    findings: tuple[Finding, ...] = ()

    @property
    def word(self) -> str:
        """``good`` without a finding, ``wrong`` with one that no right doll has."""
        if any(finding.wrong for finding in self.findings):
            return 'wrong'
        return 'doubtful' if self.findings else 'good'

    def __str__(self) -> str:
        return '\n'.join([*(f'{finding.word}: {finding.sentence}' for finding in self.findings),
                          f'verdict: {self.word}'])


def judge(doll: Ragdoll, fit: Fit | None = None, falls: bool = True,
          measured: bool = False) -> Verdict:
    """Verdict on a doll, of a ``fit`` also by its skin.

    ``falls``: let it fall for a second. ``measured``: a robot's bodies and joints are where its
    file says, so that where they are tells nothing.
    """
    size, roles = extent(doll), doll_roles(doll)
    found = find_doubts(doll, measured)
    if not measured:
        found += find_gaps(doll, size) + find_wrong_root(doll, roles)
        found += find_asymmetries(doll, size)
    positions = np.array([bone.position for bone in doll.bones])
    if is_person(roles, positions) and not measured:
        found += find_masses(doll, roles, size)
    if fit is not None:
        found += find_uncovered(doll, fit.character,
                                {body.bone.name: body.bones for body in fit.bodies})
    if falls:
        found += find_in_a_fall(doll, size)
    return Verdict(tuple(found))

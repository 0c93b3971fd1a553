"""Verdict on a doll: good, doubtful or wrong, with the findings of all checks."""
from dataclasses import dataclass

import numpy as np

from ...files.bone_names.names import doll_roles
from ...model.ragdoll import Ragdoll
from ..pipeline import Fit
from ..roles.person import has_persons_proportions, is_person
from .coverage import find_uncovered
from .drop_test import run_drop_test
from .finding import Finding
from .plausibility import extent, find_implausible, find_implausible_masses
from .structure import find_asymmetries, find_detached_joints, find_wrong_root


@dataclass(frozen=True)
class Verdict:
    """Findings of all checks."""

    findings: tuple[Finding, ...] = ()

    @property
    def word(self) -> str:
        """'wrong' with a finding that no correct doll has, 'good' without findings, else
        'doubtful'.
        """
        if any(finding.wrong for finding in self.findings):
            return 'wrong'
        return 'doubtful' if self.findings else 'good'

    def __str__(self) -> str:
        return '\n'.join([*(f'{finding.word}: {finding.sentence}' for finding in self.findings),
                          f'verdict: {self.word}'])


def judge(doll: Ragdoll, fit: Fit | None = None, falls: bool = True,
          measured: bool = False) -> Verdict:
    """Verdict on a doll; with its ``fit``, on the coverage of its skin too.

    ``falls``: include the drop test. ``measured``: a robot, whose bodies and joints are where its
    file states, so that connectivity, symmetry and proportions are not checked.
    """
    size, roles = extent(doll), doll_roles(doll)
    found = find_implausible(doll, measured)
    if not measured:
        found += find_detached_joints(doll, size) + find_wrong_root(doll, roles)
        found += find_asymmetries(doll, size)
    positions = np.array([bone.position for bone in doll.bones])
    if not measured and is_person(roles, positions) and has_persons_proportions(
            roles, [bone.name for bone in doll.bones], [bone.shape.volume for bone in doll.bones]):
        found += find_implausible_masses(doll, roles, size)
    if fit is not None:
        found += find_uncovered(doll, fit.character,
                                {body.bone.name: body.bones for body in fit.bodies})
    if falls:
        found += run_drop_test(doll, size)
    return Verdict(tuple(found))

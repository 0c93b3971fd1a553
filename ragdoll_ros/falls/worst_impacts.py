"""The worst impacts of a fall: for each region of the body, the impact with the largest ratio of
peak force to limit.
"""
from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ..model.biomechanical_limits import BiomechanicalLimits
from ..model.scene import Scene
from ..physics.sensors.head_injury import HIC15
from ..physics.sensors.impacts import Impact


@dataclass(frozen=True)
class WorstImpacts:
    """Worst impacts in the regions that a doll's bones have, in the order of the limits."""

    by_region: dict[str, Impact | None]
    """The impact with the largest ratio to the limit; None if there is none."""
    hic15: float = math.nan
    """Largest head injury criterion of the impacts of a head, s g^2.5; NaN if there is none."""

    @classmethod
    def none_yet(cls, scene: Scene, limits: BiomechanicalLimits) -> WorstImpacts:
        """The worst impacts before the first impact: None for each region that a bone has."""
        own = {limits.region_of(bone.name) for bone in scene.bones}
        return cls(dict.fromkeys(region for region in limits.regions if region in own))

    def after(self, impacts: Iterable[Impact], limits: BiomechanicalLimits) -> WorstImpacts:
        """The worst impacts after more ``impacts``."""
        worst, hic15 = dict(self.by_region), self.hic15
        for impact in impacts:
            if impact.region not in worst:
                continue
            before = worst[impact.region]
            if before is None or impact.ratio > before.ratio:
                worst[impact.region] = impact
            if limits.regions[impact.region].head:
                hic15 = max(impact.head_injury(HIC15), 0.0 if math.isnan(hic15) else hic15)
        return WorstImpacts(worst, hic15)

    @property
    def worst(self) -> Impact | None:
        """The impact with the largest ratio of all; None if there is none."""
        found = [impact for impact in self.by_region.values() if impact is not None]
        return max(found, key=lambda impact: impact.ratio, default=None)

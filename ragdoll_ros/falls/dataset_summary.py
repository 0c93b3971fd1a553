"""Summary of a data set, from its labels."""
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..model.errors import WrongForm
from ..people.fall_phases import part_impact
from ..people.real_falls import bones_of
from .formats.registry import resolve_format
from .manifest import Manifest
from .peaks import Peaks
from .recipe import Recipe, recipe_of

DIRECTIONS = ('forwards', 'to the left', 'backwards', 'to the right')


@dataclass(frozen=True)
class DatasetSummary:
    """Labels of the f falls of n bones in a data set; NaN where a fall has no such event."""

    recipe: Recipe
    bones: list[str]
    onsets: np.ndarray
    impacts: np.ndarray
    rests: np.ndarray
    """(f,) s from the start to onset, first contact and rest."""
    directions: np.ndarray
    """(f,) degrees, as Fall.direction."""
    impact_times: np.ndarray
    """(f, n) s from the start to the first contact of each bone."""
    impact_speeds: np.ndarray
    """(f, n) m/s downwards, of each bone before its first contact."""
    failures: dict[int, str]
    regions: list[str] = field(default_factory=list)
    """The r regions of the body that have limits."""
    peak_forces: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    """(f, r) N, of the impact that is nearest to the region's limit."""
    ratios: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    """(f, r) of these to the limits."""
    hic15: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """(f,) s g^2.5, of the head."""
    peaks: Peaks = field(default_factory=Peaks)
    """Of the recipe's first IMU; empty without one."""

    @property
    def hits(self) -> np.ndarray:
        """Which falls (f,) have an impact."""
        return np.isfinite(self.impacts)

    @property
    def descents(self) -> np.ndarray:
        """Descent times, s: from onset to the impact of the pelvis, of the falls that have one."""
        times, _ = part_impact('pelvis', self.bones, self.impact_times, self.impact_speeds)
        return _finite(times - self.onsets)

    @property
    def durations(self) -> np.ndarray:
        """Times from onset to rest, s, of the falls that come to rest."""
        return _finite(self.rests - self.onsets)

    def speeds_of(self, part: str) -> np.ndarray:
        """Impact speeds, m/s, of a body part, of the falls in which it hits the ground.

        Of several bones that represent the part, the one that touches first counts.
        """
        return _finite(part_impact(part, self.bones, self.impact_times, self.impact_speeds)[1])

    def share_that_hits(self, part: str) -> float:
        """Share of all falls in which a body part hits the ground."""
        found = bones_of(part, self.bones)
        return float(np.isfinite(self.impact_speeds[:, found]).any(axis=1).mean())

    def share_towards(self) -> list[float]:
        """Share of the falls with an impact in each of the DIRECTIONS, 90 degrees wide each."""
        quarter = np.round(self.directions[self.hits] / 90).astype(int) % 4
        return (np.bincount(quarter, minlength=4) / max(len(quarter), 1)).tolist()


def summarize(folder: Path) -> DatasetSummary:
    """Read the labels of a complete data set, and the samples of its first IMU. Raises Unreadable
    or WrongForm if it is incomplete or has no labels that can be read.
    """
    manifest = Manifest.read(folder)
    if 'lerobot' not in manifest.header['format'].split(','):
        raise WrongForm('format', manifest.header['format'], 'lerobot, to be described')
    if manifest.done < manifest.header['count']:
        raise WrongForm('falls', manifest.done, f'all {manifest.header["count"]}: ragdoll_falls '
                        '... --resume makes the rest')
    recipe = recipe_of(manifest.header['recipe'])
    lerobot = resolve_format('lerobot')
    labels = lerobot.read_labels(folder)
    onsets, impacts, rests, impact_times = (
        labels[key] / recipe.rate for key in ('onset', 'impact', 'rest', 'impact_frames'))
    bones, peaks = [bone.name for bone in recipe.dolls[0].bones], Peaks()
    if recipe.imus:
        samples = lerobot.read_forces(folder, recipe, recipe.imus[0]['name'])
        pelvis, _ = part_impact('pelvis', bones, impact_times, labels['impact_speeds'])
        peaks = Peaks.of(recipe.imus[0], samples, impacts, pelvis,
                         1 / (recipe.rate * recipe.samples_per_frame))
    return DatasetSummary(
        recipe, bones, onsets, impacts, rests,
        labels['direction_deg'], impact_times, labels['impact_speeds'], manifest.failures,
        lerobot.read_regions(folder), labels['region_peak_forces_N'], labels['region_ratios'],
        labels['hic15'], peaks)


def _finite(values: np.ndarray) -> np.ndarray:
    return values[np.isfinite(values)]

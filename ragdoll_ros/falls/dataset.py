"""What a data set holds, as its labels tell."""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.errors import WrongForm
from .formats.registry import resolve_format
from .manifest import Manifest
from .parts import bones_of
from .recipe import Recipe, recipe_of

DIRECTIONS = ('forwards', 'to the left', 'backwards', 'to the right')


@dataclass(frozen=True)
class Contents:
    """Of a data set's f falls of n bones; NaN where a fall has no such thing."""

    recipe: Recipe
    bones: list[str]
    descents: np.ndarray
    """(f,) s from onset to impact."""
    durations: np.ndarray
    """(f,) s from onset to rest."""
    directions: np.ndarray
    """(f,) degrees, as Fall.direction."""
    impact_speeds: np.ndarray
    """(f, n) m/s downwards, at which each bone hits."""
    failures: dict[int, str]

    @property
    def hits(self) -> np.ndarray:
        """Which falls (f,) have an impact."""
        return np.isfinite(self.descents)

    def speeds_of(self, part: str) -> np.ndarray:
        """Speeds, m/s, at which the first bone that stands for a part hits, of falls where one
        does.
        """
        found = bones_of(part, self.bones)
        speeds = self.impact_speeds[:, found].ravel()
        return speeds[np.isfinite(speeds)]

    def share_that_hits(self, part: str) -> float:
        """Of all falls, in which any of the bones that stand for a part hits."""
        found = bones_of(part, self.bones)
        return float(np.isfinite(self.impact_speeds[:, found]).any(axis=1).mean())

    def share_towards(self) -> list[float]:
        """Of the falls that hit, how many go in each of DIRECTIONS, a quarter of a turn each."""
        quarter = np.round(self.directions[self.hits] / 90).astype(int) % 4
        return (np.bincount(quarter, minlength=4) / max(len(quarter), 1)).tolist()


def read(folder: Path) -> Contents:
    """What is in a data set; Unreadable or WrongForm for a folder of no falls that can be read."""
    manifest = Manifest.read(folder)
    if manifest.header['format'] != 'lerobot':
        raise WrongForm('format', manifest.header['format'], 'lerobot, to be described')
    if manifest.done < manifest.header['count']:
        raise WrongForm('falls', manifest.done, f'all {manifest.header["count"]}: ragdoll_falls '
                        '... --resume makes the rest')
    recipe = recipe_of(manifest.header['recipe'])
    labels = resolve_format('lerobot').read_labels(folder)
    onset, impact, rest = (labels[key] / recipe.rate for key in ('onset', 'impact', 'rest'))
    return Contents(recipe, [bone.name for bone in recipe.dolls[0].bones], impact - onset,
                    rest - onset, labels['direction_deg'], labels['impact_speeds'],
                    manifest.failures)

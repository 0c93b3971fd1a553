"""Peaks of the acceleration at the waist in falls onto a rigid floor and onto mats.

python docs/falls_surfaces.py [--falls 100] [--recipes faint trip slip shove]
                              [--stiffness inf 60000 20000]

A stiffness in N/m is that of the ground, in series with the tissue; the falls are the same on each.
"""
from __future__ import annotations

import argparse
import math

import numpy as np

from ragdoll_ros.falls import Fall, generate, load_recipe
from ragdoll_ros.falls.fall import fall_samples
from ragdoll_ros.falls.peaks import Peaks
from ragdoll_ros.falls.recipe import recipe_of


def peaks_of(falls: list[Fall]) -> Peaks:
    """Of the first sensor."""
    frames = np.array([[math.nan if fall.phases.impact is None else fall.phases.impact,
                        fall.impact_frames[fall.scene.bone_index('pelvis')]] for fall in falls])
    impacts, pelvis = (frames * falls[0].times[1]).T
    samples = [fall_samples(fall, 0)[:, :3] for fall in falls]
    return Peaks.of(falls[0].imus[0], samples, impacts, pelvis,
                    falls[0].times[1] / falls[0].samples_per_frame)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--falls', type=int, default=100)
    parser.add_argument('--recipes', nargs='+', default=['faint', 'trip', 'slip', 'shove'])
    parser.add_argument('--stiffness', nargs='+', type=float, default=[math.inf, 60e3, 20e3])
    wanted = parser.parse_args()
    print('| recipe | stiffness, kN/m | quartiles of the peak, g | more than 6 g before the first '
          'contact, % | before the pelvis lands, % |')
    print('| --- | --- | --- | --- | --- |')
    for name in wanted.recipes:
        data = load_recipe(name).data
        for stiffness in wanted.stiffness:
            recipe = recipe_of({**data, 'ground': {**data['ground'], 'stiffness': stiffness}})
            found = peaks_of(list(generate(recipe, range(wanted.falls))))
            quartiles = np.nanpercentile(found.largest, [25, 50, 75])
            early = ' | '.join(f'{100 * share:.0f}' for share in found.shares_early)
            print(f'| `{name}` | {stiffness / 1e3:g} | '
                  f'{", ".join(f"{each:.1f}" for each in quartiles)} | {early} |')


if __name__ == '__main__':
    main()

"""Falls of people who walk: direction, place and speed of the pelvis' impact by kind and speed.

python docs/falls_walking.py [--falls 40]

The cases of Smeesters, Hayes and McMahon (2001, J Biomech 34:309; 2007, J Biomech Eng 129:393) that
the recipes can make: a faint, a slip and a trip at three speeds. Steps down are not among them.
"""
from __future__ import annotations

import argparse
import math

import numpy as np

from ragdoll_ros.falls import Fall, Recipe, generate, load_recipe
from ragdoll_ros.falls.recipe import recipe_of
from ragdoll_ros.model import rotation

SPEEDS = {'slow': 0.6, 'normal': 1.0, 'fast': 1.4}
"""m/s; of the recipes' 0.5 to 1.5."""

UPRIGHT = math.cos(math.radians(30))
"""Of a pelvis that is nearer to upright, the seat hits: it has no side that is below."""


def case(kind: str, speed: float) -> Recipe:
    """A recipe of ``kind`` 'faint', 'slip' or 'trip' at a speed of walking."""
    data = load_recipe('slip' if kind == 'slip' else 'trip').data
    start = dict(data['start'])
    if kind == 'slip':
        start['velocity'] = [speed, *start['velocity'][1:]]
    else:
        start['walk'] = {**start['walk'], 'speed': speed}
    changes = {'name': kind, 'start': start, 'duration': 2.0}
    if kind == 'faint':
        # The swinging leg has no strength at all; the rest loses it as those do who stand.
        changes |= {'cause': 'faint', 'grabs': [],
                    'limp': data['limp'][:1] + load_recipe('faint').data['limp'][2:]}
    return recipe_of({**data, **changes})


def impact_place(fall: Fall) -> str:
    """Which side of the pelvis is below when it first touches the ground; '' if it never does."""
    pelvis = fall.scene.bone_index('pelvis')
    frame = fall.impact_frames[pelvis]
    if math.isnan(frame):
        return ''
    x, y, z = rotation.rotate(rotation.inverse(fall.states[int(frame), pelvis, 3:7]),
                              (0.0, 0.0, -1.0))
    if -z > UPRIGHT:
        return 'seat'
    return ('front', 'hip', 'back', 'hip')[round(math.degrees(math.atan2(y, x)) / 90) % 4]


def row(kind: str, name: str, count: int) -> str:
    """Row of the table for a case."""
    falls = list(generate(case(kind, SPEEDS[name]), range(count)))
    hit = [fall for fall in falls if fall.phases.impact is not None]
    quarters = [round(fall.direction / 90) % 4 for fall in hit]
    ways = [sum(quarter in which for quarter in quarters) / len(hit)
            for which in ((0,), (1, 3), (2,))]
    found = [place for fall in hit if (place := impact_place(fall))]
    places = [found.count(place) / len(found) for place in ('front', 'hip', 'back', 'seat')]
    pelvis = falls[0].scene.bone_index('pelvis')
    speeds = [-fall.impact_velocities[pelvis, 2] for fall in hit if impact_place(fall)]
    return (f'| {kind}, {name} | ' + ', '.join(f'{way:.0%}' for way in ways) + f' | {len(found)} | '
            + ', '.join(f'{place:.0%}' for place in places)
            + f' | {np.mean(speeds):.2f} ± {np.std(speeds):.2f} |')


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--falls', type=int, default=40, help='of each case')
    count = parser.parse_args().falls
    print('| case | forwards, sideways, backwards | pelvis hits | with its front, hip, back, seat '
          '| at, m/s down |')
    print('| --- | --- | --- | --- | --- |')
    for kind in ('faint', 'slip', 'trip'):
        for name in SPEEDS:
            print(row(kind, name, count), flush=True)


if __name__ == '__main__':
    main()

"""Faints from standing beside real falls: what a body without muscles can claim, and what not.

People stand, lean a little, held by their joints; then ankles, knees, hips and trunk go limp, one
after the other in any order, the arms with the first of them.
"""
from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from ...files.scene import load_scene
from ...model import rotation
from ...model.anthropometry import PERCENTILES, SEXES
from ...model.coordinates import GeneralizedState
from ...model.ragdoll import Ragdoll
from ...model.scene import SECOND, Material, Placement, Scene
from ...people import person, standing
from ...people.real_falls import DESCENT, IMPACT_SPEEDS, SHARE_THAT_HITS, Known
from ...physics.engine.protocol import GROUND
from ...physics.ground_heights import GroundHeights
from ...physics.simulation import Simulation
from ..results.figures import Row
from ..results.runner import Job, Options
from ..results.tables import table

NAME = 'faints'
COUNT, QUICK_COUNT, CHUNK = 1000, 4, 20
DURATION, STEP = 2.5, 0.01
"""s of each from when the first joint goes limp, and between two looks."""

LIES = 0.3
"""m/s below which all bones are when a faint is over: what touches later hardly hits."""

LEAN, APART = math.radians(5), 0.15
"""rad that people lean by at the most; s between one part's going limp and the next's at most."""

ONSET = 0.1
"""m/s of the centre of mass downwards from which on one falls."""

PARTS = {'ankles': ('ankle',), 'knees': ('knee',), 'hips': ('hip',),
         'trunk': ('waist', 'chest', 'head')}
HITS = {'pelvis': ('pelvis',), 'head': ('head',), 'hand': ('left_hand', 'right_hand')}
"""Bones whose touch of the ground is a part's; of hands the first one's."""


@dataclasses.dataclass(frozen=True)
class Faint:
    """Who stands how, and when which joints go limp."""

    scene: Scene
    lean: np.ndarray
    """(4,) turn of the whole person about the soles."""
    limp: tuple[tuple[float, str], ...]
    """s and part, in that order."""
    towards: float
    """rad, that the lean is from forwards to the left."""


def faint(number: int) -> Faint:
    """The start of a number."""
    random = np.random.Generator(np.random.Philox(key=[17, number]))
    sex = SEXES[number % 2]
    (low, _), (height, mass), (high, _) = (PERCENTILES[sex][p] for p in (5, 50, 95))
    size = float(np.clip(random.normal(height, (high - low) / (2 * 1.645)), low, high))
    heavy = mass * (size / height) ** 2 * math.exp(0.12 * float(random.normal()))
    doll = person(size, heavy, sex)
    towards = float(random.uniform(-math.pi, math.pi))
    lean = rotation.from_axis_angle((-math.sin(towards), math.cos(towards), 0.0),
                                    float(random.uniform(0.01, LEAN)))
    instants = np.cumsum([0.0, *random.uniform(0, APART, len(PARTS) - 1)])
    order = [list(PARTS)[index] for index in random.permutation(len(PARTS))]
    placed = Placement(doll, orientation=tuple(lean), position=(0, 0, 1))
    scene = dataclasses.replace(
        load_scene('woman_faints'), dolls=(placed,), step=STEP,
        material=Material(float(random.uniform(0.4, 0.8)), restitution=0.0))
    return Faint(scene, lean, tuple(zip(instants.tolist(), order, strict=True)), towards)


def jobs(options: Options) -> list[Job]:
    """CHUNK faints each."""
    count = QUICK_COUNT if options.quick else COUNT
    return [Job(NAME, f'faints from {first}', functools.partial(
        measure, first, min(first + CHUNK, count)), 0.3 * CHUNK)
        for first in range(0, count, CHUNK)]


def measure(first: int, end: int) -> list[Row]:
    """What the faints first ... end - 1 came to, one row."""
    found = [fallen(faint(number)) for number in range(first, end)]
    return [{'faints': end - first, 'values': {key: [row[key] for row in found]
                                               for key in found[0]}}]


def fallen(start: Faint) -> dict[str, float]:
    """Vertical speeds at impact, m/s, and s from onset to the pelvis' impact; NaN where none is."""
    bones = {part: [start.scene.bone_index(name) for name in names]
             for part, names in HITS.items()}
    masses = np.array([bone.mass for bone in start.scene.bones])
    speeds, onset, descent, limp = {}, None, math.nan, list(start.limp)
    with Simulation(start.scene, accuracy='draft', engine='rigid') as simulation:
        _stand(simulation, start)
        while simulation.time < DURATION * SECOND:
            while limp and limp[0][0] * SECOND <= simulation.time:
                simulation.go_limp(_angles(start.scene.dolls[0].doll, limp.pop(0)[1]))
            falling = -simulation.state.linear_velocities[:, 2]
            if onset is None and falling @ masses / masses.sum() > ONSET:
                onset = simulation.time
            elif onset is not None and 'pelvis' in speeds and (
                    np.linalg.norm(simulation.state.linear_velocities, axis=1).max() < LIES):
                break
            simulation.advance()
            contacts = simulation.contacts
            for bone in contacts.a[contacts.b == GROUND]:
                part = next((part for part, own in bones.items() if bone in own), None)
                if part and part not in speeds:
                    speeds[part] = float(falling[bone])
                    if part == 'pelvis' and onset is not None:
                        descent = (simulation.time - onset) / SECOND
    return {**{part: speeds.get(part, math.nan) for part in HITS}, 'descent': descent,
            'towards': start.towards}


def _stand(simulation: Simulation, start: Faint) -> None:
    """Put soles flat on the ground, the person leaning over them, and hold all joints."""
    x, y, z = rotation.rotate(rotation.inverse(start.lean), np.array([0.0, 0.0, 1.0]))
    here = simulation.coordinates
    q, doll = here.q.copy(), simulation.scene.dolls[0].doll
    places = {name: 7 + place for place, name in enumerate(
        name for joint in doll.joints_depth_first() for name in joint.angle_names)}
    for side in 'lr':
        q[places[f'{side}_p_ankle']] = math.atan2(x, z)
        q[places[f'{side}_r_ankle']] = -math.asin(y)
    simulation.place(GeneralizedState(q, here.v))
    q[2] -= float(GroundHeights(simulation.scene)(simulation.state).min())
    simulation.place(GeneralizedState(q, here.v))
    for name, spring in standing(doll).items():
        simulation.hold(name, *spring)


def _angles(doll: Ragdoll, part: str) -> list[str]:
    """Joint angles of a part; arms go with whichever is first, and stay limp."""
    ends = (*PARTS[part], 'shoulder', 'elbow', 'wrist')
    return [name for joint in doll.joints for name in joint.angle_names if name.endswith(ends)]


def joined(rows: list[Row]) -> dict[str, np.ndarray]:
    """All faints' values."""
    return {key: np.array([np.nan if value is None else float(value)
                           for row in rows for value in row['values'][key]])
            for key in rows[0]['values']}


def faint_tables(rows: list[Row]) -> list[str]:
    """Means beside those of real falls, in their standard deviations; shares that hit."""
    values = joined(rows)
    count = len(values['descent'])

    def line(what: str, own: np.ndarray, known: Known) -> Row:
        own = own[np.isfinite(own)]
        return {'what': what, 'mean': float(own.mean()), 'deviation': float(own.std()),
                'of': len(own), 'real': f'{known.mean:.3g} ± {known.deviation:.3g}',
                'off': (own.mean() - known.mean) / known.deviation, 'source': known.source}

    lines = [line(f'vertical speed at impact, {part}, m/s', values[part], known)
             for part, known in IMPACT_SPEEDS.items()]
    lines.append(line('from onset to the impact of the pelvis, s', values['descent'], DESCENT))
    shares = [{'what': part, 'mean': float(np.isfinite(values[part]).mean()), 'real': share,
               'source': source} for part, (share, source) in SHARE_THAT_HITS.items()]
    return [f'{count} faints.', table(lines, (
        ('what', 'what', '{}'), ('mean', 'mean', '{:.2f}'), ('deviation', 'SD', '{:.2f}'),
        ('of', 'faints with it', '{}'), ('real', 'real falls', '{}'),
        ('off', 'off, in their SD', '{:+.1f}'), ('source', 'whose', '{}'))),
        table(shares, (('what', 'hits the ground', '{}'), ('mean', 'share of faints', '{:.2f}'),
                       ('real', 'of real falls', '{:.2f}'), ('source', 'whose', '{}')))]

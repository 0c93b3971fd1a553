"""Fainting falls from standing, compared with published figures of real falls.

People stand and lean a little, their joints held by springs; then the springs of ankles, knees,
hips and trunk are released one after the other in random order, those of the arms with the first.
"""
import dataclasses
import functools
import math

import numpy as np

from ...files.scene import load_scene
from ...model import rotation
from ...model.anthropometry import PERCENTILES, SEXES
from ...model.biomechanical_limits import BiomechanicalLimits
from ...model.coordinates import GeneralizedState
from ...model.ragdoll import Ragdoll
from ...model.scene import SECOND, Material, Placement, Scene
from ...people import person, standing
from ...people.fall_phases import ONSET_DURATION, bone_impacts, find_phases, part_impact
from ...people.real_falls import DESCENT, IMPACT_SPEEDS, SHARE_THAT_HITS, Known
from ...physics.rigid_body import GroundHeights
from ...physics.sensors.impacts import bones_that_hit
from ...physics.simulation import Simulation
from ..results.figures import Row
from ..results.markdown import table
from ..results.runner import Job, RunOptions

NAME = 'faints'
COUNT, QUICK_COUNT, CHUNK = 1000, 4, 20
DURATION, STEP = 2.5, 0.01
"""s of each fall from the first joint release, and of a tick."""

LYING_SPEED = 0.3
"""m/s: a fall ends when the pelvis has hit and all bones are slower; later contacts hardly hit."""

MAX_LEAN, MAX_DELAY = math.radians(5), 0.15
"""Largest initial lean, rad; largest time between two joint releases, s."""

JOINT_GROUPS = {'ankles': ('ankle',), 'knees': ('knee',), 'hips': ('hip',),
         'trunk': ('waist', 'chest', 'head')}
FEET = ('left_foot', 'right_foot')


@dataclasses.dataclass(frozen=True)
class FaintingStart:
    """Initial conditions of a fainting fall."""

    scene: Scene
    lean: np.ndarray
    """(4,) rotation of the whole person about the soles."""
    releases: tuple[tuple[float, str], ...]
    """Times, s, and names of the joint groups that are released, in order of time."""
    towards: float
    """Direction of the lean, rad from forwards to the left."""


def fainting_start(number: int) -> FaintingStart:
    """Start ``number``, from a random generator seeded by it."""
    random = np.random.Generator(np.random.Philox(key=[17, number]))
    sex = SEXES[number % 2]
    (low, _), (height, mass), (high, _) = (PERCENTILES[sex][p] for p in (5, 50, 95))
    size = float(np.clip(random.normal(height, (high - low) / (2 * 1.645)), low, high))
    heavy = mass * (size / height) ** 2 * math.exp(0.12 * float(random.normal()))
    doll = person(size, heavy, sex)
    towards = float(random.uniform(-math.pi, math.pi))
    lean = rotation.from_axis_angle((-math.sin(towards), math.cos(towards), 0.0),
                                    float(random.uniform(0.01, MAX_LEAN)))
    instants = np.cumsum([0.0, *random.uniform(0, MAX_DELAY, len(JOINT_GROUPS) - 1)])
    order = [list(JOINT_GROUPS)[index] for index in random.permutation(len(JOINT_GROUPS))]
    placed = Placement(doll, orientation=tuple(lean), position=(0, 0, 1))
    scene = dataclasses.replace(
        load_scene('woman_faints'), dolls=(placed,), step=STEP,
        material=Material(float(random.uniform(0.4, 0.8)), restitution=0.0))
    return FaintingStart(scene, lean, tuple(zip(instants.tolist(), order, strict=True)), towards)


def jobs(options: RunOptions) -> list[Job]:
    """Jobs of CHUNK falls each."""
    count = QUICK_COUNT if options.quick else COUNT
    return [Job(NAME, f'faints from {first}', functools.partial(
        measure, first, min(first + CHUNK, count)), 0.3 * CHUNK)
        for first in range(0, count, CHUNK)]


def measure(first: int, end: int) -> list[Row]:
    """One row with the values of the falls first ... end - 1."""
    found = [fall_values(fainting_start(number)) for number in range(first, end)]
    return [{'faints': end - first, 'values': {key: [row[key] for row in found]
                                               for key in found[0]}}]


def fall_values(start: FaintingStart) -> dict[str, float]:
    """Vertical speeds at impact, m/s, descent time, s, and direction of the lean, rad; NaN for
    parts that do not hit.
    """
    states, touching = simulate(start)
    phases = find_phases(start.scene, states, touching, FEET, round(ONSET_DURATION / STEP))
    frames, velocities = bone_impacts(states, touching)
    impacts = {part: part_impact(part, start.scene.bone_names, frames, -velocities[:, 2])
               for part in IMPACT_SPEEDS}
    onset = math.nan if phases.onset is None else phases.onset
    return {**{part: float(speed) for part, (_, speed) in impacts.items()},
            'descent': float(impacts['pelvis'][0] - onset) * STEP, 'towards': start.towards}


def simulate(start: FaintingStart) -> tuple[np.ndarray, np.ndarray]:
    """States (t, n, 13) and ground contacts (t, n) of a fall, in ticks of STEP."""
    states, touching, releases = [], [], list(start.releases)
    pelvis = start.scene.bone_index('pelvis')
    with Simulation(start.scene, accuracy='draft', engine='rigid') as simulation:
        _stand(simulation, start)
        simulation.record_impacts(BiomechanicalLimits('none', {}))
        while True:
            state = simulation.state
            states.append(state.rows)
            touching.append(simulation.bones_on_ground
                            | bones_that_hit(start.scene, simulation.impacts, ('ground',)))
            lies = any(flags[pelvis] for flags in touching) and (
                np.linalg.norm(state.linear_velocities, axis=1).max() < LYING_SPEED)
            if lies or simulation.time >= DURATION * SECOND:
                return np.array(states), np.array(touching)
            while releases and releases[0][0] * SECOND <= simulation.time:
                simulation.go_limp(_angles(start.scene.dolls[0].doll, releases.pop(0)[1]))
            simulation.advance()


def _stand(simulation: Simulation, start: FaintingStart) -> None:
    """Place the leaning person with flat soles on the ground and hold all joints."""
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


def _angles(doll: Ragdoll, group: str) -> list[str]:
    """Joint angles of a group and of the arms, which are released with the first group."""
    ends = (*JOINT_GROUPS[group], 'shoulder', 'elbow', 'wrist')
    return [name for joint in doll.joints for name in joint.angle_names if name.endswith(ends)]


def joined(rows: list[Row]) -> dict[str, np.ndarray]:
    """Values of all falls, by quantity."""
    return {key: np.array([np.nan if value is None else float(value)
                           for row in rows for value in row['values'][key]])
            for key in rows[0]['values']}


def falls_tables(rows: list[Row]) -> list[str]:
    """Tables of means, and of shares of falls in which a part hits the ground, beside real falls;
    differences in standard deviations of these.
    """
    values = joined(rows)
    count = len(values['descent'])

    def line(what: str, own: np.ndarray, known: Known) -> Row:
        own = own[np.isfinite(own)]
        return {'what': what, 'mean': float(own.mean()), 'deviation': float(own.std()),
                'of': len(own), 'real': f'{known.mean:.3g} ± {known.deviation:.3g}',
                'off': (own.mean() - known.mean) / known.deviation, 'source': known.source}

    lines = [line(f'vertical speed at impact, {part}, m/s', values[part], known)
             for part, known in IMPACT_SPEEDS.items()]
    lines.append(line('descent, from onset to impact of the pelvis, s', values['descent'], DESCENT))
    shares = [{'what': part, 'mean': float(np.isfinite(values[part]).mean()), 'real': share,
               'source': source} for part, (share, source) in SHARE_THAT_HITS.items()]
    return [f'{count} falls.', table(lines, (
        ('what', 'what', '{}'), ('mean', 'mean', '{:.2f}'), ('deviation', 'SD', '{:.2f}'),
        ('of', 'falls with it', '{}'), ('real', 'real falls', '{}'),
        ('off', 'difference, in their SD', '{:+.1f}'), ('source', 'source', '{}'))),
        table(shares, (('what', 'hits the ground', '{}'), ('mean', 'share of falls', '{:.2f}'),
                       ('real', 'of real falls', '{:.2f}'), ('source', 'source', '{}')))]

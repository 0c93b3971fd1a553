"""CPU time of steps of several engines on the same scenes, as a table in Markdown.

Scenes have friction 0.7 and no restitution, which all engines can represent; nothing sleeps. Ours
are whole ticks of a Simulation with the poses of all bones, those of other engines are steps of
their library alone, N in each tick of 10 ms. How far each is from a reference: ragdoll_report.

python docs/engine_speed.py [--scene drop] [--starts 10]
"""
from __future__ import annotations

import argparse
import dataclasses
import time
from collections.abc import Callable, Iterator

import mujoco
import numpy as np

from ragdoll_ros.accuracy.cases.comparison import with_law
from ragdoll_ros.accuracy.cases.trial import Trial
from ragdoll_ros.accuracy.methods import Method, by_name, installed, ours, run
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model.motors import Motors
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Ground, Material, Placement, Scene
from ragdoll_ros.model.shapes import Box, Capsule
from ragdoll_ros.physics.accuracy import ACCURACIES
from ragdoll_ros.physics.simulation import Simulation

TICKS = 250
PEERS = ('mujoco-implicitfast-1', 'mujoco-implicitfast-4', 'mujoco-implicitfast-10', 'mujoco-rk4-4',
         'bullet-4', 'bullet-10', 'drake-4')

TRUNK, HIP, THIGH, SHANK = 17.0, 1.4, 2.0, 0.3
"""kg, of the parts of a quadruped of some 30 kg."""

UPPER, LOWER, RADIUS = 0.3, 0.3, 0.03
"""m: lengths of thigh and shank, radius of both."""

STIFFNESS, DAMPING = 200.0, 5.0
"""N m/rad and N m s/rad, of its motors."""


def drop(seed: int) -> Scene:
    """The default doll, thrown with up to 1 m/s and 1 rad/s along each axis."""
    return thrown('drop', seed)


def faint(seed: int) -> Scene:
    """The woman, who faints, with up to as much."""
    return thrown('woman_faints', seed)


def thrown(name: str, seed: int) -> Scene:
    """A shipped scene without restitution whose doll has a random velocity and spin."""
    scene, draw = with_law(load_scene(name), 0.0), np.random.default_rng(seed)
    doll = scene.dolls[0]
    moved = dataclasses.replace(doll, velocity=tuple(doll.velocity + draw.uniform(-1, 1, 3)),
                                spin=tuple(doll.spin + draw.uniform(-1, 1, 3)))
    return dataclasses.replace(scene, dolls=(moved,))


def field(seed: int) -> Scene:
    """A hundred default dolls, 2.5 m apart, that fall 0.4 m."""
    one = thrown('drop', seed)
    return dataclasses.replace(one, dolls=tuple(
        dataclasses.replace(one.dolls[0], name=f'doll_{k}',
                            position=(2.5 * (k % 10), 2.5 * (k // 10), one.dolls[0].position[2]))
        for k in range(100)))


SCENES = {'drop': drop, 'woman_faints': faint, 'field of 100': field}


def quadruped() -> Scene:
    """A quadruped with 18 degrees of freedom that stands on four points, held by motors."""
    height = UPPER + LOWER + RADIUS
    bones = [Bone('trunk', Box((0.5, 0.25, 0.15)), TRUNK, (0, 0, height))]
    joints = []
    for name, x, y in legs():
        bones += [Bone(f'{name}_hip', Box((0.08, 0.08, 0.08)), HIP, (x, y, height)),
                  Bone(f'{name}_thigh', Capsule(RADIUS, UPPER), THIGH, (x, y, height - UPPER / 2)),
                  Bone(f'{name}_shank', Capsule(RADIUS, LOWER), SHANK,
                       (x, y, height - UPPER - LOWER / 2))]
        joints += [
            Joint('trunk', f'{name}_hip', 'hinge', (x, y, height), ((1, 0, 0),)),
            Joint(f'{name}_hip', f'{name}_thigh', 'hinge', (x, y, height), ((0, 1, 0),)),
            Joint(f'{name}_thigh', f'{name}_shank', 'hinge', (x, y, height - UPPER), ((0, 1, 0),))]
    doll = Ragdoll('quadruped', tuple(bones), tuple(joints))
    motors = Motors(stiffness=STIFFNESS, damping=DAMPING)
    return Scene('quadruped', (Placement(doll, motors=motors),), Ground(),
                 Material(friction=0.7, restitution=0.0))


def legs() -> Iterator[tuple[str, float, float]]:
    """Name and place, x and y in m, of each leg."""
    for front, x in (('front', 0.3), ('hind', -0.3)):
        for side, y in (('left', 0.2), ('right', -0.2)):
            yield f'{front}_{side}', x, y


def quadruped_mjcf(step: float) -> str:
    """The same robot for MuJoCo, in steps of ``step`` s."""
    height, inner, motors = UPPER + LOWER + RADIUS, [], []
    for name, x, y in legs():
        inner.append(f"""
      <body pos="{x} {y} 0"><joint name="{name}_a" axis="1 0 0"/>
        <geom type="box" size=".04 .04 .04" mass="{HIP}"/>
        <body><joint name="{name}_b" axis="0 1 0"/>
          <geom type="capsule" size="{RADIUS}" fromto="0 0 0 0 0 {-UPPER}" mass="{THIGH}"/>
          <body pos="0 0 {-UPPER}"><joint name="{name}_c" axis="0 1 0"/>
            <geom type="capsule" size="{RADIUS}" fromto="0 0 0 0 0 {-LOWER}" mass="{SHANK}"/>
      </body></body></body>""")
        motors += [f'<position joint="{name}_{angle}" kp="{STIFFNESS}" kv="{DAMPING}"/>'
                   for angle in 'abc']
    return f"""<mujoco><option timestep="{step}" integrator="implicitfast" cone="elliptic"/>
  <default><geom friction=".7"/></default><worldbody><geom type="plane" size="9 9 1"/>
    <body pos="0 0 {height}"><freejoint/>
      <geom type="box" size=".25 .125 .075" mass="{TRUNK}"/>{''.join(inner)}
    </body></worldbody><actuator>{''.join(motors)}</actuator></mujoco>"""


def least(advance: Callable[[], object], times: int = 5, count: int = 200) -> float:
    """Least mean CPU time of a call, s, of several runs of ``count``."""
    def mean() -> float:
        began = time.process_time()
        for _ in range(count):
            advance()
        return (time.process_time() - began) / count
    return min(mean() for _ in range(times))


def methods() -> list[Method]:
    """Ours, which do not sleep, and the others that are installed."""
    awake = [ours(dataclasses.replace(accuracy, sleep=False), f'rigid-{name}')
             for name, accuracy in ACCURACIES.items()]
    return [*awake, *map(by_name, installed(PEERS))]


def compare(name: str, starts: int) -> None:
    """Print the rows of a scene: mean over starts, relative to MuJoCo with four steps a tick."""
    count = max(1, starts // 5) if name == 'field of 100' else starts
    trials = [Trial(SCENES[name](seed), TICKS * 0.01) for seed in range(count)]
    found = {}
    for method in methods():
        if method.family == 'Drake' and name != 'drop':
            continue  # its translation has one doll, without passive torques
        run(method, trials[0])
        results = [run(method, trial) for trial in trials]
        lasted = all(result.trajectory.finite and
                     np.abs(result.trajectory.linear_velocities).max() < 100 for result in results)
        found[method.label] = np.mean([result.costs.mean() for result in results]), lasted
    base = found['MuJoCo implicitfast N = 4'][0]
    for label, (cost, lasted) in found.items():
        print(f'| `{name}` | {label} | {1e6 * cost:.0f} | {cost / base:.2f} '
              f'{"" if lasted else "(diverged) "}|', flush=True)


def compare_standing() -> None:
    """Print the rows of the quadruped, which stands: time of a tick, and of a step."""
    rows = {}
    for name, accuracy in ACCURACIES.items():
        with Simulation(quadruped(), accuracy=dataclasses.replace(accuracy, sleep=False)) as own:
            own.run(300)
            before = own.ledger()['steps']
            rows[f'rigid {name}'] = least(own.advance), (own.ledger()['steps'] - before) / 1000
            assert own.state.positions[0, 2] > 0.55, 'it stands'
    for count in (1, 4, 10):
        model = mujoco.MjModel.from_xml_string(quadruped_mjcf(0.01 / count))
        data = mujoco.MjData(model)
        for _ in range(300 * count):
            mujoco.mj_step(model, data)
        assert data.qpos[2] > 0.55, 'it stands'

        def tick(model: mujoco.MjModel = model, data: mujoco.MjData = data,
                 count: int = count) -> None:
            for _ in range(count):
                mujoco.mj_step(model, data)
        rows[f'MuJoCo implicitfast N = {count}'] = least(tick), count
    base = rows['MuJoCo implicitfast N = 4'][0]
    for label, (cost, steps) in rows.items():
        print(f'| quadruped stands | {label} | {1e6 * cost:.0f}, {1e6 * cost / steps:.1f} a step '
              f'| {cost / base:.2f} |', flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--scene', choices=[*SCENES, 'quadruped'], action='append')
    parser.add_argument('--starts', type=int, default=10)
    options = parser.parse_args()
    print('| scene | engine | µs a tick | over MuJoCo N = 4 |\n| --- | --- | --- | --- |')
    for name in options.scene or [*SCENES, 'quadruped']:
        if name == 'quadruped':
            compare_standing()
        else:
            compare(name, options.starts)


if __name__ == '__main__':
    main()

"""CPU time of a tick of a falling doll beside an arm of 8 meshes: as boxes, as one hull or more.

python test/hull_cost.py
"""
from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import trimesh
from robot_cost import COMMANDS, NAMES, TICKS
from test_hull_decomposition import bracket

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.physics.simulation import Simulation

RUNS, LINKS = 5, 8

MESHES = {'bracket': bracket(), 'ring': trimesh.creation.torus(0.2, 0.06)}
"""Each is scaled to 15 cm."""

DISTANCES = {'out of reach': 3.0, 'in reach': 0.35}
"""m from the doll to the arm."""

LINK = ('<link name="link_{}"><collision><geometry><mesh filename="part.stl" scale="{} {} {}"/>'
        '</geometry></collision></link>')
JOINT = ('<joint name="joint_{}" type="revolute"><parent link="link_{}"/><child link="link_{}"/>'
         '<origin xyz="0 0 0.15"/><axis xyz="{} {} 0"/><limit lower="-3" upper="3"/></joint>')


def simulation(folder: Path, mesh: trimesh.Trimesh, kind: str, distance: float) -> Simulation:
    """Of the doll and the arm, at draft."""
    scale = 0.15 / max(mesh.extents)
    mesh.export(folder / 'part.stl')
    (folder / 'arm.urdf').write_text('<robot name="arm">' + ''.join(
        LINK.format(k, scale, scale, scale) for k in range(LINKS)) + ''.join(
        JOINT.format(k, k - 1, k, k % 2, (k + 1) % 2) for k in range(1, LINKS)) + '</robot>')
    (folder / 'scene.yaml').write_text(
        'ground: {}\ndolls: [{doll: doll}]\nbodies:\n'
        f'  - {{name: arm, urdf: arm.urdf, meshes: {kind}, follow: exact, '
        f'position: [{distance}, 0, 0]}}\n')
    return Simulation(load_scene(str(folder / 'scene.yaml')), accuracy='draft')


def cost(made: Simulation, arm: bool) -> float:
    """CPU time of a tick, s."""
    made.reset()
    begun = time.process_time()
    for angles, rates in COMMANDS:
        if arm:
            made.drive_body('arm', joint_angles=angles, rates=rates)
        made.advance()
    return (time.process_time() - begun) / TICKS


def main() -> None:
    """Print the least of several runs in turn, in us."""
    assert len(NAMES) == LINKS - 1
    cases = {('the doll alone', '', ''): Simulation(load_scene('drop'), accuracy='draft')}
    with tempfile.TemporaryDirectory() as folder:
        for name, mesh in MESHES.items():
            for kind in ('box', 'hull', 'hulls'):
                for place, distance in DISTANCES.items():
                    cases[name, kind, place] = simulation(Path(folder), mesh, kind, distance)
    least = dict.fromkeys(cases, math.inf)
    for _ in range(RUNS):
        for case, made in cases.items():
            least[case] = min(least[case], cost(made, bool(case[1])))
    for case, seconds in least.items():
        faces = sum(len(part.shape.mesh()[1]) for doll in cases[case].scene.dolls[1:]
                    for part in doll.doll.root.shape.parts) // LINKS
        print(f'{" ".join(case):30} {1e6 * seconds:6.0f} us, {faces} triangles a link')


if __name__ == '__main__':
    main()

"""The scene `pile` by Jolt, beside the rows of `python -m ragdoll_ros.accuracy.crowds --part pile`.

    npm install jolt-physics
    python test/jolt_pile.py node_modules/jolt-physics/dist/jolt-physics.wasm-compat.js

Jolt in WebAssembly, one thread: natively it is faster. Its universal joints are swings within a
pyramid without twist, so nothing is told of limits; its joints are not damped; it bounces above
1 m/s only. A tick is one step of 10 ms, or as many as --steps says.
"""
from __future__ import annotations

import argparse
import json
import subprocess
from pathlib import Path

import numpy as np

from ragdoll_ros.accuracy.crowds.depth import BoneDepth
from ragdoll_ros.accuracy.crowds.pile import DEPTH_INTERVAL, DURATION, HEAD, Outcome, record_depths
from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.ragdoll import joint_axes
from ragdoll_ros.model.scene import Scene
from ragdoll_ros.model.shapes import Sphere
from ragdoll_ros.model.state import State
from ragdoll_ros.physics.ground_heights import GroundHeights

SCRIPT = Path(__file__).with_name('jolt_pile.mjs')


def bones(scene: Scene) -> list[dict]:
    made = []
    for number, placement in enumerate(scene.dolls):
        for part, bone in enumerate(placement.doll.bones):
            pose, sphere = placement.bone_pose(bone), isinstance(bone.shape, Sphere)
            made.append({
                'half': [bone.shape.radius] if sphere else list(bone.shape.half_extents),
                'mass': bone.mass, 'doll': number, 'part': part,
                'position': list(pose.position), 'orientation': list(pose.orientation)})
    return made


def joints(scene: Scene) -> list[dict]:
    """In the world; ``across`` is perpendicular to all axes."""
    made = []
    for placement in scene.dolls:
        for joint in placement.doll.joints:
            axes = [rotation.rotate(placement.orientation, axis) for axis in joint_axes(joint)]
            second = axes[1] if len(axes) > 1 else np.eye(3)[np.abs(axes[0]).argmin()]
            across = np.cross(axes[0], second)
            anchor = placement.position + rotation.rotate(placement.orientation, joint.anchor)
            names = (scene.qualified(placement, name) for name in (joint.parent, joint.child))
            made.append({**dict(zip(('parent', 'child'), map(scene.bone_index, names),
                                    strict=True)),
                         'axes': [axis.tolist() for axis in axes], 'anchor': anchor.tolist(),
                         'across': (across / np.linalg.norm(across)).tolist(),
                         'limits': joint.angle_limits})
    return made


def told(scene: Scene, steps: int) -> str:
    doll = scene.dolls[0].doll
    names = [bone.name for bone in doll.bones]
    return json.dumps({
        'gravity': scene.gravity, 'friction': scene.material.friction, 'step': scene.step,
        'restitution': scene.material.restitution, 'ticks': round(DURATION / scene.step),
        'looks': DEPTH_INTERVAL, 'collision_steps': steps, 'parts': len(names),
        'bones': bones(scene),
        'joints': joints(scene),
        'apart': [[names.index(joint.parent), names.index(joint.child)] for joint in doll.joints]})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('module', type=Path, help='jolt-physics.wasm-compat.js of the npm package')
    parser.add_argument('--steps', type=int, default=1, help='steps of Jolt in a tick')
    given = parser.parse_args()
    scene = load_scene('pile')
    scale, heights = BoneDepth(scene), GroundHeights(scene)
    outcome = Outcome(overshoot=np.nan, cpu=np.nan)
    done = subprocess.run(['node', SCRIPT, given.module.resolve()], input=told(scene, given.steps),
                          capture_output=True, text=True, check=True)
    for tick, line in enumerate(done.stdout.splitlines()):
        one = json.loads(line)
        outcome.costs.append(one['seconds'])
        if not one['awake']:
            outcome.asleep = min(outcome.asleep, (tick + 1) * scene.step)
        if 'poses' in one:
            poses = np.array(one['poses'])
            still = np.zeros((len(poses), 3))
            record_depths(outcome, heights, scale,
                          State(poses[:, :3], poses[:, 3:], still, still))
    print(f'{HEAD}\n{f"Jolt, steps {given.steps}":30}{outcome.row()}')


if __name__ == '__main__':
    main()

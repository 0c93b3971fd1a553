"""Random scenes, reproducible: spheres, boxes, cylinders and capsules; any joints, masses,
materials, motions.
"""
import math

import numpy as np

from ...model import rotation
from ...model.push import Push
from ...model.ragdoll import JOINT_KINDS, Bone, Joint, Ragdoll
from ...model.scene import Ground, Material, Placement, Scene
from ...model.shapes import Box, Capsule, Cylinder, Shape, Sphere
from .trial import Trial

DURATION = 3.0
"""s"""


def fuzzed(number: int) -> Trial:
    """Random scene ``number``: up to three dolls of up to eight bones, all thrown, one pushed."""
    rng = np.random.default_rng([12, number])
    dolls = tuple(_placed(rng, f'doll_{k}', k) for k in range(rng.integers(1, 4)))
    material = Material(float(rng.choice((0.0, 0.1, 0.5, 1.0, math.inf))),
                        float(rng.choice((0.0, 0.01))), float(rng.choice((0.0, 0.5, 0.9))))
    ground = Ground() if rng.random() < 0.9 else None
    scene = Scene(f'fuzzed_{number}', dolls, ground, material,
                  gravity=(0.0, 0.0, -float(rng.choice((1.6, 9.8, 25.0)))),
                  step=float(rng.choice((0.002, 0.01, 0.02))),
                  self_collision=bool(rng.random() < 0.8))
    doll = dolls[0].doll
    force = rng.normal(size=3) * 20 * doll.mass
    push = Push(scene.bone_names[0], tuple(force), start=0.2, duration=0.4)
    return Trial(scene, DURATION, None, (push,))


def _placed(rng: np.random.Generator, name: str, index: int) -> Placement:
    doll = _doll(rng, name)
    size = sum(2 * max(bone.shape.half_extents) for bone in doll.bones)
    return Placement(doll, name, (1.5 * index, float(rng.uniform(-0.5, 0.5)), size + 0.1),
                     tuple(rotation.normalized(rng.normal(size=4))),
                     tuple(rng.normal(size=3) * 2), tuple(rng.normal(size=3) * 3))


def _doll(rng: np.random.Generator, name: str) -> Ragdoll:
    """A tree of bones, each placed outwards of its parent; masses over three decades."""
    bones, joints = [], []
    for index in range(rng.integers(1, 9)):
        shape, mass = _shape(rng), float(10 ** rng.uniform(-1.5, 1.5))
        orientation = tuple(rotation.normalized(rng.normal(size=4)))
        if not bones:
            bones.append(Bone('bone_0', shape, mass, (0.0, 0.0, 0.0), orientation))
            continue
        parent = bones[rng.integers(len(bones))]
        direction = rotation.normalized(rng.normal(size=3))
        anchor = np.array(parent.position) + direction * max(parent.shape.half_extents)
        bones.append(Bone(f'bone_{index}', shape, mass,
                          tuple(anchor + direction * max(shape.half_extents)), orientation))
        joints.append(_joint(rng, parent.name, f'bone_{index}', tuple(anchor)))
    return Ragdoll(name, tuple(bones), tuple(joints))


def _shape(rng: np.random.Generator) -> Shape:
    sizes = rng.uniform(0.03, 0.2, 3)
    return (Sphere(sizes[0]), Box(tuple(2 * sizes)), Cylinder(sizes[0], 2 * sizes[1]),
            Capsule(sizes[0], 2 * sizes[1]))[rng.integers(4)]


def _joint(rng: np.random.Generator, parent: str, child: str, anchor: tuple[float, ...]) -> Joint:
    kind = JOINT_KINDS[str(rng.choice(list(JOINT_KINDS)))]
    axes = [tuple(axis) for axis in np.linalg.qr(rng.normal(size=(3, 3)))[0][:kind.axes]]
    reach = [float(angle) for angle in rng.uniform(0.1, 1.4, kind.limits)]
    limits = () if rng.random() < 0.2 or kind.name == 'fixed' else tuple(
        (-angle, angle) for angle in reach)
    return Joint(parent, child, kind.name, anchor, tuple(axes), limits,
                 float(10 ** rng.uniform(-3, 0)))

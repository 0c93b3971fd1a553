"""Hard cases: scenes that break simulations, each with its requirements."""
import dataclasses
import itertools
import math

from ...files.doll import load_doll
from ...files.scene import load_scene
from ...model.push import Push
from ...model.ragdoll import Bone, Joint, Ragdoll
from ...model.shapes import Box, Capsule, Cylinder, Sphere
from . import starts
from .contact_cases import contact_cases
from .trial import HardCase, Requirements, Trial, drop, posed


def hard_cases() -> list[HardCase]:
    """All cases that are one trial with requirements; parts/hard.py has the others."""
    return [
        HardCase('flat and tiny bodies, inertia 1e-9', lambda: drop(_flat_and_tiny(), 0.3)),
        HardCase('start 0.2 m inside the floor', _inside_floor,
                 Requirements(sinking_m=None, lift_m=0.2, max_speed_m_s=6.0)),
        HardCase('start in a self-overlap', _self_overlap),
        HardCase('start outside the limits', lambda: _longer(starts.trial('start outside', 0), 16)),
        HardCase('limits of 2°', lambda: drop(_narrow(math.radians(2)))),
        HardCase('chain of 30, heavy tip', _heavy_chain),
        HardCase('drop 10 m', lambda: drop(load_doll('doll'), 10.0, 9.0)),
        HardCase('drop 50 m', lambda: drop(load_doll('doll'), 50.0, 11.0)),
        HardCase('hits the ground at 100 m/s', lambda: drop(
            load_doll('doll'), 1.0, 20.0, velocity=(20.0, 0.0, -100.0))),
        HardCase('2 kN for 3 s', lambda: _pulled(2e3)),
        HardCase('20 kN for 3 s', lambda: _pulled(2e4), Requirements(rest=False),
                 reason='the torso comes near 1000 m/s; position correction removes half of the '
                        'penetration of bones in each step.'),
        HardCase('wrung by 300 N m for 3 s', _wrung),
        HardCase('ticks of 1/30 s', lambda: drop(load_doll('doll'), tick=1 / 30)),
        HardCase('ticks of 1/500 s', lambda: drop(load_doll('doll'), tick=1 / 500)),
        HardCase('scale 0.01', lambda: _scaled(0.01), scale=0.01),
        HardCase('scale 100', lambda: _scaled(100.0), scale=100.0),
        HardCase('10 km from the origin', lambda: drop(load_doll('doll'), at=(1e4, 0.0))),
        HardCase('spin 20 rad/s', lambda: _longer(starts.trial('spin 20 rad/s', 0), 8)),
        HardCase('limit slams', lambda: _longer(starts.trial('limit slam', 0), 8)),
        HardCase('all shapes and joints', lambda: drop(_all_sorts())),
        *contact_cases()]


def _longer(trial: Trial, duration: float) -> Trial:
    return dataclasses.replace(trial, duration=duration)


def _narrow(angle: float) -> Ragdoll:
    doll = load_doll('doll')
    return dataclasses.replace(doll, joints=tuple(
        dataclasses.replace(joint, limits=((-angle, angle),) * len(joint.limits))
        for joint in doll.joints))


def _flat_and_tiny() -> Ragdoll:
    """A sheet of 0.1 mm with two spheres of 1 g hinged to its edges."""
    grain = Sphere(0.0016)
    bones = (Bone('sheet', Box((0.2, 0.2, 1e-4)), 0.01, (0.0, 0.0, 0.0)),
             Bone('left', grain, 0.001, (0.0, 0.11, 0.0)),
             Bone('right', grain, 0.001, (0.0, -0.11, 0.0)))
    joints = tuple(Joint('sheet', name, 'hinge', (0.0, y, 0.0), ((1.0, 0.0, 0.0),),
                         ((-1.0, 1.0),)) for name, y in (('left', 0.105), ('right', -0.105)))
    return Ragdoll('sheet', bones, joints)


def _inside_floor() -> Trial:
    scene = load_scene('drop')
    placement = dataclasses.replace(scene.dolls[0], position=(0.0, 0.0, -0.6))
    return Trial(dataclasses.replace(scene, dolls=(placement,)), 8.0)


def _self_overlap() -> Trial:
    """Both forearms folded into the sides of the torso, thighs crossed."""
    scene = load_scene('drop')
    angles = {'left_upper_arm_2': math.radians(-80), 'right_upper_arm_2': math.radians(80),
              'left_forearm': math.radians(-120), 'right_forearm': math.radians(120),
              'left_thigh_2': math.radians(-17), 'right_thigh_2': math.radians(17)}
    return Trial(scene, 8.0, starts.lifted(scene, posed(scene.dolls[0], angles), 0.4))


def _heavy_chain() -> Trial:
    """A chain of 29 rods of 0.1 kg with 100 kg at the end, dropped from 2 m."""
    length = 0.1
    rods = [Bone(f'rod_{i}', Box((length, 0.04, 0.04)), 0.1, (i * length, 0.0, 0.0))
            for i in range(29)]
    # Without rolling friction the ball would roll forever.
    tip = Bone('tip', Sphere(0.1), 100.0, (29 * length + 0.05, 0.0, 0.0), rolling_friction=0.01)
    names = [bone.name for bone in (*rods, tip)]
    joints = tuple(Joint(a, b, 'universal', ((i + 0.5) * length, 0.0, 0.0),
                         ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), ((-1.0, 1.0), (-1.0, 1.0)), 0.02)
                   for i, (a, b) in enumerate(itertools.pairwise(names)))
    return drop(Ragdoll('chain', (*rods, tip), joints), 2.0, 10.0)


def _pulled(force: float) -> Trial:
    scene = load_scene('drop')
    pull = Push('torso', (-force, 0.0, 1.0), start=0.2, duration=3.0)
    return Trial(scene, 30.0, None, (pull,))


def _wrung() -> Trial:
    scene = load_scene('drop')
    wring = Push('left_upper_arm', torque=(120.0, -240.0, 134.0), start=0.2, duration=3.0)
    return Trial(scene, 20.0, None, (wring,))


def _scaled(scale: float) -> Trial:
    """A drop of the default doll at ``scale`` times its size and the same density; height, duration
    and damping are scaled as well.
    """
    def point(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(scale * value for value in values)

    doll = load_doll('doll')
    bones = []
    for bone in doll.bones:
        sizes = {key: point(value) if isinstance(value, tuple) else scale * value
                 for key, value in vars(bone.shape).items()}
        bones.append(dataclasses.replace(bone, shape=type(bone.shape)(**sizes),
                                         mass=bone.mass * scale ** 3,
                                         position=point(bone.position)))
    # Damping times length^4.5 keeps the motion the same in dimensionless units.
    joints = tuple(dataclasses.replace(joint, anchor=point(joint.anchor),
                                       damping=joint.damping * scale ** 4.5)
                   for joint in doll.joints)
    doll = dataclasses.replace(doll, bones=tuple(bones), joints=joints)
    tick = min(0.01, 0.01 * math.sqrt(scale))
    return drop(doll, 0.4 * scale, 8.0 * math.sqrt(scale), tick)


def _all_sorts() -> Ragdoll:
    """A box, a ball, a capsule, a cylinder and a plate, with every kind of joint."""
    bones = (Bone('box', Box((0.2, 0.2, 0.3)), 5.0, (0.0, 0.0, 0.5)),
             Bone('ball', Sphere(0.1), 2.0, (0.0, 0.0, 0.8)),
             Bone('capsule', Capsule(0.05, 0.2), 1.0, (0.0, 0.3, 0.5)),
             Bone('cylinder', Cylinder(0.06, 0.2), 1.0, (0.0, -0.3, 0.5)),
             Bone('plate', Box((0.3, 0.1, 0.02)), 1.0, (0.35, 0.0, 0.5)))
    joints = (Joint('box', 'ball', 'ball', (0.0, 0.0, 0.68), ((0.0, 0.0, 1.0),),
                    ((-0.8, 0.8), (-0.5, 0.5)), 0.1),
              Joint('box', 'capsule', 'universal', (0.0, 0.18, 0.5),
                    ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)), ((-1.0, 1.0), (-1.0, 1.0)), 0.1),
              Joint('box', 'cylinder', 'hinge', (0.0, -0.18, 0.5), ((1.0, 0.0, 0.0),),
                    ((-1.0, 1.0),), 0.1),
              Joint('box', 'plate', 'fixed', (0.15, 0.0, 0.5)))
    return Ragdoll('all_sorts', bones, joints)

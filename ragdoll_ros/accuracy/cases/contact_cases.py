"""Hard contact cases: mass ratios, stacks, piles, collisions of dolls, extreme friction."""
import dataclasses
import math

from ...files.doll import load_doll
from ...files.scene import load_scene
from ...model import rotation
from ...model.push import Push
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Ground, Material, Placement, Scene
from ...model.shapes import Box, Sphere
from . import starts
from .trial import HardCase, Requirements, Trial, drop, posed

COLLISIONS = (2.0, 6.0, 20.0, 60.0)
"""Approach speeds, m/s, of two dolls in the air."""

MOMENTUM_TOLERANCE = 1e-9
"""Largest relative drift of momentum in a collision in the air."""

FRICTIONS = (0.0, 0.1, 1.0, 10.0, math.inf)


def contact_cases() -> list[HardCase]:
    """All hard contact cases."""
    in_air = Requirements(rest=False, max_momentum_drift=MOMENTUM_TOLERANCE)
    stays = Requirements(max_displacement_m=1e-3)
    return [
        # What hangs from the heavy head swings for 9 s, until the joint damping ends it.
        HardCase('mass ratio 1:100', lambda: _weighted(100, 'head')),
        HardCase('mass ratio 1:1000', lambda: _weighted(1000, 'head')),
        HardCase('torso 1000 times as heavy', lambda: _weighted(1000, 'torso')),
        HardCase('torso 1000 times as light', lambda: _weighted(1e-3, 'torso')),
        HardCase('shins 1000 times as heavy',
                 lambda: _weighted(1000, 'left_shin', 'right_shin')),
        *(HardCase(f'two dolls at {speed:g} m/s in the air',
                   lambda speed=speed: two_dolls(speed), in_air) for speed in COLLISIONS),
        HardCase('ball of 1 g against the doll', _light_ball),
        HardCase('stack of five boxes', lambda: _stack((1.0,) * 5), stays),
        HardCase('100 kg on 1 kg', lambda: _stack((1.0, 100.0)), stays),
        HardCase('pile of ten dolls, 60 s', lambda: pile(60.0)),
        HardCase('jammed limbs', _jammed),
        *(HardCase(f'friction {friction:g}', lambda friction=friction: _on_friction(friction),
                   Requirements(rest=friction > 0)) for friction in FRICTIONS)]


def _weighted(ratio: float, *names: str) -> Trial:
    doll = load_doll('doll')
    for name in names:
        doll = doll.replace_bone(name, mass=ratio * doll.bone(name).mass)
    return drop(doll, duration=12.0)


def two_dolls(speed: float) -> Trial:
    """Two dolls that fly sideways at each other, without gravity; their first contact is at 0.1 s +
    0.5 m / ``speed``.
    """
    doll = load_doll('doll')
    apart = 1.2 + 0.1 * speed
    left = Placement(doll, 'left', (0.0, apart / 2, 0.0), velocity=(0.0, -0.45 * speed, 0.0))
    right = Placement(doll, 'right', (0.05, -apart / 2, 0.1), velocity=(0.0, 0.55 * speed, 0.0))
    scene = Scene('collision', (left, right), None, Material(restitution=0.5),
                  gravity=(0.0, 0.0, 0.0))
    return Trial(scene, round(0.4 + 2.0 / speed, 2))


def _light_ball() -> Trial:
    ball = Ragdoll('ball', (Bone('ball', Sphere(0.05), 0.001, (0.0, 0.0, 0.0),
                                 rolling_friction=0.01),))
    scene = load_scene('drop')
    thrown = Placement(ball, position=(2.0, 0.0, 1.1), velocity=(-5.0, 0.0, 0.6))
    return Trial(dataclasses.replace(scene, dolls=(*scene.dolls, thrown)), 12.0)


def _stack(masses: tuple[float, ...]) -> Trial:
    """A stack of 20 cm boxes, the lowest first, each slightly offset; it must not move."""
    edge = 0.2
    dolls = tuple(Placement(Ragdoll(f'box_{k}', (Bone('box', Box((edge,) * 3), mass, (0, 0, 0)),)),
                            position=(0.01 * (-1) ** k, 0.0, (k + 0.5) * edge))
                  for k, mass in enumerate(masses))
    return Trial(Scene('stack', dolls, Ground(), Material(restitution=0.0)), 10.0)


def pile(duration: float) -> Trial:
    """Ten dolls dropped onto each other."""
    scene = load_scene('drop')
    doll = scene.dolls[0].doll
    placements = tuple(Placement(doll, f'doll_{i}', (0.02 * i, 0.03 * (-1) ** i, 2.0 * i),
                                 tuple(rotation.from_rpy(0.0, 0.0, 0.7 * i))) for i in range(10))
    return Trial(dataclasses.replace(scene, name='pile', dolls=placements), duration)


def _jammed() -> Trial:
    """Limbs folded against the body, joint angles limited to ±1 degree, and 1000 N down on the
    torso.
    """
    scene = load_scene('drop')
    angles = {'left_upper_arm_2': math.radians(-60), 'right_upper_arm_2': math.radians(60),
              'left_forearm': math.radians(-110), 'right_forearm': math.radians(110)}
    doll = scene.dolls[0].doll
    narrow = math.radians(1)
    joints = tuple(dataclasses.replace(joint, limits=tuple(
        (angles.get(name, 0.0) - narrow, angles.get(name, 0.0) + narrow)
        for name in joint.angle_names)) for joint in doll.joints)
    placement = dataclasses.replace(scene.dolls[0], doll=dataclasses.replace(doll, joints=joints))
    scene = dataclasses.replace(scene, dolls=(placement,))
    start = starts.lifted(scene, posed(placement, angles), 0.2)
    return Trial(scene, 12.0, start, (Push('torso', (0.0, 0.0, -1000.0), start=1.0, duration=2.0),))


def _on_friction(friction: float) -> Trial:
    trial = drop(load_doll('doll'), duration=12.0)
    material = dataclasses.replace(trial.scene.material, friction=friction)
    return dataclasses.replace(trial, scene=dataclasses.replace(trial.scene, material=material))

"""Reference motions in flight: falls, throws, a tumbling box, chains, the doll."""
import dataclasses
import math

import numpy as np

from ...files.doll import load_doll
from ...files.scene import load_scene
from ...model import rotation
from ...model.coordinates import GeneralizedState
from ...model.push import Push
from ...model.ragdoll import Bone, Joint, Ragdoll
from ...model.scene import Placement, Scene
from ...model.shapes import Box
from ..cases.trial import Trial, angle_indices, inner_angles, posed
from ..references.articulated import Articulated, torque_free_rotation
from ..references.closed_forms import fall
from ..references.planar_chain import PlanarChain
from ..trajectory import Trajectory
from .motion import ReferenceMotion, airborne_scene, orientations_about, without_limits

EQUATIONS = 'equations of motion of the tree, DOP853 at 1e-12'
GENTLE = {'velocity': (1.0, 0.5, 2.0), 'spin': (0.5, -0.5, 1.0)}


def flight_motions() -> list[ReferenceMotion]:
    """All reference motions in flight."""
    return [free_fall(), projectile(), first_touch(), tumbling_box(),
            *map(chain, (2, 5, 10)), gentle_flight(), long_flight(), fast_flight(), pushed_flight()]


def free_fall() -> ReferenceMotion:
    """The doll in free fall from rest: no joint moves."""
    return _rigid_fall('free_fall', 'Free fall, 1 s', _thrown((0.0, 0.0, 0.0)))


def projectile() -> ReferenceMotion:
    """The doll thrown without rotation."""
    return _rigid_fall('projectile', 'Throw without spin, 1 s', _thrown((3.0, 1.0, 4.0)))


def first_touch() -> ReferenceMotion:
    """The default drop without spin, up to just before the first contact at 0.2857 s."""
    scene = load_scene('drop')
    even = dataclasses.replace(scene.dolls[0], spin=(0.0, 0.0, 0.0))
    return _rigid_fall('drop_to_touch', 'The default drop, even, up to the first touch, 0.28 s',
                       dataclasses.replace(scene, dolls=(even,)), 0.28, 'x0 + g t²/2')


def _thrown(velocity: tuple[float, float, float]) -> Scene:
    return Scene('thrown', (Placement(load_doll('doll'), velocity=velocity),))


def _rigid_fall(name: str, title: str, scene: Scene, duration: float = 1.0,
                formula: str = 'x0 + v0 t + g t²/2') -> ReferenceMotion:
    placement, = scene.dolls
    start = np.array([placement.bone_pose(bone)[0] for bone in scene.bones])

    def truth(times: np.ndarray) -> Trajectory:
        displacement = fall(np.zeros(3), np.array(placement.velocity), np.array(scene.gravity),
                            times)
        return Trajectory.of_poses(times, start + displacement[:, None])
    return ReferenceMotion(name, title, formula, Trial(scene, duration), truth)


def tumbling_box() -> ReferenceMotion:
    """A box with moments 1 : 2 : 3 rotating about its intermediate axis, which is unstable."""
    bone = Bone('box', Box((0.2 * math.sqrt(2), 0.2, 0.002)), 1.0, (0.0, 0.0, 0.0))
    omega = (0.05, 8.0, 0.05)
    scene = airborne_scene(Ragdoll('box', (bone,)), (0.0, 0.0, 0.0), spin=omega)

    def truth(times: np.ndarray) -> Trajectory:
        orientations, _ = torque_free_rotation(bone.inertia, omega, times)
        return Trajectory.of_poses(times, np.zeros((len(times), 1, 3)), orientations[:, None])
    return ReferenceMotion('tumbling_box', 'Tumbling box, moments 1 : 2 : 3, 8 rad/s, 5 s',
                           "Euler's equations, DOP853 at 1e-12", Trial(scene, 5.0), truth,
                           'angle_worst_rad')


def chain(links: int, length: float = 0.2, mass: float = 1.0) -> ReferenceMotion:
    """A free chain of rods that moves in a plane and coils up."""
    rods = tuple(Bone(f'rod_{i}', Box((length, 0.04, 0.03)), mass, (i * length, 0.0, 0.0))
                 for i in range(links))
    joints = tuple(Joint(f'rod_{i - 1}', f'rod_{i}', 'hinge', ((i - 0.5) * length, 0.0, 0.0),
                         ((0.0, 0.0, 1.0),)) for i in range(1, links))
    doll = Ragdoll(f'chain_{links}', rods, joints)
    angles, rates = np.linspace(0.0, 1.0, links), np.linspace(3.0, -3.0, links)
    planar = PlanarChain(links, length, mass, rods[0].inertia[2])
    names = [joint.angle_names[0] for joint in joints]
    start = posed(Placement(doll), dict(zip(names, np.diff(angles), strict=True)),
                  dict(zip(names, np.diff(rates), strict=True)))
    start.v[5] = rates[0]
    start.v[:3] = -Articulated(doll).state(start.q, start.v).linear_velocities.mean(axis=0)

    def truth(times: np.ndarray) -> Trajectory:
        centres, phi = planar.motion(angles, rates, times)
        flat = np.concatenate([centres, np.zeros((*centres.shape[:2], 1))], axis=2)
        return Trajectory.of_poses(times, flat, orientations_about((0.0, 0.0, 1.0), phi))
    return ReferenceMotion(f'chain_{links}', f'Thrown chain of {links} rods, 1 s',
                           "Lagrange's equations in the plane, DOP853 at 1e-12",
                           Trial(airborne_scene(doll, (0.0, 0.0, 0.0)), 1.0, start), truth)


def gentle_flight() -> ReferenceMotion:
    """The default doll with slowly moving limbs, for the flight time of the default drop."""
    doll = load_doll('doll')
    placement = Placement(doll, **GENTLE)
    trial = Trial(Scene('gentle', (placement,)), 0.28,
                  posed(placement, *_inside_limits(doll, speed=1.0, seed=1)))
    return ReferenceMotion('flight_gentle', 'The doll in gentle flight, 0.28 s', EQUATIONS, trial,
                           _articulated(trial))


def long_flight() -> ReferenceMotion:
    """As gentle_flight(), for 2 s and without joint limits."""
    return _without_limits('flight_long', 'The doll in gentle flight, 2 s, limits off', 2.0,
                           speed=1.0, seed=1, **GENTLE)


def fast_flight() -> ReferenceMotion:
    """The doll spinning at 20 rad/s, limbs at up to 5 rad/s, without limits."""
    return _without_limits('flight_fast', 'The doll spun at 20 rad/s, 0.28 s, limits off', 0.28,
                           speed=5.0, seed=2,
                           spin=tuple(20 * rotation.normalized(np.array((1.0, 2.0, 2.0)))))


def _without_limits(name: str, title: str, duration: float, speed: float, seed: int,
                    **placed: object) -> ReferenceMotion:
    limited = load_doll('doll')
    doll = without_limits(limited)
    trial = Trial(airborne_scene(doll, **placed), duration,
                  posed(Placement(doll, **placed), *_inside_limits(limited, speed, seed)))
    return ReferenceMotion(name, title, EQUATIONS, trial, _articulated(trial))


def pushed_flight() -> ReferenceMotion:
    """2000 N on the torso for 0.1 s in flight, without limits."""
    doll = without_limits(load_doll('doll'))
    push = Push('torso', (-2000.0, 0.0, 1.0), start=0.05, duration=0.1)
    trial = Trial(airborne_scene(doll), 0.3, posed(Placement(doll)), (push,))
    return ReferenceMotion('flight_pushed', '2000 N on the torso for 0.1 s in flight, limits off',
                           EQUATIONS, trial, _articulated(trial))


def _inside_limits(doll: Ragdoll, speed: float, seed: int) -> tuple[dict, dict]:
    """Random joint angles, rad, inside their ranges, and rates of up to ``speed`` rad/s."""
    rng = np.random.default_rng(seed)
    return inner_angles(doll, rng), {name: rng.uniform(-speed, speed)
                                     for name in angle_indices(doll)}


def _articulated(trial: Trial) -> object:
    """Solution of the equations of motion with the trial's pushes."""
    start: GeneralizedState = trial.start
    tree = Articulated(trial.scene.dolls[0].doll, trial.scene.gravity)
    breaks = sorted({time for push in trial.pushes
                     for time in (push.start, push.start + push.duration)})

    def wrenches(time: float, _: object) -> tuple[np.ndarray, np.ndarray]:
        forces = np.zeros((len(trial.scene.bones), 3))
        for load in trial.loads(time, time):
            forces[load.bone] += load.force
        return forces, np.zeros_like(forces)

    def truth(times: np.ndarray) -> Trajectory:
        return tree.trajectory(start.q, start.v, times, wrenches if breaks else None, breaks)
    return truth

"""Dolls of all kinds of joints and shapes, alone and together, anywhere and in any motion."""
from __future__ import annotations

import numpy as np

from ragdoll_ros.accuracy.references.articulated import Articulated
from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.model import rotation
from ragdoll_ros.model.coordinates import DofLayout, GeneralizedState
from ragdoll_ros.model.ragdoll import Bone, Joint, Ragdoll
from ragdoll_ros.model.scene import Placement, Scene
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Sphere
from ragdoll_ros.model.state import State

GRAVITY = (0.3, -0.2, -9.8)
TURN = tuple(rotation.normalized((.1, .5, -.3, .8)))


def every_kind(damping=.2):
    """All kinds of joints and shapes, two branches, nothing aligned, nothing in a tree's order."""
    bones = (Bone('double', Cylinder(.05, .3), 1.5, (.6, 0, 1.1), (0, .6, 0, .8)),
             Bone('hinged', Capsule(.05, .2), 1.0, (.3, .1, 1.1), TURN),
             Bone('root', Box((.1, .2, .4)), 4.0, (0, .1, 1), TURN),
             Bone('tip', Box((.1, .1, .2)), .7, (.7, .1, 1.4), TURN),
             Bone('free_ball', Box((.1, .3, .05)), 2.0, (-.3, .2, .9), (.6, 0, 0, .8)),
             Bone('ball', Sphere(.07), .8, (-.3, .5, .9), TURN),
             Bone('glued', Capsule(.05, .1), .5, (-.3, .7, .9)),
             Bone('on_glued', Cylinder(.05, .1), .6, (-.3, .9, .8), TURN))
    joints = (Joint('glued', 'on_glued', 'ball', (-.3, .8, .9), ((1, 0, 2),), damping=damping / 4),
              Joint('double', 'tip', 'ball', (.6, .1, 1.3), ((0, 1, 1),), ((-1.4, 1.4), None)),
              Joint('hinged', 'double', 'universal', (.45, 0, 1.1), ((0, 0, 1), (1, -1, 0)),
                    damping=damping / 2),
              Joint('root', 'hinged', 'hinge', (.15, .1, 1.0), ((1, 1, 0),), damping=damping),
              Joint('root', 'free_ball', 'ball', (-.15, .1, 1), ((0, 1, 1),), damping=damping),
              Joint('free_ball', 'ball', 'ball', (-.3, .4, .9), ((0, 1, 0),),
                    ((-1.4, 1.4), (-1, 1)), damping=damping / 3),
              Joint('ball', 'glued', 'fixed', (-.3, .6, .9)))
    return Ragdoll('every_kind', bones, joints)


def scene_of(*dolls, **settings):
    """Dolls, turned, far enough from each other not to touch."""
    turns = np.random.default_rng(len(dolls)).normal(size=(len(dolls), 4))
    return Scene('flying', tuple(
        Placement(doll, f'doll_{k}', (10.0 * k, -3.0 * k, k), tuple(turns[k]))
        for k, doll in enumerate(dolls)), **{'gravity': GRAVITY, 'self_collision': False,
                                             **settings})


PLATE = Ragdoll('plate', (Bone('plate', Box((.5, .3, .1)), 10.0, (.1, .2, .3), TURN),))
SCENES = {'+'.join(doll.name for doll in dolls): scene_of(*dolls) for dolls in (
    (every_kind(),), (load_doll('doll'),), (PLATE,), (every_kind(), PLATE, load_doll('doll')))}
MANY = scene_of(every_kind(), load_doll('doll'), every_kind())


def each_tree(scene, coordinates, gravity=(0, 0, 0)):
    """Give the equations of motion of each doll with its part of q and of v."""
    q = v = 0
    for placement in scene.dolls:
        tree = Articulated(placement.doll, gravity)
        yield tree, coordinates.q[q:q + tree.nq], coordinates.v[v:v + tree.nv]
        q, v = q + tree.nq, v + tree.nv


def random_coordinates(scene, seed, speed=3.0, far=0.0, bend=1.0):
    """A pose within ``bend`` rad of the bind pose, which leaves limited balls their three angles,
    ``far`` m from the origin, moving at some ``speed`` m/s and rad/s.
    """
    rng, q, v = np.random.default_rng(seed), [], []
    for placement in scene.dolls:
        tree = Articulated(placement.doll)
        own = tree.bind(placement.position, placement.orientation)
        own[:3] += far * rotation.normalized(rng.normal(size=3))
        own[3:7] = rng.normal(size=4)
        own[7:] += rng.uniform(-bend, bend, size=own.size - 7)
        q.append(own)
        v.append(rng.normal(size=tree.nv) * speed)
        turns, at = [3], 7
        for joint in placement.doll.joints_depth_first():
            free = joint.kind == 'ball' and not any(joint.limits)
            turns += [at] if free else []
            at += 4 if free else joint.dof
        for at in turns:
            own[at:at + 4] = rotation.normalized(own[at:at + 4])
    return GeneralizedState(np.concatenate(q), np.concatenate(v))


def random_state(scene, seed, height=0.0):
    """Bones anywhere, in no relation to each other, as sums over them need none."""
    rng, count = np.random.default_rng(seed), len(scene.bones)
    return State(rng.normal(size=(count, 3)) + np.array((0, 0, height)),
                 rotation.normalized(rng.normal(size=(count, 4))),
                 rng.normal(size=(count, 3)) * 5, rng.normal(size=(count, 3)) * 10)


def layout_of(scene):
    return DofLayout([placement.doll for placement in scene.dolls])


def apart(state, other):
    """How far states are from each other: m, rad, m/s, rad/s."""
    return (np.abs(state.positions - other.positions).max(),
            2 * np.abs(rotation.multiply(state.orientations, rotation.inverse(
                other.orientations))[:, :3]).max(),
            np.abs(state.linear_velocities
                   - other.linear_velocities).max(), np.abs(state.angular_velocities
                                                            - other.angular_velocities).max())


FLAIL = """<model name="flail"><pose>4 5 6 0 0 1</pose>
<link name="handle"><inertial><mass>2</mass></inertial><collision name="c"><geometry><box>
  <size>0.1 0.1 1</size></box></geometry></collision></link>
<link name="head"><pose>0 0 0.8 0 0 0</pose><inertial><mass>3</mass></inertial>
  <collision name="c"><geometry><sphere><radius>0.2</radius></sphere></geometry></collision></link>
<joint name="chain" type="ball"><parent>handle</parent><child>head</child>
  <pose>0 0 -0.25 0 0 0</pose></joint>
<plugin name="p" filename="p.so"><robotNamespace>flail</robotNamespace></plugin>
</model>"""

FLAIL_SDF = f"""<?xml version="1.0"?>
<sdf version="1.9"><world name="yard">
<model name="ground_plane"><static>true</static><link name="plane"><collision name="c"><geometry>
  <plane><normal>0 0 1</normal></plane></geometry></collision></link></model>
{FLAIL}</world></sdf>"""
"""A handle of 2 kg, a head of 3 kg, and a ground, which no doll is."""

TWO_FLAILS_SDF = FLAIL_SDF.replace('</world>', FLAIL.replace('"flail"', '"other"') + '</world>')

"""Rigs as they are found in the wild: made for animation, with trees that are no skeleton's.

Each is a body whose true tree is known, with the tree of its file rewired: feet and hands that hang
from the root or from nothing, controls and poles that move no skin, a pelvis in two halves, a thigh
for a root. Each has three skins: one whose weights go over smoothly, one of weights 0 and 1, and
islands of rigid skin for each bone, which share nothing.

Others have the tree that they should have, and a skin that contradicts it: bones that move the skin
of others far away, as painted or guessed weights do.
"""
import functools
import re
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import fit_rigs
import numpy as np
from fit_rigs import HALF, Bone, Rig, limb, matrix

BLEEDING = 0.4
"""Share of a bone in the skin of another: below one half, so that the skin stays the other's."""

CELL = 0.03
"""Edge of the cells that a skin is made of, m."""


@dataclass
class Wild:
    rig: Rig
    skin: str
    truth: dict
    """Bone to its parent, as the body is built; bones without skin are not in it."""
    roots: tuple
    """Bones one of which the root's body must hold."""
    bleeds: dict = field(default_factory=dict)
    """Bone to another that moves its skin as well."""


def segment_distances(points, bones):
    """Distances (p, b) of points from the surfaces of the bones' capsules."""
    columns = []
    for bone in bones:
        head, tail = np.array(bone.head, float), np.array(bone.tail, float)
        # Round ends that do not hide the next bone's skin.
        inset = min(0.4 * bone.radius / np.linalg.norm(tail - head), 0.4) * (tail - head)
        head, along = head + inset, tail - head - 2 * inset
        share = np.clip((points - head) @ along / (along @ along), 0, 1)
        columns.append(np.linalg.norm(points - head - share[:, None] * along, axis=1)
                       - bone.radius)
    return np.stack(columns, axis=1)


def one_skin(bones, sharp, cell=CELL):
    """One closed skin of little squares about all bones: vertices, triangles, joints, weights.

    Weights fall off by ``sharp`` m beyond the nearest bone; 0 gives the nearest one all.
    """
    points, faces = surface(frozenset(
        (tuple(bone.head), tuple(bone.tail), bone.radius) for bone in bones), cell)
    return points, faces, *weights_of(segment_distances(points, bones), sharp)


@functools.lru_cache(maxsize=8)
def surface(shapes, cell):
    """Vertices and triangles of that skin: the same for all trees of bones of these shapes."""
    bones = [Bone('', -1, *shape) for shape in shapes]
    reach = max(bone.radius for bone in bones) + cell
    ends = np.array([end for bone in bones for end in (bone.head, bone.tail)])
    # Symmetric about x = 0, as the bodies are.
    low = np.floor((np.minimum(ends.min(axis=0), -ends.max(axis=0) * (1, 0, 0)) - reach) / cell)
    high = np.ceil((np.maximum(ends.max(axis=0), -ends.min(axis=0) * (1, 0, 0)) + reach) / cell)
    low, high = np.where([1, 0, 0], -np.maximum(-low, high), low), np.where(
        [1, 0, 0], np.maximum(-low, high), high)
    shape = (high - low).astype(int)
    cells = np.stack(np.meshgrid(*map(np.arange, shape), indexing='ij'), -1).reshape(-1, 3)
    inside = (segment_distances((cells + low + .5) * cell, bones).min(axis=1) < 0).reshape(shape)
    quads = []
    for axis in range(3):
        step = np.zeros(3, int)
        step[axis] = 1
        u, v = (np.eye(3, dtype=int)[(axis + k) % 3] for k in (1, 2))
        for sign in (1, -1):
            found = np.argwhere(inside & ~np.roll(inside, -sign, axis))
            corner = found + (step if sign > 0 else 0)
            ring = [corner, corner + u, corner + u + v, corner + v][::sign]
            quads.append(np.stack(ring, axis=1))
    corners, index = np.unique(np.concatenate(quads).reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    points = (corners + low) * cell
    faces = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
    return points, faces


def weights_of(distances, sharp):
    """The four bones that move each vertex, and their weights."""
    joints = np.argsort(np.round(distances, 9), axis=1, kind='stable')[:, :4]
    joints = np.pad(joints, ((0, 0), (0, 4 - joints.shape[1])), mode='edge')
    near = np.take_along_axis(distances, joints, axis=1)
    weights = np.exp(-(near - near[:, :1]) / sharp) if sharp else 1.0 * (np.arange(4) == 0) * (
        near < np.inf)
    weights[weights < 0.05] = 0
    weights[:, distances.shape[1]:] = 0
    return joints, weights / weights.sum(axis=1, keepdims=True)


def islands(bones):
    """A closed tube about each bone, which it moves alone."""
    points, faces, joints, weights = fit_rigs.skin([replace(bone, parent=-1) for bone in bones])
    return points, faces, joints, np.tile((1.0, 0, 0, 0), (len(weights), 1))


SKINS = {'smooth': lambda bones: one_skin(bones, 0.02), 'sharp': lambda bones: one_skin(bones, 0),
         'islands': islands}


def skin_of(wild):
    """The mesh of a rig: of its bones that have a radius."""
    held = np.array([k for k, bone in enumerate(wild.rig.bones) if bone.radius > 0])
    points, faces, joints, weights = SKINS[wild.skin]([wild.rig.bones[k] for k in held])
    return points, faces, *bled(held[joints], weights, wild)


def bled(joints, weights, wild):
    """Joints and weights where other bones have a share of BLEEDING in those of some."""
    names = [bone.name for bone in wild.rig.bones]
    joints, weights = joints.copy(), weights.copy()
    for bone, other in wild.bleeds.items():
        main = joints[:, 0] == names.index(bone)
        joints[main, 3] = names.index(other)
        weights[main, 3] = BLEEDING
    return joints, weights / weights.sum(axis=1, keepdims=True)


def control(name, at, parent=None):
    return Bone(name, parent, at, (at[0], at[1] + .1, at[2]), 0.0)


def rewired(bones, parents, controls=()):
    """The bones with other parents by name (None: without one), and controls; parents first."""
    up = {bone.name: bones[bone.parent].name if bone.parent >= 0 else None for bone in bones}
    up |= {bone.name: bone.parent for bone in controls} | parents
    every, order = {bone.name: bone for bone in (*controls, *bones)}, []
    while len(order) < len(every):
        order += [name for name in every if name not in order and (
            up[name] is None or up[name] in order)]
    return [replace(every[name], parent=order.index(up[name]) if up[name] is not None else -1)
            for name in order]


def truth_of(bones):
    return {bone.name: bones[bone.parent].name if bone.parent >= 0 else None for bone in bones}


def split_pelvis(bones):
    """A person whose hips are a left and a right half."""
    halves = [Bone(f'pelvis_{side}', -1, (sign * .04, 1.0, 0), (sign * .08, .92, 0), .12)
              for sign, side in ((1, 'L'), (-1, 'R'))]
    spine = replace(bones[1], parent=0, head=(0, 1.06, 0))
    place = {0: 0, 1: 2} | {k: k + 1 for k in range(2, len(bones))}
    rest = [replace(bone, parent=place[bone.parent]) for bone in bones[2:]]
    rest = [replace(bone, parent=0 if bone.head[0] > 0 else 1, head=(*bone.head[:1], .84, 0))
            if bone.name.endswith('UpLeg') else bone for bone in rest]
    return [halves[0], replace(halves[1], parent=0), spine, *rest]


def person():
    """A person with a neck that can be seen."""
    bones = fit_rigs.humanoid()
    return [replace(bone, tail=(0, 1.6, 0)) if bone.name.endswith('Neck')
            else replace(bone, head=(0, 1.6, 0), tail=(0, 1.84, 0)) if bone.name.endswith('Head')
            else bone for bone in bones]


def arms_down(bones):
    """A person whose hands hang beside the hips."""
    down = {'Arm': ((.18, 1.42, 0), (.2, 1.18, 0)), 'ForeArm': ((.2, 1.18, 0), (.23, .97, .01)),
            'Hand': ((.23, .97, .01), (.25, .86, .01))}

    def hangs(bone):
        end = re.split('Left|Right', bone.name)[-1]
        if bone.name.endswith('Hips'):
            return replace(bone, radius=.16)
        if end not in down:
            return bone
        sign = 1 if 'Left' in bone.name else -1
        head, tail = ((sign * x, y, z) for x, y, z in down[end])
        return replace(bone, head=head, tail=tail)

    return [hangs(bone) for bone in bones]


M = 'mixamorig:'
FEET = tuple(f'{M}{side}Foot' for side in ('Left', 'Right'))
HANDS = tuple(f'{M}{side}Hand' for side in ('Left', 'Right'))
LIMBS = ('UpLeg', 'Leg', 'Foot', 'Arm')
TRUNK = (f'{M}Hips', f'{M}Spine', f'{M}Spine1', f'{M}Spine2')


def person_rigs():
    """Name, file's bones, true bones, roots, and what else the rig has, of each person."""
    true = person()
    root = control('Root', (0, 0, 0))
    poles = [root, *(control(f'Pole{kind}.{side}', (sign * .2, y, z), 'Root')
                     for kind, y, z in (('Target', .5, 1.0), ('Elbow', 1.4, -1.0))
                     for sign, side in ((1, 'L'), (-1, 'R')))]
    yield 'feet_of_root', rewired(true, dict.fromkeys(FEET, TRUNK[0])), true, {}
    yield 'feet_of_nothing', rewired(true, dict.fromkeys(FEET)), true, {}
    yield 'feet_of_a_control', rewired(
        true, {**dict.fromkeys(FEET, 'Root'), TRUNK[0]: 'Root'}, [root]), true, {}
    yield 'hands_of_root', rewired(true, dict.fromkeys(HANDS, TRUNK[0])), true, {}
    hangs = arms_down(true)
    yield 'arms_down', rewired(hangs, {}), hangs, {}
    yield 'arms_down_hands_of_root', rewired(hangs, dict.fromkeys(HANDS, TRUNK[0])), hangs, {}
    yield 'hands_and_feet_of_nothing', rewired(true, dict.fromkeys(FEET + HANDS)), true, {}
    yield 'poles', rewired(
        true, {**dict.fromkeys(FEET + HANDS, 'Root'), TRUNK[0]: 'Root'}, poles), true, {}
    yield 'legs_of_a_control', rewired(
        true, {TRUNK[0]: 'Root', **{f'{M}{side}UpLeg': 'Root' for side in ('Left', 'Right')},
                 **dict.fromkeys(FEET, 'Root')}, [root]), true, {}
    yield 'a_thigh_for_root', rewired(
        true, {f'{M}LeftUpLeg': None, TRUNK[0]: f'{M}LeftUpLeg',
                 f'{M}RightUpLeg': f'{M}LeftUpLeg'}), true, {}
    yield 'all_of_one_control', rewired(
        true, {bone.name: 'Root' for bone in true}, [root]), true, {}
    yield 'no_tree', rewired(true, {bone.name: None for bone in true}), true, {}
    yield 'chest_for_root', rewired(
        true, {TRUNK[3]: None, TRUNK[2]: TRUNK[3], TRUNK[1]: TRUNK[2],
                 TRUNK[0]: TRUNK[1]}), true, {}
    yield 'feet_mirrored', rewired(true, dict.fromkeys(FEET)), true, {
        'root': np.diag((-1.0, 1, 1, 1))}
    yield 'feet_z_up', rewired(true, dict.fromkeys(FEET, TRUNK[0])), true, {
        'root': matrix((-HALF, 0, 0, HALF))}
    yield 'feet_unnamed', rewired(true, dict.fromkeys(FEET, TRUNK[0])), true, {'named': False}
    yield 'hands_in_centimetres', rewired(true, dict.fromkeys(HANDS)), true, {'unit': 100}
    halves = split_pelvis(true)
    yield 'split_pelvis', rewired(halves, {}), halves, {}
    yield 'split_pelvis_of_a_control', rewired(
        halves, dict.fromkeys(('pelvis_L', 'pelvis_R', TRUNK[1]), 'Root'), [root]), halves, {}
    yield 'split_pelvis_unnamed', rewired(
        halves, {'pelvis_R': None}), halves, {'named': False}


def animal_rigs():
    dog, bird, snake = fit_rigs.quadruped(), fit_rigs.bird(), fit_rigs.chain(12, 2.0, .06, .05)
    paws = [f'{side}{end}' for side in ('Left', 'Right') for end in ('Hand', 'Foot')]
    root = control('Root', (0, 0, 0))
    trunk = ('Hip', 'Spine1', 'Spine2')
    yield 'paws_of_nothing', rewired(dog, dict.fromkeys(paws)), dog, trunk
    yield 'paws_of_a_control', rewired(
        dog, {**dict.fromkeys(paws, 'Root'), 'Hip': 'Root'}, [root]), dog, trunk
    yield 'claws_of_nothing', rewired(
        bird, dict.fromkeys(('foot.L', 'foot.R'))), bird, ('body', 'chest')
    yield 'snake_without_a_tree', rewired(
        snake, {bone.name: None for bone in snake}), snake, ('link4', 'link5', 'link6', 'link7')


def chibi():
    """A figure of two heads' height."""
    hips, spine, neck, head, arm, leg, _ = fit_rigs.NAMES['mixamo']
    bones = []
    chest = limb(bones, -1, [hips, *spine], [(0, y, 0) for y in (.26, .32, .38, .43, .48)],
                 [.09] * 4)
    limb(bones, chest, [neck, head], [(0, .48, 0), (0, .58, 0), (0, 1.0, 0)], [.05, .22])
    for side, mark in ((1, fit_rigs.LEFT), (-1, fit_rigs.RIGHT)):
        limb(bones, chest, [name.format(**mark) for name in arm],
             [(side * x, .45, 0) for x in (.03, .1, .2, .29, .36)], [.04, .04, .035, .035])
        limb(bones, 0, [name.format(**mark) for name in leg], [(side * .06, y, z) for y, z in (
            (.24, 0), (.15, .005), (.05, -.005), (.02, .05), (.02, .09))], [.05, .045, .04, .03])
    return bones


def monster():
    """A head with arms and legs."""
    bones = [Bone('Head', -1, (0, .35, 0), (0, .95, 0), .33)]
    for side, label in ((1, 'Left'), (-1, 'Right')):
        limb(bones, 0, [f'{label}{name}' for name in ('UpperArm', 'ForeArm', 'Hand')],
             [(side * x, .6, 0) for x in (.3, .45, .6, .7)], [.05, .045, .04])
        limb(bones, 0, [f'{label}{name}' for name in ('Thigh', 'Shin', 'Foot')],
             [(side * .15, y, z) for y, z in ((.33, 0), (.2, .01), (.06, 0), (.02, .12))],
             [.06, .05, .04])
    return bones


def hopper():
    """A body and a larger head on two legs."""
    bones = [Bone('Body', -1, (0, .3, 0), (0, .6, 0), .2)]
    limb(bones, 0, ['Head'], [(0, .6, .05), (0, 1.1, .1)], [.3])
    for side, label in ((1, 'Left'), (-1, 'Right')):
        limb(bones, 0, [f'{label}{name}' for name in ('Thigh', 'Shin', 'Foot')],
             [(side * .12, y, z) for y, z in ((.3, 0), (.18, .01), (.06, 0), (.02, .15))],
             [.07, .06, .05])
    return bones


def figure_rigs():
    """Name, bones and roots of figures that have not a person's proportions."""
    yield 'chibi', chibi(), TRUNK
    yield 'monster_of_one_head', monster(), ('Head',)
    yield 'hopper', hopper(), ('Body',)


def bleeding_rigs():
    """Name, bones, roots, and which bones move the skin of which others."""
    true, dog = person(), fit_rigs.quadruped()

    def both(bone, other, crossed=False):
        sides = ('Left', 'Right')
        theirs = (sides[::-1] if crossed else sides) if other in LIMBS else ('', '')
        return {f'{M}{side}{bone}': f'{M}{its}{other}'
                for side, its in zip(sides, theirs, strict=True)}

    yield 'hips_move_forearms', true, TRUNK, both('ForeArm', 'Hips')
    yield 'head_moves_shoulders', true, TRUNK, both('Shoulder', 'Head')
    yield 'hips_move_shoulders', true, TRUNK, both('Shoulder', 'Hips')
    yield 'thighs_move_hands', true, TRUNK, both('Hand', 'UpLeg')
    yield 'feet_move_each_other', true, TRUNK, both('Foot', 'Foot', crossed=True)
    yield 'shins_move_the_other_thigh', true, TRUNK, both('UpLeg', 'Leg', crossed=True)
    yield 'upper_arms_move_shins', true, TRUNK, both('Leg', 'Arm')
    trunk = ('Hip', 'Spine1', 'Spine2')
    yield 'hind_legs_move_fore_legs', dog, trunk, {
        f'{side}{end}': f'{side}{other}' for side in ('Left', 'Right')
        for end, other in (('UpperArm', 'Thigh'), ('ForeArm', 'Shin'))}
    yield 'a_thigh_moves_the_tail', dog, trunk, {'Tail1': 'LeftThigh'}


def _wild():
    for name, bones, true, extra in person_rigs():
        roots = (*TRUNK, 'pelvis_L', 'pelvis_R')
        # Halves without a name that share no skin are two bodies.
        for skin in SKINS if name != 'split_pelvis_unnamed' else ('smooth', 'sharp'):
            yield Wild(Rig(f'{name}-{skin}', bones, **extra), skin, truth_of(true), roots)
    for name, bones, true, roots in animal_rigs():
        for skin in SKINS:
            yield Wild(Rig(f'{name}-{skin}', bones), skin, truth_of(true), roots)
    for name, bones, roots in figure_rigs():
        for skin in SKINS:
            yield Wild(Rig(f'{name}-{skin}', bones), skin, truth_of(bones), roots)
    for name, bones, roots, bleeds in bleeding_rigs():
        for skin in SKINS:
            yield Wild(Rig(f'{name}-{skin}', bones), skin, truth_of(bones), roots, bleeds)


WILD = {wild.rig.name: wild for wild in _wild()}


def write(wild, folder):
    path = folder / f'{wild.rig.name}.glb'
    path.write_bytes(fit_rigs.document(wild.rig, skin_of(wild)).glb())
    return path


@functools.cache
def fitted(name):
    """Fit a rig without options, once for all tests."""
    from ragdoll_ros.fit.pipeline import fit_character
    from ragdoll_ros.fit.reading.character import read_character
    with tempfile.TemporaryDirectory() as folder:
        return fit_character(read_character(write(WILD[name], Path(folder))))

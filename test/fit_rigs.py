"""Rigged, skinned characters of many kinds, written as real .glb files.

Lengths in m, glTF's axes: y up, z forward, x left. The writer uses no glTF library, so that the
reader is held against the specification and not against its own library.
"""
import functools
import json
import struct
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np


@dataclass
class Bone:
    name: str
    parent: int
    head: tuple
    tail: tuple
    radius: float


@dataclass
class Rig:
    name: str
    bones: list
    unit: float = 1.0
    """Units of the file to one metre."""
    root: np.ndarray = field(default_factory=lambda: np.eye(4))
    """The armature node's matrix; bones and mesh are written in its frame."""
    named: bool = True
    binds: bool = True
    node_scale: float = 1.0
    """Scale of every bone's node, undone by its children."""


def limb(rig, parent, names, points, radii):
    """Append a chain of bones along points; gives the index of the last."""
    for name, head, tail, radius in zip(names, points[:-1], points[1:], radii, strict=True):
        rig.append(Bone(name, parent, tuple(head), tuple(tail), radius))
        parent = len(rig) - 1
    return parent


NAMES = {
    'mixamo': ('mixamorig:Hips', ('mixamorig:Spine', 'mixamorig:Spine1', 'mixamorig:Spine2'),
               'mixamorig:Neck', 'mixamorig:Head',
               ['mixamorig:{S}Shoulder', 'mixamorig:{S}Arm', 'mixamorig:{S}ForeArm',
                'mixamorig:{S}Hand'],
               ['mixamorig:{S}UpLeg', 'mixamorig:{S}Leg', 'mixamorig:{S}Foot',
                'mixamorig:{S}ToeBase'], 'mixamorig:{S}Hand{F}{n}'),
    'unreal': ('pelvis', ('spine_01', 'spine_02', 'spine_03'), 'neck_01', 'head',
               ['clavicle_{s}', 'upperarm_{s}', 'lowerarm_{s}', 'hand_{s}'],
               ['thigh_{s}', 'calf_{s}', 'foot_{s}', 'ball_{s}'], '{f}_0{n}_{s}'),
    'vrm': ('J_Bip_C_Hips', ('J_Bip_C_Spine', 'J_Bip_C_Chest', 'J_Bip_C_UpperChest'),
            'J_Bip_C_Neck', 'J_Bip_C_Head',
            ['J_Bip_{L}_Shoulder', 'J_Bip_{L}_UpperArm', 'J_Bip_{L}_LowerArm', 'J_Bip_{L}_Hand'],
            ['J_Bip_{L}_UpperLeg', 'J_Bip_{L}_LowerLeg', 'J_Bip_{L}_Foot', 'J_Bip_{L}_ToeBase'],
            'J_Bip_{L}_{F}{n}'),
    'cmu': ('Hips', ('LowerBack', 'Spine', 'Spine1'), 'Neck1', 'Head',
            ['{S}Shoulder', '{S}Arm', '{S}ForeArm', '{S}Hand'],
            ['{S}UpLeg', '{S}Leg', '{S}Foot', '{S}ToeBase'], '{S}Finger{F}{n}'),
    'makehuman': ('root', ('spine05', 'spine04', 'spine03'), 'neck01', 'head',
                  ['clavicle.{L}', 'upperarm01.{L}', 'lowerarm01.{L}', 'wrist.{L}'],
                  ['upperleg01.{L}', 'lowerleg01.{L}', 'foot.{L}', 'toe1-1.{L}'],
                  'finger{k}-{n}.{L}')}

LEFT, RIGHT = {'S': 'Left', 's': 'l', 'L': 'L'}, {'S': 'Right', 's': 'r', 'L': 'R'}

FINGERS = ('Thumb', 'Index', 'Middle', 'Ring', 'Pinky')


def humanoid(style='mixamo', fingers=False):
    hips, spine, neck, head, arm, leg, finger = NAMES[style]
    bones = []
    chest = limb(bones, -1, [hips, *spine], [(0, .95, 0), (0, 1.06, 0), (0, 1.18, 0),
                                             (0, 1.31, 0), (0, 1.46, 0)], [.13, .12, .13, .14])
    limb(bones, chest, [neck, head], [(0, 1.46, 0), (0, 1.55, 0), (0, 1.78, 0)], [.055, .1])
    for side, mark in ((1, LEFT), (-1, RIGHT)):
        points = [(side * x, y, z) for x, y, z in (
            (.03, 1.42, 0), (.18, 1.42, 0), (.46, 1.42, 0), (.72, 1.42, .01), (.84, 1.42, .01))]
        hand = limb(bones, chest, [name.format(**mark) for name in arm], points,
                    [.055, .05, .04, .035])
        for k in range(5 if fingers else 0):
            z = .05 - .025 * k
            names = [finger.format(F=FINGERS[k], f=FINGERS[k].lower(), k=k + 1, n=n, **mark)
                     for n in (1, 2, 3)]
            limb(bones, hand, names, [(side * (.84 + .028 * n), 1.42, .01 + z) for n in range(4)],
                 [.009, .009, .008])
        points = [(side * x, y, z) for x, y, z in (
            (.1, .92, 0), (.1, .5, .01), (.1, .09, -.02), (.1, .03, .1), (.1, .03, .18))]
        limb(bones, 0, [name.format(**mark) for name in leg], points, [.085, .06, .045, .035])
    return bones


def backwards(bones):
    turn = np.array((-1, 1, -1))
    return [replace(bone, head=tuple(turn * bone.head), tail=tuple(turn * bone.tail))
            for bone in bones]


def quadruped():
    bones = []
    chest = limb(bones, -1, ['Hip', 'Spine1', 'Spine2'],
                 [(0, .6, -.4), (0, .62, -.1), (0, .62, .15), (0, .62, .4)], [.13, .13, .14])
    limb(bones, chest, ['Neck', 'Head'], [(0, .65, .4), (0, .82, .55), (0, .85, .8)], [.07, .09])
    limb(bones, 0, ['Tail1', 'Tail2', 'Tail3'],
         [(0, .65, -.4), (0, .6, -.55), (0, .52, -.7), (0, .45, -.85)], [.04, .035, .03])
    for side, label in ((1, 'Left'), (-1, 'Right')):
        x = side * .1
        limb(bones, chest, [label + n for n in ('UpperArm', 'ForeArm', 'Hand')],
             [(x, .55, .33), (x, .33, .28), (x, .1, .33), (x, 0, .38)], [.06, .04, .03])
        limb(bones, 0, [label + n for n in ('Thigh', 'Shin', 'Foot')],
             [(x, .55, -.38), (x, .35, -.3), (x, .15, -.45), (x, 0, -.4)], [.07, .045, .03])
    return bones


def bird():
    bones = []
    body = limb(bones, -1, ['body', 'chest'], [(0, .3, -.1), (0, .32, 0), (0, .34, .12)],
                [.07, .08])
    limb(bones, body, ['neck', 'head'], [(0, .36, .12), (0, .45, .18), (0, .48, .28)], [.03, .035])
    limb(bones, 0, ['tail'], [(0, .3, -.1), (0, .28, -.3)], [.03])
    for side, label in ((1, 'L'), (-1, 'R')):
        limb(bones, body, [f'wing{n}.{label}' for n in (1, 2, 3)],
             [(side * x, .35, z) for x, z in ((.06, .05), (.25, .08), (.45, .03), (.65, -.05))],
             [.03, .025, .02])
        limb(bones, 0, [f'thigh.{label}', f'shin.{label}', f'foot.{label}'],
             [(side * .05, y, z) for y, z in ((.27, -.02), (.16, .04), (.02, -.03), (.01, .06))],
             [.03, .015, .012])
    return bones


def chain(count, length, radius, wave=0.0):
    points = [(wave * np.sin(k), .3, length * k / count) for k in range(count + 1)]
    bones = []
    limb(bones, -1, [f'link{k}' for k in range(count)], points, [radius] * count)
    return bones


def star(arms, pieces=2):
    bones = [Bone('middle', -1, (0, .3, 0), (0, .4, 0), .15)]
    for arm in range(arms):
        angle = 2 * np.pi * arm / arms
        points = [(np.sin(angle) * r, .35, np.cos(angle) * r)
                  for r in np.linspace(.12, .7, pieces + 1)]
        limb(bones, 0, [f'arm{arm}_{k}' for k in range(pieces)], points, [.05] * pieces)
    return bones


def spider():
    bones = [Bone('abdomen', -1, (0, .3, -.2), (0, .32, .1), .12)]
    for side in (1, -1):
        for k in range(4):
            z = .1 - .08 * k
            limb(bones, 0, [f'p{k}_{side}_{n}' for n in range(3)],
                 [(side * .1, .3, z), (side * .3, .45, z * 2), (side * .5, .2, z * 3),
                  (side * .6, 0, z * 3.5)], [.025, .02, .015])
    return bones


def two_skeletons():
    other = [replace(bone, name=f'whip{k}', parent=bone.parent if k == 0 else k - 1 + 22,
                     head=(bone.head[0], bone.head[1] + 1.4, bone.head[2] * .2 - .4),
                     tail=(bone.tail[0], bone.tail[1] + 1.4, bone.tail[2] * .2 - .4))
             for k, bone in enumerate(chain(4, 2.0, .05))]
    bones = humanoid()
    return bones + [replace(bone, parent=-1 if k == 0 else len(bones) + k - 1)
                    for k, bone in enumerate(other)]


def matrix(turn=(0, 0, 0, 1), scale=1.0, move=(0, 0, 0)):
    x, y, z, w = turn
    m = np.eye(4)
    m[:3, :3] = scale * np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    m[:3, 3] = move
    return m


HALF = np.sqrt(.5)

RIGS = {rig.name: rig for rig in (
    Rig('mixamo', humanoid('mixamo', fingers=True)),
    Rig('unreal', humanoid('unreal', fingers=True)),
    Rig('vrm', humanoid('vrm')),
    Rig('cmu', humanoid('cmu')),
    Rig('makehuman', humanoid('makehuman', fingers=True)),
    Rig('unnamed', humanoid(), named=False),
    Rig('centimetres', humanoid(), unit=100),
    Rig('millimetres', humanoid(), unit=1000),
    Rig('scaled_armature', humanoid(), unit=100, root=matrix(scale=.01)),
    Rig('z_up', humanoid(), root=matrix((-HALF, 0, 0, HALF))),
    Rig('turned_scaled_moved', humanoid(), unit=100,
        root=matrix((-HALF, 0, 0, HALF), .01, (3, 0, -2))),
    Rig('faces_backwards', backwards(humanoid())),
    Rig('no_binds', humanoid(), binds=False),
    Rig('scaled_nodes', humanoid(), node_scale=2.0),
    Rig('four_legs', quadruped()),
    Rig('four_legs_unnamed_centimetres', quadruped(), unit=100, named=False),
    Rig('bird', bird()),
    Rig('snake', chain(40, 2.0, .04, wave=.05)),
    Rig('chain', chain(10, 1.0, .03)),
    Rig('chain_60', chain(60, 3.0, .05)),
    Rig('two_bones', chain(2, .6, .06)),
    Rig('one_bone', chain(1, .5, .1)),
    Rig('star', star(5)),
    Rig('starfish', star(7, 4)),
    Rig('spider', spider()),
    Rig('two_skeletons', two_skeletons()))}


def skin(bones, around=12, rings=7):
    """A closed tube with round ends about each bone: vertices, triangles, joints, weights."""
    along = np.linspace(0, 1, rings)[:, None, None]
    angles = 2 * np.pi * (np.arange(around)[:, None] + .5) / around
    swell = np.sqrt(np.maximum(.04, 1 - (2 * along - 1) ** 4))
    shares = np.append(np.repeat(.4 * np.maximum(0, 1 - 4 * along), around), (0, 0))
    tube = tube_faces(around, rings)
    points, faces, joints, weights = [], [], [], []
    for index, bone in enumerate(bones):
        head, tail = np.array(bone.head, float), np.array(bone.tail, float)
        length = np.linalg.norm(tail - head)
        z = (tail - head) / length
        # One and the same rule on both sides, so that a mirrored rig has a mirrored skin.
        x = np.cross(z, (0, 0, 1) if abs(z[2]) < .9 else (0, 1, 0))
        x /= np.linalg.norm(x)
        ring = np.cos(angles) * x + np.sin(angles) * np.cross(z, x)
        sides = head + along * length * z + bone.radius * swell * ring
        points.append(np.concatenate([sides.reshape(-1, 3), [head, tail]]))
        faces.append(tube + index * len(points[0]))
        share = shares if bone.parent >= 0 else 0 * shares
        # The middles of the ends are moved by joint 0 for the rest, which is nothing.
        others = np.where(np.arange(len(shares)) < around * rings, max(bone.parent, 0), 0)
        none = np.zeros_like(others)
        joints.append(np.stack([none + index, others, none, none], axis=1))
        weights.append(np.stack([1 - share, share, none, none], axis=1))
    return tuple(np.concatenate(parts) for parts in (points, faces, joints, weights))


def tube_faces(around, rings):
    """Triangles of rings one above the other, and of the two middles of its ends behind them."""
    first, last = rings * around, (rings - 1) * around
    faces = []
    for ring in range(0, last, around):
        for k in range(around):
            a, b = ring + k, ring + (k + 1) % around
            faces += [(a, b, b + around), (a, b + around, a + around)]
    for k in range(around):
        faces += [(first, (k + 1) % around, k), (first + 1, last + k, last + (k + 1) % around)]
    return np.array(faces)


def worlds(rig):
    """Each bone's matrix in the armature's frame, file units: z of the bone along it."""
    inside = np.linalg.inv(rig.root * np.array([[1.0] * 4] * 4))
    result = []
    for bone in rig.bones:
        z = np.array(bone.tail, float) - bone.head
        z /= np.linalg.norm(z)
        x = np.cross((0, 1, 0) if abs(z[1]) < .9 else (0, 0, 1), z)
        x /= np.linalg.norm(x)
        world = np.eye(4)
        world[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
        world[:3, 3] = np.array(bone.head) * rig.unit * np.cbrt(np.linalg.det(rig.root[:3, :3]))
        local = np.linalg.inv(rig.root) @ world
        local[:3, :3] /= np.cbrt(np.linalg.det(local[:3, :3]))
        local[:3, 3] = inside[:3, :3] @ world[:3, 3]
        local[:3, :3] *= rig.node_scale
        result.append(local)
    return result


class Document:
    """A glTF document that grows: arrays become accessors."""

    def __init__(self):
        self.data = {'asset': {'version': '2.0'}, 'accessors': [], 'bufferViews': [],
                     'buffers': [{'byteLength': 0}], 'nodes': [], 'meshes': [], 'skins': [],
                     'scene': 0, 'scenes': [{'nodes': [0]}]}
        self.blob = b''

    def view(self, data, **extra):
        self.blob += b'\0' * (-len(self.blob) % 4)
        self.data['bufferViews'].append(
            {'buffer': 0, 'byteOffset': len(self.blob), 'byteLength': len(data), **extra})
        self.blob += data
        return len(self.data['bufferViews']) - 1

    def accessor(self, array, dtype, kind, **extra):
        codes = {'i1': 5120, 'u1': 5121, 'i2': 5122, 'u2': 5123, 'u4': 5125, 'f4': 5126}
        array = np.ascontiguousarray(array, '<' + dtype)
        self.data['accessors'].append({
            'bufferView': self.view(array.tobytes()), 'componentType': codes[dtype],
            'count': len(array), 'type': kind, **extra})
        return len(self.data['accessors']) - 1

    def glb(self):
        self.data['buffers'][0]['byteLength'] = len(self.blob)
        text = json.dumps(self.data).encode()
        text += b' ' * (-len(text) % 4)
        blob = self.blob + b'\0' * (-len(self.blob) % 4)
        length = 28 + len(text) + len(blob)
        return (struct.pack('<4sII', b'glTF', 2, length) + struct.pack('<I4s', len(text), b'JSON')
                + text + struct.pack('<I4s', len(blob), b'BIN\0') + blob)


def document(rig, mesh=None):
    """Make the glTF document of a rig; node 0 is the armature, node 1 the mesh, then bones."""
    made = Document()
    points, faces, joints, weights = mesh or skin(rig.bones)
    matrices = worlds(rig)
    scale = rig.unit * np.cbrt(np.linalg.det(rig.root[:3, :3]))
    points = (np.linalg.inv(rig.root)[:3, :3] @ (points * scale).T).T
    nodes = [{'name': 'Armature', 'matrix': rig.root.T.ravel().tolist(), 'children': [1]},
             {'name': 'Body', 'mesh': 0, 'skin': 0}]
    for index, bone in enumerate(rig.bones):
        local = matrices[index]
        if bone.parent >= 0:
            local = np.linalg.inv(matrices[bone.parent]) @ local
        nodes.append({'matrix': local.T.ravel().tolist()})
        if rig.named:
            nodes[-1]['name'] = bone.name
        nodes[bone.parent + 2 if bone.parent >= 0 else 0].setdefault('children', []).append(
            index + 2)
    made.data['nodes'] = nodes
    made.data['skins'] = [{'joints': [k + 2 for k in range(len(rig.bones))]}]
    if rig.binds:
        binds = np.stack([np.linalg.inv(m).T.ravel() for m in matrices])
        made.data['skins'][0]['inverseBindMatrices'] = made.accessor(binds, 'f4', 'MAT4')
    else:
        # Without them a vertex is given in the frame of the bone that moves it.
        own = joints[:, 0]
        inverse = np.linalg.inv(np.stack(matrices))[own]
        points = np.einsum('vij,vj->vi', inverse[:, :3, :3], points) + inverse[:, :3, 3]
        weights = np.tile((1.0, 0, 0, 0), (len(points), 1))
    attributes = {'POSITION': made.accessor(points, 'f4', 'VEC3'),
                  'JOINTS_0': made.accessor(joints, 'u1' if joints.max() < 256 else 'u2', 'VEC4'),
                  'WEIGHTS_0': made.accessor(weights, 'f4', 'VEC4')}
    indices = made.accessor(faces.reshape(-1, 1), 'u2' if len(points) < 65536 else 'u4', 'SCALAR')
    made.data['meshes'] = [{'primitives': [{'attributes': attributes, 'indices': indices}]}]
    return made


def beside(first, second):
    """One document of two: each keeps its nodes, its mesh and its skin."""
    made, own = Document(), second.data
    start = len(first.blob) + -len(first.blob) % 4
    made.blob = first.blob.ljust(start, b'\0') + second.blob
    made.data = {**first.data}
    counts = {key: len(first.data[key]) for key in ('nodes', 'meshes', 'skins', 'accessors',
                                                    'bufferViews')}

    def later(entry, **kinds):
        return {**entry, **{key: entry[key] + counts[kind] if isinstance(entry[key], int)
                            else [one + counts[kind] for one in entry[key]]
                            for key, kind in kinds.items() if key in entry}}

    more = {'nodes': [later(each, children='nodes', mesh='meshes', skin='skins')
                      for each in own['nodes']],
            'skins': [later(each, joints='nodes', inverseBindMatrices='accessors')
                      for each in own['skins']],
            'accessors': [later(each, bufferView='bufferViews') for each in own['accessors']],
            'bufferViews': [{**each, 'byteOffset': each['byteOffset'] + start}
                            for each in own['bufferViews']],
            'meshes': [{'primitives': [
                {**later(part, indices='accessors'), 'attributes': later(
                    part['attributes'], **dict.fromkeys(part['attributes'], 'accessors'))}
                for part in each['primitives']]} for each in own['meshes']]}
    for key, entries in more.items():
        made.data[key] = [*first.data[key], *entries]
    made.data['scenes'] = [{'nodes': [0, counts['nodes']]}]
    return made


def write(rig, folder):
    path = folder / f'{rig.name}.glb'
    path.write_bytes(document(rig).glb())
    return path


@functools.cache
def fitted(name):
    """Fit a rig without options, once for all tests."""
    from ragdoll_ros.fit.pipeline import fit_character
    from ragdoll_ros.fit.reading.character import read_character
    with tempfile.TemporaryDirectory() as folder:
        return fit_character(read_character(write(RIGS[name], Path(folder))))


def mannequin():
    """Give the wooden body of mannequin-x (Apache-2.0) as a document; eight weights a vertex."""
    from mannequin import Mannequin
    body = Mannequin('wooden')
    pose = body.rest_pose()
    raw = body._weights
    worlds = np.asarray(body.joint_transforms(pose), float)
    made = Document()
    names = [str(name) for name in raw.joint_names]
    nodes = [{'name': 'Body', 'mesh': 0, 'skin': 0}]
    for name, parent, world in zip(names, raw.parents, worlds, strict=True):
        local = np.linalg.inv(worlds[parent]) @ world if parent >= 0 else world
        nodes.append({'name': name, 'matrix': local.T.ravel().tolist()})
        if parent >= 0:
            nodes[parent + 1].setdefault('children', []).append(len(nodes) - 1)
    made.data['nodes'] = nodes
    made.data['scenes'] = [{'nodes': [0, 1]}]
    binds = made.accessor(np.linalg.inv(worlds).transpose(0, 2, 1).reshape(-1, 16), 'f4', 'MAT4')
    made.data['skins'] = [{'joints': list(range(1, len(names) + 1)), 'inverseBindMatrices': binds}]
    weights = np.round(raw.skin_weights * 65535)
    attributes = {'POSITION': made.accessor(np.asarray(body.vertices(pose)), 'f4', 'VEC3')}
    for part in range(2):
        columns = slice(4 * part, 4 * part + 4)
        attributes[f'JOINTS_{part}'] = made.accessor(
            raw.skin_joint_indices[:, columns], 'u2', 'VEC4')
        attributes[f'WEIGHTS_{part}'] = made.accessor(
            weights[:, columns], 'u2', 'VEC4', normalized=True)
    indices = made.accessor(raw.faces.reshape(-1, 1), 'u4', 'SCALAR')
    made.data['meshes'] = [{'primitives': [{'attributes': attributes, 'indices': indices}]}]
    return made

"""Meshes without a skin are skin of the bone that they hang from: armour, hats, robots of parts."""
import fit_rigs
import numpy as np
import pytest
from fit_rigs import RIGS

from ragdoll_ros.fit.pipeline import fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model.errors import ModelErrors

PERSON = RIGS['vrm']


def parts(pivots=False):
    """A person as a robot: a node for each bone with its mesh, or with a node below that has it."""
    made = fit_rigs.document(PERSON)
    data = made.data
    del data['skins'], data['nodes'][1]['skin'], data['nodes'][1]['mesh']
    data['meshes'] = []
    for k, (bone, world) in enumerate(zip(PERSON.bones, fit_rigs.worlds(PERSON), strict=True)):
        points, faces, *_ = fit_rigs.skin([fit_rigs.replace(bone, parent=-1)])
        back = np.linalg.inv(world)
        points = points @ back[:3, :3].T + back[:3, 3]
        node = data['nodes'][k + 2]
        if pivots:
            data['nodes'].append({'name': f'mesh of {bone.name}', 'mesh': k})
            node.setdefault('children', []).append(len(data['nodes']) - 1)
        else:
            node['mesh'] = k
        data['meshes'].append(mesh(made, points, faces))
    return made


def mesh(made, points, faces):
    return {'primitives': [{'attributes': {'POSITION': made.accessor(points, 'f4', 'VEC3')},
                            'indices': made.accessor(faces.reshape(-1, 1), 'u2', 'SCALAR')}]}


def read(made, folder):
    path = folder / 'parts.glb'
    path.write_bytes(made.glb())
    return read_character(path)


@pytest.mark.parametrize('pivots', [False, True])
def test_a_robot_of_rigid_parts(tmp_path, pivots):
    character = read(parts(pivots), tmp_path)
    fit = fit_character(character)
    names = [bone.name for bone in PERSON.bones]
    assert sorted(character.bone_names) == sorted(names)
    assert any('22 meshes become rigid parts' in note for note in fit.notes)
    above = {bone.name: PERSON.bones[bone.parent].name for bone in PERSON.bones if bone.parent >= 0}
    held = {body.bone.name: set(body.bones) for body in fit.bodies}
    assert len(held) >= 18
    for joint in fit.doll.joints:
        assert any(above.get(bone) in held[joint.parent] for bone in held[joint.child])
    assert 'J_Bip_C_Hips' in held[fit.doll.root.name]


def helmet(made, unit=1.0, mirrored=False):
    """Put a closed box of 0.3 m about the head, on the head's bone; gives its place."""
    head = next(k for k, bone in enumerate(PERSON.bones) if 'Head' in bone.name)
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    faces = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                      (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])
    made.data['meshes'].append(mesh(made, (corners - .5) * .3, faces))
    world = fit_rigs.worlds(PERSON)[head]
    place = np.eye(4)
    place[:3, 3] = (0, 1.65, 0)
    if mirrored:
        place[0, 0] = -1
    made.data['nodes'].append({'name': 'helmet', 'mesh': len(made.data['meshes']) - 1,
                               'matrix': (np.linalg.inv(world) @ place).T.ravel().tolist()})
    made.data['nodes'][head + 2].setdefault('children', []).append(len(made.data['nodes']) - 1)
    return head


@pytest.mark.parametrize('mirrored', [False, True])
def test_a_helmet_is_part_of_the_head(tmp_path, mirrored):
    plain = read(fit_rigs.document(PERSON), tmp_path)
    made = fit_rigs.document(PERSON)
    helmet(made, mirrored=mirrored)
    character = read(made, tmp_path)
    assert character.bone_names == plain.bone_names
    added = character.vertices[len(plain.vertices):]
    assert np.allclose(added.min(axis=0), (-.15, -.15, 1.5), atol=1e-6)
    assert np.allclose(added.max(axis=0), (.15, .15, 1.8), atol=1e-6)
    # Closed and the right way out: as much more as the box holds, 27 l.
    assert character.volume() == pytest.approx(plain.volume() + 0.027, rel=1e-5)
    before, after = (next(body.bone for body in fit_character(each).bodies if body.role == 'head')
                     for each in (plain, character))
    assert after.shape.volume > 1.5 * before.shape.volume


def test_a_mesh_on_no_bone_is_ignored_with_a_note(tmp_path):
    made = fit_rigs.document(PERSON)
    helmet(made)
    made.data['nodes'].append({'name': 'floor', 'mesh': 1})
    made.data['scenes'][0]['nodes'].append(len(made.data['nodes']) - 1)
    character = read(made, tmp_path)
    assert '1 mesh without a skin and a bone ignored' in character.notes


def test_one_mesh_without_a_skin_is_no_character(tmp_path):
    made = fit_rigs.document(PERSON)
    del made.data['skins'], made.data['nodes'][1]['skin']
    with pytest.raises(ModelErrors, match='a skinned mesh'):
        read(made, tmp_path)

"""Many bones: hair becomes swings, fingers stay where they are wanted, one of two characters."""
from dataclasses import replace

import fit_rigs
import numpy as np
import pytest
import wild_rigs
from fit_rigs import Rig, limb

from ragdoll_ros.fit.judging.verdict import judge
from ragdoll_ros.fit.pipeline import Options, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.model import errors
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.physics.simulation import Simulation


def hairy(name, strands=40, pieces=5):
    """A person with strands all about the head, each of some bones."""
    bones = fit_rigs.humanoid('vrm')
    head = next(k for k, bone in enumerate(bones) if 'Head' in bone.name)
    for strand in range(strands):
        angle = 2 * np.pi * strand / strands
        way = np.array((np.sin(angle), 0, np.cos(angle)))
        points = [(0, 1.7 - .6 * t, 0) + way * (.1 + .05 * t)
                  for t in np.linspace(0, 1, pieces + 1)]
        limb(bones, head, [f'{name}{strand}_{k}' for k in range(pieces)], points, [.008] * pieces)
    return Rig(name, bones)


def fit(rig, folder, options=None):
    return fit_character(read_character(fit_rigs.write(rig, folder)), options)


@pytest.mark.parametrize('name', ['hair', 'strand'])
def test_200_hair_bones_become_swings(tmp_path, name):
    """By their name, and without one because they are the thinnest of too many bodies."""
    made, bald = fit(hairy(name), tmp_path), fit_rigs.fitted('vrm')
    assert {bone.name for bone in made.doll.bones} == {bone.name for bone in bald.doll.bones}
    assert len(made.doll.swings) == 40
    for swing in made.doll.swings:
        assert swing.bone == 'J_Bip_C_Head'
        # From the head's height down to the ends of the strands, drawn 0.602 m long.
        assert len(swing.links) == 5
        assert sum(link.length for link in swing.links) == pytest.approx(.602, rel=.01)
    assert len(made.doll.riders) == len(made.character.bone_names)
    # The head is no bigger for its hair.
    head, plain = (each.doll.bone('J_Bip_C_Head').shape.volume for each in (made, bald))
    assert head == pytest.approx(plain, rel=.05)
    assert any('became swings' in note for note in made.notes) == (name == 'strand')
    with Simulation(above_ground(made.doll)) as simulation:
        for _ in range(20):
            state = simulation.advance()
    assert np.isfinite(state.positions).all()


def test_ears_of_one_bone_are_part_of_the_head(tmp_path):
    bones = fit_rigs.humanoid('vrm')
    head = next(k for k, bone in enumerate(bones) if 'Head' in bone.name)
    limb(bones, head, ['hairpin'], [(0, 1.8, 0), (0, 1.9, 0)], [.02])
    made = fit(Rig('pin', bones), tmp_path)
    assert made.doll.swings == ()
    assert next(body for body in made.bodies if 'hairpin' in body.bones).role == 'head'


def test_fingers_stay_with_smallest_0():
    character = fit_rigs.fitted('unreal').character
    kept = fit_character(character, Options(smallest=0))
    assert sum(body.role == 'finger' for body in kept.bodies) == 30
    assert not any(body.role == 'finger' for body in fit_rigs.fitted('unreal').bodies)


def test_what_would_not_run_is_refused(tmp_path):
    with pytest.raises(errors.OutOfRange, match=r'smallest.*222 bodies are more than 200'):
        fit(hairy('strand'), tmp_path, Options(smallest=0.001))


@pytest.mark.parametrize('beside', [(0, 1.2), (2.6, 0)], ids=['ahead', 'side by side'])
@pytest.mark.parametrize('skin', wild_rigs.SKINS)
def test_two_characters_in_one_skin_are_one_doll_and_told(tmp_path, skin, beside):
    """Side by side each is the other's mirror image, whose hips are no halves of one pelvis."""
    x, z = beside
    person = wild_rigs.person()
    other = [replace(bone, name=f'other {bone.name}',
                     parent=bone.parent + len(person) if bone.parent >= 0 else -1,
                     head=(bone.head[0] + x, bone.head[1] * .9, bone.head[2] + z),
                     tail=(bone.tail[0] + x, bone.tail[1] * .9, bone.tail[2] + z))
             for bone in person]
    wild = wild_rigs.Wild(Rig('two', [*person, *other]), skin, {}, ())
    made = fit_character(read_character(wild_rigs.write(wild, tmp_path)))
    [note] = [note for note in made.notes if 'another character, of 2' in note]
    assert 'other' in note
    alone = wild_rigs.Wild(Rig('one', person), skin, {}, ())
    one = fit_character(read_character(wild_rigs.write(alone, tmp_path)))
    assert [bone.name for bone in made.doll.bones] == [bone.name for bone in one.doll.bones]
    assert [(j.parent, j.child) for j in made.doll.joints] == [
        (j.parent, j.child) for j in one.doll.joints]
    assert len(made.doll.riders) == 44
    # The other's skin and size count for nothing.
    assert judge(made.doll, made, falls=False).word == judge(one.doll, one, falls=False).word
    assert made.doll.mass == pytest.approx(one.doll.mass, rel=1e-9)

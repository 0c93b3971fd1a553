"""Many bones: hair becomes swings, fingers stay where they are wanted."""
import re
from dataclasses import replace

import fit_rigs
import numpy as np
import pytest
from fit_rigs import Rig, limb

from ragdoll_ros.fit.pipeline import FitOptions, fit_character
from ragdoll_ros.fit.reading.character import read_character
from ragdoll_ros.fit.report import fit_report
from ragdoll_ros.model import errors
from ragdoll_ros.model.scene import above_ground
from ragdoll_ros.model.skeleton import Riders, rider_names
from ragdoll_ros.physics.simulation import Simulation


def hairy(name, strands=40, pieces=5, radius=.008, **changes):
    """A person with strands all about the head, each of some bones."""
    bones = fit_rigs.humanoid('vrm')
    head = next(k for k, bone in enumerate(bones) if 'Head' in bone.name)
    for strand in range(strands):
        angle = 2 * np.pi * strand / strands
        way = np.array((np.sin(angle), 0, np.cos(angle)))
        points = [(0, 1.7 - .6 * t, 0) + way * (.1 + .05 * t)
                  for t in np.linspace(0, 1, pieces + 1)]
        limb(bones, head, [f'{name}{strand}_{k}' for k in range(pieces)], points, [radius] * pieces)
    return Rig(name, bones, **changes)


def fit(rig, folder, options=None):
    return fit_character(read_character(fit_rigs.write(rig, folder)), options)


@pytest.mark.parametrize(('name', 'words'), [
    ('hair', None), ('strand', 'thin chains .*: strand0_0, strand1_0, strand2_0, strand3_0, ...;')])
def test_200_hair_bones_become_swings(tmp_path, name, words):
    """By their name, and without one because they are thin chains; then the report says so."""
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
    notes = [note for note in made.notes if 'became swings' in note]
    assert not notes if words is None else re.match(words, *notes)
    assert words is None or f'warning: {notes[0]}' in fit_report(made)
    with Simulation(above_ground(made.doll)) as simulation:
        for _ in range(20):
            state = simulation.advance()
    assert np.isfinite(state.positions).all()


def test_the_thinnest_of_too_many_bodies_become_swings(tmp_path):
    """Twelve braids of 7 cm and six bones: 92 bodies."""
    made = fit(hairy('braid', 12, 6, .035), tmp_path)
    assert len(made.doll.bones) == 20
    assert [len(swing.links) for swing in made.doll.swings] == [6] * 12
    assert any(note.startswith('92 bodies are too many') for note in made.notes)


@pytest.mark.parametrize('named', [True, False])
def test_thin_chains_without_a_name_become_swings(tmp_path, named):
    """On a head that has one, and where no bone of the file has."""
    rig = hairy('x', 6, 3, named=named)
    rig.bones = [replace(bone, name=f'bone_{k:03d}') if bone.name.startswith('x') else bone
                 for k, bone in enumerate(rig.bones)]
    made = fit(rig, tmp_path)
    head = next(k for k, bone in enumerate(rig.bones) if 'Head' in bone.name)
    carrier = made.character.bone_names.index(made.doll.swings[0].bone)
    assert len(made.doll.swings) == 6 and len(made.doll.bones) == 20
    assert np.allclose(made.character.positions[carrier], np.take(rig.bones[head].head, [2, 0, 1]),
                       atol=1e-6)
    assert all(len(swing.links) == 3 and len(link.riders) == 1
               for swing in made.doll.swings for link in swing.links)
    [note] = [note for note in made.notes if 'thin chains' in note]
    assert '--keep' in note and 'its entry in swings' in note


def test_what_the_note_on_thin_chains_says_is_so(tmp_path):
    """--keep makes bodies of a chain; one whose swing is deleted is fixed to the head."""
    kept = fit(hairy('x', 6, 3), tmp_path, FitOptions(keep=('x0_*',)))
    assert {f'x0_{k}' for k in range(3)} < {bone.name for bone in kept.doll.bones}
    assert len(kept.doll.swings) == 5
    doll = replace(kept.doll, swings=kept.doll.swings[1:])
    scene = above_ground(doll)
    with Simulation(scene) as simulation:
        for _ in range(20):
            state = simulation.advance()
        poses = Riders(scene).poses(state, simulation.swings.rods)
    names = list(rider_names(scene))
    head = state.poses(scene.bone_index('J_Bip_C_Head'))
    local = head.apply_inverse(poses.position[[names.index(f'x1_{k}') for k in range(3)]])
    frames = {rider.name: rider for rider in doll.riders}
    assert np.allclose(local, [frames[f'x1_{k}'].position for k in range(3)], atol=1e-9)


@pytest.mark.parametrize('name', ['unnamed', 'four_legs_unnamed_centimetres', 'spider', 'bird',
                                  'star', 'starfish', 'snake', 'chain', 'unreal', 'two_skeletons'])
def test_limbs_fingers_and_spines_are_no_thin_chains(name):
    assert fit_rigs.fitted(name).doll.swings == ()


@pytest.mark.parametrize(('at', 'points', 'radius'), [
    # On a hand, as long as an arm; as short as a finger; as thick as an arm; down to the feet.
    ('J_Bip_L_Hand', [(.84, 1.42, 0), (.84, 1.2, 0), (.84, 1.0, 0)], .01),
    ('J_Bip_C_Head', [(0, 1.7, -.1), (0, 1.66, -.16), (0, 1.62, -.2)], .01),
    ('J_Bip_C_Head', [(0, 1.7, -.1), (0, 1.45, -.3), (0, 1.2, -.3)], .06),
    ('J_Bip_C_Hips', [(0, .95, -.15), (0, .5, -.3), (0, 0, -.3)], .01)])
def test_other_chains_become_no_swings(tmp_path, at, points, radius):
    bones = fit_rigs.humanoid('vrm')
    carrier = next(k for k, bone in enumerate(bones) if bone.name == at)
    limb(bones, carrier, ['bone_017', 'bone_018'], points, [radius] * 2)
    assert fit(Rig('chain', bones), tmp_path).doll.swings == ()


def test_ears_of_one_bone_are_part_of_the_head(tmp_path):
    bones = fit_rigs.humanoid('vrm')
    head = next(k for k, bone in enumerate(bones) if 'Head' in bone.name)
    limb(bones, head, ['hairpin'], [(0, 1.8, 0), (0, 1.9, 0)], [.02])
    made = fit(Rig('pin', bones), tmp_path)
    assert made.doll.swings == ()
    assert next(body for body in made.bodies if 'hairpin' in body.bones).role == 'head'


def test_fingers_stay_with_smallest_0():
    character = fit_rigs.fitted('unreal').character
    forced = fit_character(character, FitOptions(smallest=0))
    assert sum(body.role == 'finger' for body in forced.bodies) == 30
    assert not any(body.role == 'finger' for body in fit_rigs.fitted('unreal').bodies)


@pytest.mark.parametrize(('keep', 'fingers'), [
    (('index_01_l',), {'index_01_l'}), (('thumb_0[12]_?',), {
        'thumb_01_l', 'thumb_02_l', 'thumb_01_r', 'thumb_02_r'}),
    (('*_0?_l', 'pinky_03_r'), {f'{finger.lower()}_0{n}_l' for finger in fit_rigs.FINGERS
                             for n in (1, 2, 3)} | {'pinky_03_r'})])
def test_bones_that_are_named_are_bodies(keep, fingers):
    """By their names and by patterns; all others are as without."""
    plain = fit_rigs.fitted('unreal')
    made = fit_character(plain.character, FitOptions(keep=keep))
    own = {bone.name for bone in plain.doll.bones}
    assert {bone.name for bone in made.doll.bones} == own | fingers
    assert made.doll.mass == pytest.approx(plain.doll.mass, rel=1e-9)
    # A finger hangs on the piece before it where that is kept, else on the hand.
    for joint in made.doll.joints:
        if joint.child in fingers:
            finger, piece, side = joint.child.split('_')
            before = f'{finger}_0{int(piece) - 1}_{side}'
            assert joint.parent == (before if before in fingers else f'hand_{side}')


@pytest.mark.parametrize('name', ['hair', 'strand'])
def test_a_strand_that_is_named_is_bodies_and_no_swing(tmp_path, name):
    made = fit(hairy(name), tmp_path, FitOptions(keep=(f'{name}7_*',)))
    own = [bone.name for bone in made.doll.bones if bone.name.startswith(name)]
    assert sorted(own) == [f'{name}7_{k}' for k in range(5)]
    assert len(made.doll.swings) == 39
    assert not any(swing.name.startswith(f'{name}7_') for swing in made.doll.swings)


@pytest.mark.parametrize(('keep', 'kind', 'words'), [
    ('index_1_l', errors.UnknownBone, 'keep.*index_1_l.*index_01_l'),
    ('*Thumbs*', errors.UnknownBone, r'keep.*Thumbs.*thumb_0'),
    ('pole', errors.WrongForm, 'keep.*pole.*moves 4 vertices or more')])
def test_a_bone_that_cannot_be_forced_is_refused(tmp_path, keep, kind, words):
    character = fit_rigs.fitted('unreal').character
    with_pole = replace(
        character, bone_names=(*character.bone_names, 'pole'), parents=(*character.parents, 0),
        positions=np.vstack([character.positions, (1, 0, 0)]),
        orientations=np.vstack([character.orientations, (0, 0, 0, 1)]))
    with pytest.raises(kind, match=words):
        fit_character(with_pole, FitOptions(keep=(keep,)))


def test_what_would_not_run_is_refused(tmp_path):
    with pytest.raises(errors.OutOfRange, match=r'smallest.*222 bodies are more than 200'):
        fit(hairy('strand'), tmp_path, FitOptions(smallest=0.001))
    with pytest.raises(errors.OutOfRange, match=r'keep.*fewer, for 220 bodies are more than 200'):
        fit(hairy('strand'), tmp_path, FitOptions(keep=('strand*',)))

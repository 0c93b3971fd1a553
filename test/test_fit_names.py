"""Roles from the names of well-known skeletons."""
import os
import subprocess
import sys

import fit_rigs
import pytest

from ragdoll_ros.files.bone_names.names import roles_of, side_of
from ragdoll_ros.files.bone_names.vocabulary import read_vocabulary
from ragdoll_ros.files.config import config_folder
from ragdoll_ros.model import errors

ROLES = {
    'hips': 'mixamorig:Hips pelvis J_Bip_C_Hips Bip01_Pelvis b_Hip_01 CC_Base_Hip',
    'spine': 'mixamorig:Spine2 spine_03 J_Bip_C_UpperChest LowerBack spine05 torso_joint_3 thorax',
    'neck': 'mixamorig:Neck neck_01 neck01 J_Bip_C_Neck upperneck',
    'head': 'mixamorig:Head head J_Bip_C_Head mixamorig:HeadTop_End Bip01_Head '
            'snout Muzzle antler.L',
    'clavicle': 'clavicle_l clavicle.L L_Collar lclavicle L_Thorax Bip01_L_Clavicle',
    'upper_arm': 'upperarm_r upperarm01.R J_Bip_R_UpperArm rhumerus LeftArm left_shoulder '
                 'Bip01_R_UpperArm Skeleton_arm_joint_R',
    'forearm': 'lowerarm_l lowerarm01.L LeftForeArm mixamorig:RightForeArm lradius L_Elbow '
               'J_Bip_L_LowerArm',
    'hand': 'hand_l wrist.L LeftHand lhand L_Wrist',
    'thigh': 'thigh_l upperleg01.L LeftUpLeg lfemur L_Hip J_Bip_L_UpperLeg b_LeftLeg01_015',
    'shin': 'calf_l lowerleg01.L ltibia L_Knee J_Bip_L_LowerLeg Bip01_L_Calf LeftShin '
            'stifle.L Gaskin_R',
    'foot': 'foot_l foot.L LeftFoot lfoot L_Ankle hock.L Metatarsus_l LeftTarsal',
    'toe': 'ball_l toe1-1.L LeftToeBase ltoes L_Toe',
    'tail': 'Tail1 b_Tail01_012 fluke_L Caudal_03',
    'soft': 'Ear.L hair3 jaw mane_02 Mandible beak',
    'wing': 'wing_01.L feather_R PectoralFin.L flipper_r dorsal_fin',
    None: 'Armature thing Bone.003 middle arm3 index'}


OTHERS = {
    'hips': '下半身 腰 Becken Hüfte',
    'spine': '上半身 上半身2 Wirbelsäule.001 Brust Bauch',
    'neck': '首 Hals', 'head': '頭 Kopf Schaedel',
    'clavicle': 'Schlüsselbein_L',
    'upper_arm': '左腕 右腕 右腕捩 Oberarm.R OberarmLinks lShldrBend arm_upper_l',
    'forearm': '左ひじ 右肘 左手捩 Unterarm_L linkerEllbogen lForearmBend',
    'hand': '左手首 右手首 Handgelenk.L linke_Hand',
    'finger': '左親指１ 右人指２ 左薬指3 ZeigefingerLinks',
    'thigh': '左足 右足 Oberschenkel.L lThighTwist leg_upper_r linkesBein',
    'shin': '左ひざ 右膝 Unterschenkel_R Wade.L Knie_l',
    'foot': '左足首 右足首 左足ＩＫ Fuß.L Fuss_R lFoot',
    'toe': '左つま先 Zehen.R', 'tail': 'Schwanz1 しっぽ', 'soft': '髪1 左目 Zunge スカート_0_1',
    None: '全ての親 センター グルーブ Wurzel'}


@pytest.mark.parametrize(('role', 'name'), [
    (role, name) for role, names in OTHERS.items() for name in names.split()])
def test_role_of_a_japanese_or_german_bone(role, name):
    """A finger on a hand, as index, middle and ring are words of their own; all others alone."""
    above = '手首' if role == 'finger' else 'x'
    assert roles_of((above, name), (-1, 0))[1] == role


def test_half_width_and_decomposed_letters_are_the_same():
    for name in ('左ひじ', '\u5de6\u3072\u3057\u3099', 'L_ﾋｼﾞ'):
        assert side_of(name) == 1
    assert roles_of(('\u5de6\u3072\u3057\u3099', 'Hu\u0308fte'), (-1, 0)) == ('forearm', 'hips')


WRAPS = ('{}', 'Ringmaster_{}', 'Handler|rig:{}', 'SK_Hand_Hero_{}', 'DEF-{}', '{}_skin', '{}.001',
         '{}_Kopf_jnt', 'ValveBiped.Bip01_{}', '{}_Armature_012', '頭_{}')
"""What rigs put around all their bones' names, also where it is the name of another bone."""


@pytest.mark.parametrize('wrap', WRAPS)
@pytest.mark.parametrize('style', ['mixamo', 'unreal', 'vrm', 'cmu', 'makehuman'])
def test_prefixes_and_suffixes_say_nothing(wrap, style):
    bones = fit_rigs.humanoid(style)
    names, parents = [bone.name for bone in bones], tuple(bone.parent for bone in bones)
    plain = roles_of(tuple(names), parents)
    assert None not in plain[1:]
    wrapped = tuple(wrap.format(name.rpartition(':')[2]) for name in names)
    assert roles_of(wrapped, parents) == plain
    assert [side_of(name) for name in wrapped] == [side_of(name) for name in names]


def test_a_users_words_come_first(tmp_path):
    path = tmp_path / 'bone_names.yaml'
    path.write_text('roles: {forearm: [avambraccio], foot: [hand]}\nleft: [sinistro]\n')
    words = read_vocabulary([path, config_folder() / 'bone_names.yaml'])
    assert words.roles[:2] == (('forearm', 'avambraccio'), ('foot', 'hand'))
    assert words.sides['sinistro'] == words.sides['left'] == 1
    assert ('shin', 'knee') in words.roles


def test_a_users_words_are_read_by_the_command(tmp_path):
    folder = tmp_path / 'ragdoll_ros'
    folder.mkdir()
    (folder / 'bone_names.yaml').write_text('roles: {shin: [polpaccio]}\n')
    code = ("from ragdoll_ros.files.bone_names.names import roles_of\n"
            "print(roles_of(('polpaccio_l',), (-1,)))")
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=60,
                          env={**os.environ, 'XDG_CONFIG_HOME': str(tmp_path)}, check=True)
    assert done.stdout.strip() == "('shin',)"


@pytest.mark.parametrize(('text', 'words'), [
    ('roles: {elbow: [x]}', 'one of toe, finger'), ('roles: [x]', 'lists of words'),
    ('role: {}', 'lists of words'), ('roles: {hand: x}', 'lists of words'), ('[1', 'YAML'),
    ("roles: {hand: ['']}", 'not empty'), ('7', 'lists of words')])
def test_a_file_of_words_that_is_none_is_refused(tmp_path, text, words):
    path = tmp_path / 'bone_names.yaml'
    path.write_text(text)
    with pytest.raises(errors.ModelErrors, match=words):
        read_vocabulary([path, config_folder() / 'bone_names.yaml'])


@pytest.mark.parametrize(('role', 'name'), [
    (role, name) for role, names in ROLES.items() for name in names.split()])
def test_role_of_a_bone_alone(role, name):
    assert roles_of((name,), (-1,)) == (role,)


@pytest.mark.parametrize(('names', 'roles'), [
    ('LeftShoulder LeftArm LeftForeArm LeftHand LeftHandIndex1',
     'clavicle upper_arm forearm hand finger'),
    ('LeftUpLeg LeftLeg LeftFoot LeftToeBase', 'thigh shin foot toe'),
    ('leg_joint_L_1 leg_joint_L_2 leg_joint_L_3 leg_joint_L_5', 'thigh shin foot toe'),
    ('L_Collar L_Shoulder L_Elbow L_Wrist', 'clavicle upper_arm forearm hand'),
    ('hand_r index_01_r index_02_r', 'hand finger finger'),
    ('femur_l stifle_l hock_l pastern_l hoof_l', 'thigh shin foot toe toe'),
    ('scapula_l humerus_l radius_l carpus_l pastern_l', 'clavicle upper_arm forearm hand finger'),
    ('BackThigh.L Gaskin.L Cannon.L BackFetlock.L', 'thigh shin foot toe'),
    ('Oberarm_L Unterarm_L Pfote_L Kralle_L', 'upper_arm forearm hand finger'),
    ('thing_l claw_l', 'None None'),
    ('clavicle.L shoulder01.L upperarm01.L upperarm02.L lowerarm01.L',
     'clavicle clavicle upper_arm upper_arm forearm')])
def test_roles_that_hang_on_the_bones_around(names, roles):
    names = tuple(names.split())
    found = roles_of(names, tuple(range(-1, len(names) - 1)))
    assert tuple(map(str, found)) == tuple(roles.split())


@pytest.mark.parametrize(('name', 'side'), [
    ('mixamorig:LeftArm', 1), ('thigh_l', 1), ('upperarm01.R', -1), ('Bip01 L Calf', 1),
    ('rhumerus', -1), ('lfoot', 1), ('R_Knee', -1), ('head', 0), ('lowerback', 0), ('root', 0),
    ('leg_joint_R_2', -1), ('J_Bip_L_Hand', 1), ('neck', 0), ('radius', 0)])
def test_side(name, side):
    assert side_of(name) == side

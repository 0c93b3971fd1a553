"""Roles from the names of well-known skeletons."""
import pytest

from ragdoll_ros.fit.names import roles_of, side_of

ROLES = {
    'hips': 'mixamorig:Hips pelvis J_Bip_C_Hips Bip01_Pelvis b_Hip_01 CC_Base_Hip',
    'spine': 'mixamorig:Spine2 spine_03 J_Bip_C_UpperChest LowerBack spine05 torso_joint_3 thorax',
    'neck': 'mixamorig:Neck neck_01 neck01 J_Bip_C_Neck upperneck',
    'head': 'mixamorig:Head head J_Bip_C_Head mixamorig:HeadTop_End Bip01_Head',
    'clavicle': 'clavicle_l clavicle.L L_Collar lclavicle L_Thorax Bip01_L_Clavicle',
    'upper_arm': 'upperarm_r upperarm01.R J_Bip_R_UpperArm rhumerus LeftArm left_shoulder '
                 'Bip01_R_UpperArm Skeleton_arm_joint_R',
    'forearm': 'lowerarm_l lowerarm01.L LeftForeArm mixamorig:RightForeArm lradius L_Elbow '
               'J_Bip_L_LowerArm',
    'hand': 'hand_l wrist.L LeftHand lhand L_Wrist',
    'thigh': 'thigh_l upperleg01.L LeftUpLeg lfemur L_Hip J_Bip_L_UpperLeg b_LeftLeg01_015',
    'shin': 'calf_l lowerleg01.L ltibia L_Knee J_Bip_L_LowerLeg Bip01_L_Calf LeftShin',
    'foot': 'foot_l foot.L LeftFoot lfoot L_Ankle',
    'toe': 'ball_l toe1-1.L LeftToeBase ltoes L_Toe',
    'tail': 'Tail1 b_Tail01_012',
    'soft': 'Ear.L hair3 jaw',
    None: 'Armature thing Bone.003 middle arm3 index'}


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
    ('clavicle.L shoulder01.L upperarm01.L upperarm02.L lowerarm01.L',
     'clavicle clavicle upper_arm upper_arm forearm')])
def test_roles_that_hang_on_the_bones_around(names, roles):
    names = tuple(names.split())
    assert roles_of(names, tuple(range(-1, len(names) - 1))) == tuple(roles.split())


@pytest.mark.parametrize(('name', 'side'), [
    ('mixamorig:LeftArm', 1), ('thigh_l', 1), ('upperarm01.R', -1), ('Bip01 L Calf', 1),
    ('rhumerus', -1), ('lfoot', 1), ('R_Knee', -1), ('head', 0), ('lowerback', 0), ('root', 0),
    ('leg_joint_R_2', -1), ('J_Bip_L_Hand', 1), ('neck', 0), ('radius', 0)])
def test_side(name, side):
    assert side_of(name) == side

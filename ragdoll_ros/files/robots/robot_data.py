"""`robots:` of a scene, as it is saved: joints between those of its bodies that move together."""
from ...model.errors import ModelError
from ...model.robot import Robot, RobotJoint
from ...model.rotation import IDENTITY
from ...model.scene import Scene
from ..schema import entries, has_error_under, try_build

MIMIC = ('joint', 'multiplier', 'offset')


def build_robots(data: dict, found: list[ModelError]) -> list[Robot]:
    """The robots of a scene's data. Appends every error to ``found``."""
    made: list[Robot] = []
    for index, entry in enumerate(entries(data, 'robots')):
        where = f'robots[{index}]'
        if has_error_under(found, where):
            continue
        joints = [try_build(found, f'{where}.joints[{number}]', _joint, joint)
                  for number, joint in enumerate(entry['joints'])]
        if all(joints):
            made += filter(None, [try_build(found, where, Robot, **{**entry, 'joints': joints})])
    return made


def robots_data(scene: Scene) -> dict:
    """The robots of a scene in the form of scene.schema.json, as ``robots``; else nothing."""
    return {'robots': [_robot_data(robot) for robot in scene.robots]} if scene.robots else {}


def _joint(entry: dict) -> RobotJoint:
    fields = dict(entry)
    if 'mimic' in entry:
        fields['mimic'] = tuple(entry['mimic'][key] for key in MIMIC)
    return RobotJoint(**fields)


def _robot_data(robot: Robot) -> dict:
    return {'name': robot.name, 'position': list(robot.position),
            'orientation': list(robot.orientation), 'links': dict(robot.links),
            'joints': [_joint_data(joint) for joint in robot.joints]}


def _joint_data(joint: RobotJoint) -> dict:
    optional = {'orientation': None if joint.orientation == IDENTITY else list(joint.orientation),
                'start': joint.start or None,
                'mimic': joint.mimic and dict(zip(MIMIC, joint.mimic, strict=True))}
    return {'name': joint.name, 'kind': joint.kind, 'parent': joint.parent, 'child': joint.child,
            'position': list(joint.position), 'axis': list(joint.axis),
            **{key: value for key, value in optional.items() if value is not None}}

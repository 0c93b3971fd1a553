"""Positions, velocities and efforts of a JointState by the names of its joints."""
from sensor_msgs.msg import JointState

from ...model import errors


def joint_values(message: JointState) -> tuple[dict[str, float], dict[str, float]]:
    """Positions and velocities of a message by the names of joints; either may be left out. Raises
    WrongForm.
    """
    return _by_name(message, 'position'), _by_name(message, 'velocity')


def joint_efforts(message: JointState) -> dict[str, float]:
    """Efforts of a message by the names of joints. Raises WrongForm."""
    efforts = _by_name(message, 'effort')
    if len(efforts) < len(message.name):
        raise errors.WrongForm('effort', 0, f'as many as names, {len(message.name)}')
    return efforts


def _by_name(message: JointState, key: str) -> dict[str, float]:
    names, numbers = list(message.name), getattr(message, key)
    if len(set(names)) < len(names):
        raise errors.WrongForm('name', names, 'different names')
    if len(numbers) not in (0, len(names)):
        raise errors.WrongForm(key, len(numbers), f'as many as names, {len(names)}, or none')
    return dict(zip(names, numbers, strict=False))

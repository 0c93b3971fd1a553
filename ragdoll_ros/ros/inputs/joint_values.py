"""Positions and velocities of a JointState by the names of its joints."""
from sensor_msgs.msg import JointState

from ...model import errors


def joint_values(message: JointState) -> tuple[dict[str, float], dict[str, float]]:
    """Positions and velocities of a message by the names of joints; either may be left out. Raises
    WrongForm.
    """
    names = list(message.name)
    if len(set(names)) < len(names):
        raise errors.WrongForm('name', names, 'different names')
    found = []
    for key in ('position', 'velocity'):
        numbers = getattr(message, key)
        if len(numbers) not in (0, len(names)):
            raise errors.WrongForm(key, len(numbers), f'as many as names, {len(names)}, or none')
        found.append(dict(zip(names, numbers, strict=False)))
    return found[0], found[1]

"""Sensors as the parameter ``imus`` writes them: a bone, and where on it."""
from __future__ import annotations

from collections.abc import Sequence

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_topic_name import validate_topic_name

from ..model import errors, rotation
from ..physics.sensors.imu import ImuMount


def mount_of(text: str, bones: Sequence[str]) -> ImuMount:
    """From one of ``bones``, with x y z (m) or x y z roll pitch yaw (rad) behind it or nothing.

    Raises UnknownBone for another text, NotFinite for a number that is none.
    """
    words = text.split()
    for count in (0, 3, 6):
        name = ' '.join(words[:len(words) - count])
        if name in bones:
            try:
                x, y, z, *angles = map(float, words[len(words) - count:] or [0.0] * 3)
                errors.check_finite('imus', (x, y, z, *angles))
            except errors.ModelError:
                raise
            except ValueError:
                break
            turn = rotation.from_rpy(*angles) if angles else rotation.IDENTITY
            return ImuMount(name, (x, y, z), tuple(turn))
    raise errors.UnknownBone('imus', text, f'{errors.one_of(bones, text)}; behind it nothing, '
                             'x y z, or x y z roll pitch yaw')


def check_worn(imus: Sequence[str], bones: Sequence[str]) -> None:
    """Raise a ModelError for sensors that can not be worn."""
    worn = [mount_of(text, bones).bone for text in filter(str.strip, imus)]
    for bone in worn:
        try:
            validate_topic_name(sensor_topic(bone))
        except InvalidTopicNameException:
            raise errors.WrongForm('imus', bone, "a bone whose name may be in a topic's") from None
        if worn.count(bone) > 1:
            raise errors.DuplicateName('imus', bone, 'one sensor on a bone')


def sensor_topic(bone: str) -> str:
    """Where a bone's sensor is heard."""
    return f'~/imu/{bone}/data_raw'

"""The parameter ``imus``: each entry names a bone and where on it the sensor is mounted."""
from __future__ import annotations

import contextlib
from collections.abc import Sequence

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_topic_name import validate_topic_name

from ...model import errors, rotation
from ...model.scene_change import SceneChange
from ...physics.sensors.imu import ImuMount


def parse_mount(text: str, bones: Sequence[str]) -> ImuMount:
    """Parse 'bone', 'bone x y z' (m) or 'bone x y z roll pitch yaw' (rad), in the bone's frame.

    Raises UnknownBone for another text, NotFinite for a number that is not finite.
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
            orientation = rotation.from_rpy(*angles) if angles else rotation.IDENTITY
            return ImuMount(name, (x, y, z), tuple(orientation))
    raise errors.UnknownBone('imus', text, f'{errors.one_of(bones, text)}, alone or followed by '
                             'x y z or x y z roll pitch yaw')


def check_imus(imus: Sequence[str], bones: Sequence[str]) -> None:
    """Raise a ModelError unless each entry is a valid mount, with one sensor per bone."""
    mounted = [parse_mount(text, bones).bone for text in filter(str.strip, imus)]
    for bone in mounted:
        try:
            validate_topic_name(imu_topic(bone))
        except InvalidTopicNameException:
            raise errors.WrongForm('imus', bone, 'a name that a topic may contain') from None
        if mounted.count(bone) > 1:
            raise errors.DuplicateName('imus', bone, 'one sensor on a bone')


def renamed_imus(imus: Sequence[str], change: SceneChange) -> tuple[str, ...]:
    """Return the entries of bones that stay in a scene, with their new names. Entries with a name
    that no topic may contain are left out; one empty text if none remains.
    """
    found = []
    for text in map(str.strip, filter(str.strip, imus)):
        bone = parse_mount(text, change.before.bone_names).bone
        renamed = change.bone_names.get(bone, '') + text[len(bone):]
        with contextlib.suppress(errors.ModelError):
            check_imus([renamed], change.after.bone_names)
            found.append(renamed)
    return tuple(filter(str.strip, found)) or ('',)


def imu_topic(bone: str) -> str:
    """Topic of a bone's sensor."""
    return f'~/imu/{bone}/data_raw'

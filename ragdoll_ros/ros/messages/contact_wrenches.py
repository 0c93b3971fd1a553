"""Contacts as a MultiDOFJointState: what touches what, where, and with which force and torque."""
from __future__ import annotations

from typing import TYPE_CHECKING

from geometry_msgs.msg import Wrench
from sensor_msgs.msg import MultiDOFJointState

from ...model.scene import Scene
from .convert import contact_poses, to_header, to_transform, to_vector

if TYPE_CHECKING:  # else the page, which imports this folder, would load an engine
    from ...physics.engine.protocol import Contacts

SEPARATOR = '//'
"""Between the names of what touches: no name of a doll, bone or body has a slash."""


def contact_names(scene: Scene, contacts: Contacts) -> list[str]:
    """Names (c,) of what touches: bone//bone, bone//body or bone//ground."""
    return [scene.bone_names[a] + SEPARATOR + scene.touched_name(b, body)
            for a, b, body in zip(contacts.a, contacts.b, contacts.bodies, strict=True)]


def to_contact_wrenches(frame: str, scene: Scene, stamp: int,
                        contacts: Contacts) -> MultiDOFJointState:
    """The contacts' names, their poses as on ~/contacts, and the wrench on the first bone about the
    contact point, along the world axes, N and N m.
    """
    return MultiDOFJointState(
        header=to_header(stamp, frame), joint_names=contact_names(scene, contacts),
        transforms=[to_transform(row) for row in contact_poses(contacts).tolist()],
        wrench=[Wrench(force=to_vector(row[:3]), torque=to_vector(row[3:]))
                for row in contacts.wrenches])

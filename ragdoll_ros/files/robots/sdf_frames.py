"""Frames of SDF: poses of links, joints, frames and models relative to each other.

http://sdformat.org/tutorials?tut=pose_frame_semantics
"""
from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np

from ...model import errors, rotation
from ...model.pose import Pose
from .xml_text import parse_numbers

FRAMED = ('link', 'model', 'frame', 'joint')
"""Elements that define a frame of their name: of equal names, as before SDF 1.7, the first ones."""

OWN_FRAMES = ('', '__model__', 'world')
"""Names of the frame of the model or world itself."""

MODEL_FRAME = Pose()


class SdfModel:
    """A <model>, or a <world> as one; ``prefix`` is put before its names in the file's scope.

    Its methods raise RecursionError where a frame is relative to itself.
    """

    def __init__(self, element: ElementTree.Element, prefix: str = '',
                 is_static: bool = False) -> None:
        self.element, self.prefix = element, prefix
        self.is_static = is_static or element.findtext('static', '').strip() in ('true', '1')
        self.elements: dict[str, ElementTree.Element] = {}
        for tag in FRAMED:
            for child in element.findall(tag):
                self.elements.setdefault(text_of(child, 'name', tag), child)
        self.models = {name: SdfModel(child, f'{prefix}{name}::', self.is_static)
                       for name, child in self.elements.items() if child.tag == 'model'}
        self._poses: dict[str, Pose] = {}

    def pose(self, name: str) -> Pose:
        """Return the pose of a named frame in the model's frame. Raises WrongForm for an unknown
        name.
        """
        if name in OWN_FRAMES:
            return MODEL_FRAME
        model, _, inner = name.partition('::')
        if inner and model in self.models:
            return self.pose(model).compose(self.models[model].pose(inner))
        if name not in self.elements:
            raise errors.WrongForm(f'{self.prefix}pose', name,
                                   errors.one_of([*OWN_FRAMES[1:], *self.elements], name))
        if name not in self._poses:
            self._poses[name] = self._pose_of(self.elements[name], name)
        return self._poses[name]

    def place(self, element: ElementTree.Element, base: str) -> Pose:
        """Return the pose of an element in the model's frame; ``base`` is the frame that its <pose>
        is relative to where it names none.
        """
        found = element.find('pose')
        if found is None:
            return self.pose(base)
        named = found.get('relative_to') or found.get('frame') or base
        return self.pose(named).compose(parse_pose(
            found, f'{self.prefix}{element.get("name", element.tag)}.pose'))

    def link_of(self, name: str) -> str | None:
        """Return the name in the file of the link to which a frame is attached; None if that is the
        world, or if there is no such link.
        """
        model, _, inner = name.partition('::')
        if inner and model in self.models:
            return self.models[model].link_of(inner)
        element = self.elements.get(name)
        if element is None or element.tag == 'joint':
            return None
        if element.tag == 'frame':
            return self.link_of(element.get('attached_to', ''))
        if element.tag == 'model':
            inside = self.models[name]
            return next((inside.link_of(link) for link, found in inside.elements.items()
                         if found.tag == 'link'), None)
        return f'{self.prefix}{name}'

    def _pose_of(self, element: ElementTree.Element, name: str) -> Pose:
        if element.tag == 'joint':
            return self.place(element, child_text(element, 'child', f'joint {self.prefix}{name}'))
        place = self.place(element, element.get('attached_to', ''))
        if held := element.get('placement_frame'):
            return place.compose(self.models[name].pose(held).relative(MODEL_FRAME))
        return place


def text_of(element: ElementTree.Element, key: str, where: str) -> str:
    """Attribute of an element. Raises WrongForm if it is missing or empty."""
    text = element.get(key)
    if not text:
        raise errors.WrongForm(where, text, f'a {key}')
    return text


def child_text(element: ElementTree.Element, tag: str, where: str) -> str:
    """Text of an element's child ``tag``. Raises WrongForm if it is missing or empty."""
    text = (element.findtext(tag) or '').strip()
    if not text:
        raise errors.WrongForm(where, text or None, f'a <{tag}>')
    return text


def parse_pose(element: ElementTree.Element, where: str) -> Pose:
    """Pose of a <pose>: x y z roll pitch yaw, in rad or degrees, or x y z and a quaternion."""
    text = (element.text or '').strip()
    if not text:
        return MODEL_FRAME
    if element.get('rotation_format') == 'quat_xyzw':
        numbers = parse_numbers(text, 7, where)
        if not np.any(numbers[3:]):
            raise errors.NotUnit(where, text, 'a quaternion x, y, z, w, not zero')
        return Pose(numbers[:3], rotation.normalized(numbers[3:]))
    numbers = parse_numbers(text, 6, where)
    angles = numbers[3:].tolist()
    if element.get('degrees') in ('true', '1'):
        angles = map(math.radians, angles)
    return Pose(numbers[:3], rotation.from_rpy(*angles))

"""A ball that a page throws at what is under its pointer: a doll of the scene like the others."""
from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import viser

from ...model.errors import RagdollError
from ...model.ragdoll import Bone, Ragdoll
from ...model.scene import Placement, Scene
from ...model.shapes import Sphere
from ..sources.source import Frame, Source
from .hover import Hover, bone_at
from .motion import Motion, doll_mean

RADIUS = 0.12
"""m: a medicine ball's."""

MASS = 5.0
"""kg: with SPEED as much momentum as the tap of an arrow key."""

SPEED = 10.0
"""m/s towards the target."""

RANGE = 3.0
"""m from the target at which it is let go, or at the camera where that is nearer."""

NAME = 'ball'

ROLLING_FRICTION = 0.004
"""m: 3 % of the radius, as of a ball filled with sand: it rolls for some metres."""

BALL = Ragdoll(NAME, (Bone(NAME, Sphere(RADIUS), MASS, (0, 0, 0), color=(0.85, 0.33, 0.1, 1),
                           rolling_friction=ROLLING_FRICTION),))

HINT = ('At what is clicked; the key T throws it at the pointer. The first time, a ball of '
        f'{MASS:g} kg is put into the scene, which starts again')


class BallThrower:
    """A checkbox and the key T in the current GUI container; hidden for a recording.

    ``frame`` gives the shown frame, or None if that is in the past; then ``refuse`` tells the page.
    While ``is_editing``, clicks select and nothing is thrown.
    """

    def __init__(self, server: viser.ViserServer, source: Source) -> None:
        self.frame: Callable[[], Frame | None] = lambda: None
        self.refuse: Callable[[viser.ClientHandle | None], None] = lambda _: None
        self.is_editing: Callable[[], bool] = lambda: False
        self._source = source
        self._pending: tuple[np.ndarray, np.ndarray] | None = None
        """Line of sight of a throw that waits for the scene with the ball."""
        can_throw = source.recording is None
        self._by_click = server.gui.add_checkbox('Throw a ball by a click', False,
                                                visible=can_throw, hint=HINT)

    def connect(self, server: viser.ViserServer, hover: Hover) -> None:
        """Throw at clicks, and on the key T along a page's line of sight.

        That is through the pointer, or the middle of the picture; see Hover.line_of_sight.
        """
        if self._source.recording is not None:
            return
        hover.on_click = self._on_click
        command = server.gui.add_command('Throw a ball', hotkey='T')

        @command.on_trigger
        async def _(event: viser.CommandEvent) -> None:
            if event.client is not None:
                self.throw(event.client, *hover.line_of_sight(event.client))

    @property
    def takes_clicks(self) -> bool:
        """Whether a click throws."""
        return self._by_click.value and not self.is_editing()

    def _on_click(self, client: viser.ClientHandle, origin: np.ndarray,
                  direction: np.ndarray) -> None:
        if self.takes_clicks:
            self.throw(client, origin, direction)

    def throw(self, client: viser.ClientHandle, origin: np.ndarray,
              direction: np.ndarray) -> None:
        """Throw along a line of sight; to be called in viser's thread. ``origin``, ``direction``
        (3,), world frame.
        """
        if self.is_editing():
            return
        frame = self.frame()
        if frame is None:
            self.refuse(client)
        elif has_ball(frame.scene):
            self._pending = origin, direction
        elif self._pending is None:
            self._pending = origin, direction
            asyncio.get_running_loop().run_in_executor(None, self._add, client, frame.scene)
            flies = ' It flies when you play (Space).' if self._source.status.paused else ''
            client.add_notification('A ball joins the scene',
                                    f'The scene starts again with it.{flies}', auto_close_seconds=6)

    def update(self, frame: Frame, motion: Motion) -> None:
        """Throw a waiting ball once ``motion`` tells who falls, or at once while paused.

        ``frame`` is the newest, ``motion`` that up to it.
        """
        if self._pending is None or not has_ball(frame.scene):
            return
        if motion.knows_falling or self._source.status.paused:
            (origin, direction), self._pending = self._pending, None
            target = aim(frame, motion, origin, direction)
            self._source.set_state(NAME, *launch(frame.scene, origin, target))

    def _add(self, client: viser.ClientHandle, scene: Scene) -> None:
        try:
            self._source.set_scene(with_ball(scene))
        except RagdollError as error:
            self._pending = None
            client.add_notification('Refused', str(error), color='red')


def has_ball(scene: Scene) -> bool:
    """Whether there is something to throw."""
    return any(placement.name == NAME for placement in scene.dolls)


def with_ball(scene: Scene) -> Scene:
    """The scene with a ball at rest, half a metre in front of all dolls (+x), on the ground."""
    centers = np.array([placement.bone_pose(bone).position for placement in scene.dolls
                        for bone in placement.doll.bones])
    reach = max(max(bone.shape.half_extents) for bone in scene.bones)
    place = centers.mean(axis=0)
    place[0] = centers[:, 0].max() + reach + RADIUS + 0.5
    if scene.ground is not None:
        normal = np.array(scene.ground.normal)
        place += normal * (scene.ground.offset + RADIUS - place @ normal)
    ball = Placement(BALL, NAME, tuple(place.tolist()))
    return dataclasses.replace(scene, dolls=(*scene.dolls, ball))


class Target(NamedTuple):
    """What a ball is thrown at, and how it moves; (3,), world frame."""

    position: np.ndarray
    """m."""
    velocity: np.ndarray = np.zeros(3)
    """m/s."""
    falls: bool = False
    """Whether gravity accelerates it; else nothing does."""

    def at(self, time: float, scene: Scene) -> np.ndarray:
        """Where the target will be in ``time`` s, (3,) m; a falling one stops on the ground."""
        place = self.position + self.velocity * time
        if self.falls:
            place += np.array(scene.gravity) * time ** 2 / 2
            if scene.ground is not None:
                normal = np.array(scene.ground.normal)
                place += normal * max(0.0, scene.ground.offset + RADIUS - place @ normal)
        return place


def aim(frame: Frame, motion: Motion, origin: np.ndarray, direction: np.ndarray) -> Target:
    """What a line of sight meets: a bone but the ball's, else the ground, else the point at the
    distance of the first doll, RANGE or more. ``origin`` (3,) m, ``direction`` (3,).
    """
    unit = direction / np.linalg.norm(direction)
    names = [placement.name for placement in frame.scene.dolls]
    ball = frame.scene.bone_slices[names.index(NAME)]
    bone = bone_at(frame, origin, unit, ignored=ball)
    if bone is not None:
        depth = (frame.state.positions[bone] - origin) @ unit
        place = origin + depth * unit
        if motion.frame is not frame:
            return Target(place)
        return Target(place, motion.velocities()[bone], motion.falls(bone))
    ground = frame.scene.ground
    if ground is not None:
        normal = np.array(ground.normal)
        height, sinks = origin @ normal - ground.offset, -(unit @ normal)
        if height > 0 and sinks > 1e-6:
            return Target(origin + height / sinks * unit)
    depth = (doll_mean(frame.scene, 0, frame.state.positions) - origin) @ unit
    return Target(origin + max(depth, RANGE) * unit)


def launch(scene: Scene, origin: np.ndarray,
           target: Target) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Position (3,) m, RANGE or less from ``target``, and velocity (3,) m/s of a ball that meets it
    after the time t = distance / SPEED: x = x0 + v t + g t^2 / 2. The distance is from the position
    to ``target``. ``origin`` (3,) m: of the camera.
    """
    way = target.position - origin
    distance = max(float(np.linalg.norm(way)), 1e-6)
    length = min(distance, RANGE)
    start = target.position - way * (length / distance)
    time = max(length, RADIUS) / SPEED
    speed = (target.at(time, scene) - start) / time - np.array(scene.gravity) * time / 2
    return tuple(start.tolist()), tuple(speed.tolist())

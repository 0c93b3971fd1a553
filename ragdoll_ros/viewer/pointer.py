"""Drags bodies with the pointer, at constant distance from the camera.

Viser finds the nearest body under the pointer. The grabbed point A keeps its distance from the
camera C: with D the direction from C to the pointer, target = C + D |A - C|.
"""
from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

import numpy as np
import viser

from ..model.pose import Pose
from ..model.scene import Scene
from ..model.state import State
from .drawing.bodies import Bodies
from .drawing.skin_meshes import SkinMeshes
from .sources.source import Frame, Source
from .user_actions import UserActions
from .viser_internals import connections

PING_PERIOD = 0.5
"""s from a response to the next ping."""

PING_TIMEOUT = 2.5
"""s: with PING_PERIOD, as long as a node waits for a client that drags."""


ADDING = ('cmd/ctrl', 'shift')
"""Keys with which a click selects a bone besides others."""


class Pointer:
    """Drags and clicks of all pages; each page has a hand of its own.

    ``select`` takes the name of a bone that is clicked, and whether it is added to others.

    Viser's callbacks are coroutines here, so that they run in order; they must not block.
    """

    def __init__(self, source: Source, actions: UserActions,
                 grabbable_frame: Callable[[], Frame | None], select: Callable[[str, bool], None],
                 refuse: Callable[[viser.ClientHandle], None] = lambda _: None) -> None:
        self._source, self._actions = source, actions
        self._frame, self._select = grabbable_frame, select
        self._refuse = refuse
        """Tells a page why it cannot grab anything."""
        self._distances: dict[int, float] = {}
        """Distance from the camera, m, of the point that each client holds."""
        self._watches: dict[int, asyncio.Task] = {}

    def attach(self, bodies: Bodies, skins: SkinMeshes) -> None:
        """Listen to drags and clicks on the bodies and skins of a new scene."""
        for batch in bodies.batches:
            self._listen(batch.handle, lambda index, _, bones=batch.bones: int(bones[index or 0]))
        for skin in skins.handles:
            self._listen(skin, lambda _, point: self._nearest_bone(point))

    def _listen(self, handle: viser.BatchedMeshHandle | viser.MeshSkinnedHandle,
                bone_of: Callable[[int | None, np.ndarray], int]) -> None:
        async def on_drag(event: viser.SceneNodeDragEvent) -> None:
            if event.phase == 'start':
                point = np.array(event.start_position)
                self._grab(event, bone_of(event.instance_index, point), point)
            elif event.client_id in self._distances and event.phase == 'end':
                self._unwatch(event)
                self._let_go(event)
            elif event.client_id in self._distances:
                self._actions.run(self._source.drag, _hand(event), self._target(event))

        async def on_click(event: viser.SceneNodePointerEvent) -> None:
            frame = self._frame()
            if frame is None:
                return
            eye, direction = np.array(event.ray_origin), np.array(event.ray_direction)
            point = eye + direction * self._depth(eye, direction)
            bone = bone_of(event.instance_index, point)
            self._select(frame.scene.bone_names[bone], event.modifier is not None)

        handle.on_drag('left')(on_drag)
        for modifier in (None, *ADDING):
            handle.on_click(modifier=modifier)(on_click)

    def _grab(self, event: viser.SceneNodeDragEvent, bone: int, point: np.ndarray) -> None:
        frame = self._frame()
        if frame is None:
            self._refuse(event.client)
            return
        eye = event.client.camera.position
        self._distances[event.client_id] = float(np.linalg.norm(point - eye))
        local = to_bone_frame(frame.scene, frame.state, bone, point)
        self._actions.run(self._source.grab, _hand(event), frame.scene.bone_names[bone],
                          tuple(local.tolist()), self._target(event))
        self._watch(event)

    def _watch(self, event: viser.SceneNodeDragEvent) -> None:
        """Let go if the page's connection is lost."""
        async def watch() -> None:
            await _wait_until_disconnected(event.client)
            self._let_go(event)

        self._unwatch(event)
        self._watches[event.client_id] = asyncio.get_running_loop().create_task(watch())

    def _unwatch(self, event: viser.SceneNodeDragEvent) -> None:
        watch = self._watches.pop(event.client_id, None)
        if watch is not None:
            watch.cancel()

    def _let_go(self, event: viser.SceneNodeDragEvent) -> None:
        if self._distances.pop(event.client_id, None) is not None:
            self._actions.run(self._source.let_go, _hand(event))

    def _target(self, event: viser.SceneNodeDragEvent) -> tuple[float, ...]:
        target = target_at_distance(event.client.camera.position, np.array(event.end_position),
                                    self._distances[event.client_id])
        return tuple(target.tolist())

    def _nearest_bone(self, point: np.ndarray) -> int:
        frame = self._frame()
        return nearest_bone(frame.scene, frame.state, point)

    def _depth(self, eye: np.ndarray, direction: np.ndarray) -> float:
        """Distance, m, along a ray to the point nearest to the centre of any bone."""
        offsets = self._frame().state.positions - eye
        along = offsets @ direction
        aside = np.linalg.norm(offsets - along[:, None] * direction, axis=1)
        return float(along[np.argmin(aside)])


def target_at_distance(eye: np.ndarray, pointer: np.ndarray, distance: float) -> np.ndarray:
    """Point (3,) m from ``eye`` in the direction of ``pointer`` (3,) m, at ``distance`` m."""
    length = math.dist(eye, pointer)
    return eye + (pointer - eye) * (distance / length) if 0 < length < math.inf else pointer


def to_bone_frame(scene: Scene, state: State, bone: int, point: np.ndarray) -> np.ndarray:
    """World point (3,) m in a bone's frame, clamped to its bounding box.

    A page shows a past state, so the bone may have moved away from the point.
    """
    local = state.poses(bone).apply_inverse(point)
    half = np.array(scene.bones[bone].shape.half_extents)
    return np.clip(local, -half, half)


def nearest_bone(scene: Scene, state: State, point: np.ndarray) -> int:
    """Index of the bone whose bounding box is nearest to a point (3,) m."""
    local = Pose(state.positions, state.orientations).apply_inverse(point)
    half = np.array([bone.shape.half_extents for bone in scene.bones])
    return int(np.argmin(np.linalg.norm(np.maximum(np.abs(local) - half, 0), axis=1)))


def _hand(event: viser.SceneNodeDragEvent) -> str:
    return f'page {event.client_id}'


async def _wait_until_disconnected(client: viser.ClientHandle) -> None:
    """Return once a page does not respond to a ping, or has closed its connection.

    A browser responds by itself, however busy the page is. Viser pings too, but closes a
    connection only after 20 to 40 s.
    """
    open_connections = connections(client)
    while (connection := open_connections.get(client.client_id)) is not None:
        try:
            await asyncio.wait_for(_ping(connection), PING_TIMEOUT)
        except Exception:  # no response in time, or websockets' ConnectionClosed
            return
        await asyncio.sleep(PING_PERIOD)


async def _ping(connection: object) -> None:
    """Ping and wait for the pong."""
    await (await connection.ping())

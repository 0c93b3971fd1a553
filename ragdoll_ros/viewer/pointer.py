"""The pointer takes bodies and drags them at the distance they had from the eye.

Viser finds the nearest body under the pointer. The grabbed point A keeps its distance from the
camera C while the pointer goes on, D being the direction to it: target = C + D |A - C|.
"""
from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

import numpy as np
import viser

from ..model import rotation
from ..model.scene import Scene
from ..model.state import State
from .drawing.bodies import Bodies
from .drawing.line import is_dead
from .drawing.skin import Skins
from .sources.source import Frame, Source


class Pointer:
    """What all pages' pointers hold: each page has a hand of its own.

    Viser's callbacks are coroutines here: they run in order, and nothing in them waits.
    """

    def __init__(self, source: Source, shown: Callable[[], Frame | None],
                 select: Callable[[str], None]) -> None:
        self._source, self._shown, self._select = source, shown, select
        self._distances: dict[int, float] = {}
        self._watches: dict[int, asyncio.Task] = {}

    def attach(self, bodies: Bodies, skins: Skins) -> None:
        """Listen to drags and clicks on the bodies and skins of a new scene."""
        for batch in bodies.batches:
            self._listen(batch.handle, lambda index, _, bones=batch.bones: int(bones[index or 0]))
        for skin in skins.handles:
            self._listen(skin, lambda _, point: self._nearest(point))

    def _listen(self, handle: viser.BatchedMeshHandle | viser.MeshSkinnedHandle,
                bone_of: Callable[[int | None, np.ndarray], int]) -> None:
        async def dragged(event: viser.SceneNodeDragEvent) -> None:
            if event.phase == 'start':
                point = np.array(event.start_position)
                self._take(event, bone_of(event.instance_index, point), point)
            elif event.client_id in self._distances:
                self._drag(event)

        async def clicked(event: viser.SceneNodePointerEvent) -> None:
            frame = self._shown()
            if frame is None:
                return
            eye, direction = np.array(event.ray_origin), np.array(event.ray_direction)
            point = eye + direction * self._depth(eye, direction)
            bone = bone_of(event.instance_index, point)
            self._select(frame.scene.bone_names[bone])

        handle.on_drag('left')(dragged)
        handle.on_click(clicked)

    def _take(self, event: viser.SceneNodeDragEvent, bone: int, point: np.ndarray) -> None:
        frame = self._shown()
        if frame is None:
            return
        eye = event.client.camera.position
        self._distances[event.client_id] = float(np.linalg.norm(point - eye))
        local = on_bone(frame.scene, frame.state, bone, point)
        self._source.grab(_hand(event), frame.scene.bone_names[bone], tuple(local.tolist()),
                            self._target(event))
        self._watch(event)

    def _watch(self, event: viser.SceneNodeDragEvent) -> None:
        """Open the hand if the page's line dies before it says so."""
        async def watch() -> None:
            await is_dead(event.client)
            self._let_go(event)

        self._unwatch(event)
        self._watches[event.client_id] = asyncio.get_running_loop().create_task(watch())

    def _unwatch(self, event: viser.SceneNodeDragEvent) -> None:
        watch = self._watches.pop(event.client_id, None)
        if watch is not None:
            watch.cancel()

    def _let_go(self, event: viser.SceneNodeDragEvent) -> None:
        if self._distances.pop(event.client_id, None) is not None:
            self._source.let_go(_hand(event))

    def _drag(self, event: viser.SceneNodeDragEvent) -> None:
        if event.phase == 'end':
            self._unwatch(event)
            self._let_go(event)
        else:
            self._source.drag(_hand(event), self._target(event))

    def _target(self, event: viser.SceneNodeDragEvent) -> tuple[float, ...]:
        target = kept_distance(event.client.camera.position, np.array(event.end_position),
                               self._distances[event.client_id])
        return tuple(target.tolist())

    def _nearest(self, point: np.ndarray) -> int:
        frame = self._shown()
        return nearest(frame.scene, frame.state, point)

    def _depth(self, eye: np.ndarray, direction: np.ndarray) -> float:
        """Distance, m, at which a ray comes nearest to a bone's centre, the nearest such bone."""
        offsets = self._shown().state.positions - eye
        along = offsets @ direction
        aside = np.linalg.norm(offsets - along[:, None] * direction, axis=1)
        return float(along[np.argmin(aside)])


def kept_distance(eye: np.ndarray, pointer: np.ndarray, distance: float) -> np.ndarray:
    """Target (3,) m in the direction of ``pointer`` (3,) m as far from the eye as ``distance``."""
    length = math.dist(eye, pointer)
    return eye + (pointer - eye) * (distance / length) if 0 < length < math.inf else pointer


def on_bone(scene: Scene, state: State, bone: int, point: np.ndarray) -> np.ndarray:
    """Point (3,) m of the world along a bone's axes, from its centre, in its bounding box.

    A page shows where the bone was a moment ago: what has moved on is taken at its edge.
    """
    local = rotation.rotate(rotation.inverse(state.orientations[bone]),
                            point - state.positions[bone])
    half = np.array(scene.bones[bone].shape.half_extents)
    return np.clip(local, -half, half)


def nearest(scene: Scene, state: State, point: np.ndarray) -> int:
    """Index of the bone whose bounding box is nearest to a point (3,) m."""
    local = rotation.rotate(rotation.inverse(state.orientations), point - state.positions)
    half = np.array([bone.shape.half_extents for bone in scene.bones])
    return int(np.argmin(np.linalg.norm(np.maximum(np.abs(local) - half, 0), axis=1)))


def _hand(event: viser.SceneNodeDragEvent) -> str:
    return f'page {event.client_id}'

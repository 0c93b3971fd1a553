"""Recordings as rosbag2 makes them, written by a library that the package does not use."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ragdoll_ros.files.run_scene import placement_text, run_scene_text, scene_digest
from ragdoll_ros.model.scene import SECOND
from ragdoll_ros.physics.logged_simulation import LoggedSimulation, state_digest

pytest.importorskip('rosbags', reason='bags are written by rosbags, of the extra replay')
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORAGE = {'.mcap': StoragePlugin.MCAP, '.db3': StoragePlugin.SQLITE3}


class BagWriter:
    """Writes Strings into a new folder, as `ros2 bag record` does; for `with`."""

    def __init__(self, folder: Path, suffix: str = '.mcap') -> None:
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(folder, version=9, storage_plugin=STORAGE[suffix])
        self._topics: dict = {}
        self._time = 0

    def __enter__(self) -> BagWriter:
        self._writer.open()
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def write(self, topic: str, text: str) -> None:
        """Write a String."""
        self._write(topic, 'std_msgs/msg/String', data=text)

    def write_poses(self, topic: str, stamp: int, poses: np.ndarray) -> None:
        """Write a PoseArray of poses (n, 7); stamp in ns."""
        types = self._store.types
        time = types['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND))
        header = types['std_msgs/msg/Header'](stamp=time, frame_id='map')
        self._write(topic, 'geometry_msgs/msg/PoseArray', header=header, poses=[
            types['geometry_msgs/msg/Pose'](
                position=types['geometry_msgs/msg/Point'](*map(float, row[:3])),
                orientation=types['geometry_msgs/msg/Quaternion'](*map(float, row[3:])))
            for row in poses])

    def _write(self, topic: str, kind: str, **fields: object) -> None:
        if topic not in self._topics:
            self._topics[topic] = self._writer.add_connection(topic, kind, typestore=self._store)
        self._time += 1
        data = self._store.serialize_cdr(self._store.types[kind](**fields), kind)
        self._writer.write(self._topics[topic], self._time, data)


def write_bag(folder: Path, messages: list[tuple[str, str]], suffix: str = '.mcap') -> Path:
    """Write topics and texts; give the file in which they are."""
    with BagWriter(folder, suffix) as bag:
        for topic, text in messages:
            bag.write(topic, text)
    return next(folder.glob(f'*{suffix}'))


def messages_of_a_run(scene, ticks, act, hashed=10, engine='auto', node='/ragdoll'):
    """What a node says of a run: ``act(simulation, tick)`` is called before each of the ticks."""
    text, events, tick = run_scene_text(scene), [], 0

    def tell(kind, fields):
        begin = {'scene': scene_digest(text)} if kind in ('start', 'reset') else {}
        if kind == 'add':
            fields = {'placement': placement_text(fields['placement'])}
        events.append({'number': len(events), 'tick': tick, 'kind': kind, **begin, **fields})

    with LoggedSimulation(scene, engine=engine) as simulation:
        simulation.on_event = tell
        tell('start', {**simulation.conditions, 'state': state_digest(simulation.state)})
        for tick in range(ticks):
            act(simulation, tick)
            simulation.advance()
            if (tick + 1) % hashed == 0:
                tick += 1
                tell('state', {'sha256': state_digest(simulation.state)})
    return [(f'{node}/scene', text), *((f'{node}/events', json.dumps(event)) for event in events)]

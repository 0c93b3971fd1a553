"""Recordings as files: MCAP, which Foxglove and `ros2 bag play` open as well.

Three topics, as those of the node: /ragdoll/scene tells the scene once; /ragdoll/poses is where its
bones are at each instant, the stamp being s of simulated time since the first; /ragdoll/swings the
masses of its swings, where they were told. What `ros2 bag record` makes of a node's topics of these
names is a recording, too.
"""
from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np

from ..files.bag import read_messages
from ..files.cdr import (
    DEFINITIONS,
    POSE_ARRAY,
    STRING,
    decode_poses,
    decode_string,
    encode_poses,
    encode_string,
)
from ..files.run_scene import read_run_scene, run_scene_text
from ..model import errors
from ..model.errors import ModelError, ModelErrors
from ..model.ragdoll import WORLD
from ..model.rotation import IDENTITY
from ..model.scene import SECOND, Scene
from ..model.state import State
from .recording import RecordedPose, Recorder, Recording
from .rods import Rods

KINDS = {'scene': STRING, 'poses': POSE_ARRAY, 'swings': POSE_ARRAY}

LARGEST_RECORDING = 1_000_000_000
"""Bytes; a minute of ten bones at 60 Hz takes 2 MB."""

Stamped = list[tuple[int, np.ndarray]]
"""Poses (n, 7) with their stamps, ns."""


def recording_bytes(recording: Recording) -> bytes:
    """A recording as MCAP, from which load_recording makes an equal one, but for parts of a ns."""
    from mcap.writer import Writer
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start('ros2')
    channels = {topic: writer.register_channel(
        f'/ragdoll/{topic}', 'cdr', writer.register_schema(
            kind, 'ros2msg', DEFINITIONS[kind].encode())) for topic, kind in KINDS.items()}

    def write(topic: str, stamp: int, data: bytes) -> None:
        writer.add_message(channels[topic], stamp, data, stamp)

    write('scene', 0, encode_string(run_scene_text(recording.scene)))
    for index, time in enumerate(recording.times):
        stamp, pose = round(time * SECOND), recording.pose(index)
        write('poses', stamp, encode_poses(stamp, WORLD, np.hstack(
            [pose.positions, pose.orientations])))
        if pose.rods is not None:
            masses = pose.rods[:, 1]
            write('swings', stamp, encode_poses(stamp, WORLD, np.hstack(
                [masses, np.tile(IDENTITY, (len(masses), 1))])))
    writer.finish()
    return stream.getvalue()


def load_recording(path: str | Path) -> Recording:
    """Read a recording; ModelErrors with the file's name and what is wrong in it.

    Of a file that breaks off, what stands before that is read, with a warning.
    """
    path = Path(path)
    try:
        return _recording(path)
    except ModelError as error:
        raise ModelErrors(str(path), [error]) from None


def _recording(path: Path) -> Recording:
    if path.is_file() and path.stat().st_size > LARGEST_RECORDING:
        raise errors.OutOfRange('', f'{path.stat().st_size} bytes', f'at most {LARGEST_RECORDING}')
    scenes: set[str] = set()
    heard: dict[str, Stamped] = {'poses': [], 'swings': []}
    for topic, kind, data in read_messages(path, lambda text: print(text, file=sys.stderr)):
        last = topic.rpartition('/')[2]
        if KINDS.get(last) == kind == STRING:
            scenes.add(decode_string(data))
        elif KINDS.get(last) == kind:
            heard[last].append(decode_poses(data))
    if len(scenes) != 1 or not heard['poses']:
        raise errors.WrongForm('', f'{len(scenes)} scenes, {len(heard["poses"])} instants',
                               'one scene and its poses: ros2 bag record /ragdoll/scene '
                               '/ragdoll/poses /ragdoll/swings')
    scene, _ = read_run_scene(scenes.pop())
    return _recorded(scene, heard['poses'], dict(heard['swings']))


def _recorded(scene: Scene, heard: Stamped, swings: dict[int, np.ndarray]) -> Recording:
    """A recording of poses and, by their stamps, of swings' masses."""
    recorder, rods, bones = Recorder(scene), Rods(scene), len(scene.bones)
    for stamp, poses in heard:
        if len(poses) != bones:
            raise errors.WrongForm('poses', f'{len(poses)} poses', f'{bones}, one for each bone')
        positions, orientations = poses[:, :3], poses[:, 3:]
        masses, ends = swings.get(stamp), None
        if masses is not None:
            if len(masses) != rods.count:
                raise errors.WrongForm('swings', f'{len(masses)} masses', f'{rods.count} masses')
            unknown = np.zeros_like(positions)
            ends = rods.ends(masses[:, :3], State(positions, orientations, unknown, unknown))
        recorder.add((stamp - heard[0][0]) / SECOND, RecordedPose(positions, orientations, ends))
    return recorder.recording()

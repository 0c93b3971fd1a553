"""Recordings as MCAP files, which Foxglove and `ros2 bag play` open too.

Three topics of the node: /ragdoll/scene once; /ragdoll/poses, the bones at each instant, stamped
with simulated time since the first; /ragdoll/swings, the masses of the swings, if recorded. A
`ros2 bag record` of a node's topics of these names is a recording too.
"""
import io
import sys
from pathlib import Path

import numpy as np

from ..files.bags import cdr
from ..files.bags.bag import read_messages
from ..files.run_scene import read_run_scene, run_scene_text
from ..model import errors
from ..model.errors import ModelError, ModelErrors
from ..model.ragdoll import WORLD
from ..model.rotation import IDENTITY
from ..model.scene import SECOND, Scene
from ..model.state import State
from .recording import RecordedPose, Recorder, Recording, Rods

TOPIC_TYPES = {'scene': cdr.STRING, 'poses': cdr.POSE_ARRAY, 'swings': cdr.POSE_ARRAY}

LARGEST_RECORDING = 1_000_000_000
"""Bytes; a minute of ten bones at 60 Hz is 2 MB."""

Stamped = list[tuple[int, np.ndarray]]
"""Poses (n, 7) with their stamps, ns."""


def recording_bytes(recording: Recording) -> bytes:
    """A recording as MCAP, from which load_recording reads an equal one but for rounding to ns."""
    from mcap.writer import Writer
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start('ros2')
    channels = {}
    for topic, kind in TOPIC_TYPES.items():
        schema = writer.register_schema(kind, 'ros2msg', cdr.DEFINITIONS[kind].encode())
        channels[topic] = writer.register_channel(f'/ragdoll/{topic}', 'cdr', schema)

    def write(topic: str, stamp: int, data: bytes) -> None:
        writer.add_message(channels[topic], stamp, data, stamp)

    write('scene', 0, cdr.encode_string(run_scene_text(recording.scene)))
    for index, time in enumerate(recording.times):
        stamp, pose = round(time * SECOND), recording.pose(index)
        write('poses', stamp, cdr.encode_poses(stamp, WORLD, np.hstack(
            [pose.positions, pose.orientations])))
        if pose.rods is not None:
            masses = pose.rods[:, 1]
            write('swings', stamp, cdr.encode_poses(stamp, WORLD, np.hstack(
                [masses, np.tile(IDENTITY, (len(masses), 1))])))
    writer.finish()
    return stream.getvalue()


def load_recording(path: str | Path) -> Recording:
    """Read a recording. Raises ModelErrors with the file's name.

    A truncated file is read as far as it is complete, with a warning.
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
    messages: dict[str, Stamped] = {'poses': [], 'swings': []}
    for topic, kind, data in read_messages(path, lambda text: print(text, file=sys.stderr)):
        last = topic.rpartition('/')[2]
        if TOPIC_TYPES.get(last) == kind == cdr.STRING:
            scenes |= {cdr.decode_string(data)} - {''}  # empty: no world
        elif TOPIC_TYPES.get(last) == kind:
            messages[last].append(cdr.decode_poses(data))
    if len(scenes) != 1 or not messages['poses']:
        raise errors.WrongForm('', f'{len(scenes)} scenes, {len(messages["poses"])} instants',
                               'one scene and its poses: ros2 bag record /ragdoll/scene '
                               '/ragdoll/poses /ragdoll/swings')
    scene, _ = read_run_scene(scenes.pop())
    return _recording_of(scene, messages['poses'], dict(messages['swings']))


def _recording_of(scene: Scene, messages: Stamped, swings: dict[int, np.ndarray]) -> Recording:
    """A recording from stamped poses of bones and, by stamp, of swings' masses."""
    recorder, rods, bones = Recorder(scene), Rods(scene), len(scene.bones)
    for stamp, poses in messages:
        if len(poses) != bones:
            raise errors.WrongForm('poses', f'{len(poses)} poses', f'{bones}, one for each bone')
        positions, orientations = poses[:, :3], poses[:, 3:]
        masses, ends = swings.get(stamp), None
        if masses is not None:
            if len(masses) != rods.count:
                raise errors.WrongForm('swings', f'{len(masses)} masses', f'{rods.count} masses')
            unknown = np.zeros_like(positions)
            ends = rods.ends(masses[:, :3], State(positions, orientations, unknown, unknown))
        recorder.add((stamp - messages[0][0]) / SECOND, RecordedPose(positions, orientations, ends))
    return recorder.recording()

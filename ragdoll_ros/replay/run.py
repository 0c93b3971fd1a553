"""A run read from a bag: its events in order and its scenes."""
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..files.bags.bag import read_messages
from ..files.bags.cdr import STRING, decode_string
from ..files.run_scene import read_run_scene, scene_digest
from ..model import errors
from ..model.scene import Scene

RECORD = 'ros2 bag record /ragdoll/events /ragdoll/scene'


@dataclass(frozen=True)
class Event:
    """An event after ``tick`` ticks; ``number`` counts the node's events."""

    number: int
    tick: int
    kind: str
    fields: dict

    @property
    def is_start(self) -> bool:
        """Whether the state after it follows from the scene alone."""
        return self.kind in ('start', 'reset')


@dataclass(frozen=True)
class ReplayedRun:
    """Events, scenes and versions of a node's run."""

    node: str
    events: tuple[Event, ...]
    scenes: dict[str, Scene]
    """By the SHA-256 of their text, as in events."""
    versions: tuple[str, ...]
    """Versions that computed it; several if nodes of different versions ran in turn."""

    def scene(self, event: Event) -> Scene:
        """The scene of a start event. Raises WrongForm if the bag lacks it."""
        digest = event.fields.get('scene')
        if digest not in self.scenes:
            held = ', '.join(f'{scene.name} ({each[:8]})' for each, scene in self.scenes.items())
            raise errors.WrongForm(
                f'event {event.number}', f'scene {str(digest)[:8]}',
                f'a scene that the bag holds, by the start of its SHA-256: {held or "none"}; '
                f'the events are of another scene, or the recording lacks ~/scene: {RECORD}')
        return self.scenes[digest]


def read_run(path: Path, node: str | None, warn: Callable[[str], None]) -> ReplayedRun:
    """The run of a ``node`` in a bag, by default its only one. Raises a RagdollError."""
    found: dict[tuple[str, str], list[str]] = {}
    for topic, kind, data in read_messages(path, warn):
        name, _, last = topic.rpartition('/')
        if kind == STRING and last in ('events', 'scene'):
            found.setdefault((name, last), []).append(decode_string(data))
    nodes = sorted({name for name, last in found if last == 'events'})
    if not nodes:
        raise errors.Unreadable('', str(path), f'a recording of ~/events and ~/scene: {RECORD}')
    if len(nodes) > 1 if node is None else node not in nodes:
        raise errors.OutOfRange('--node', node, 'one of ' + ', '.join(nodes))
    name = node or nodes[0]
    events = tuple(_event(index, text) for index, text in enumerate(found[name, 'events']))
    if not any(event.is_start for event in events):
        raise errors.WrongForm('', f'{len(events)} events', 'one that starts a run: where a '
                               'recording begins late, call ~/reset while it records')
    texts = filter(None, found.get((name, 'scene'), []))  # empty: no world
    read = {scene_digest(text): read_run_scene(text) for text in texts}
    return ReplayedRun(name, events, {digest: scene for digest, (scene, _) in read.items()},
                       tuple(sorted({versions for _, versions in read.values()})))


def _event(index: int, text: str) -> Event:
    """An event from JSON. Raises WrongForm."""
    try:
        fields = json.loads(text)
        number, tick, kind = (fields.pop(key) for key in ('number', 'tick', 'kind'))
        counts = type(number) is type(tick) is int and min(number, tick) >= 0
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        counts = False
    if not counts or not isinstance(kind, str):
        raise errors.WrongForm(f'events[{index}]', text, 'a JSON object with number, tick and kind')
    return Event(number, tick, kind, fields)

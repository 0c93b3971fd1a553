"""The parameter ``body_frames``: each entry names a driven body and the frame that it follows."""
from __future__ import annotations

import contextlib
from collections.abc import Sequence

from ...model import errors
from ...model.scene import Scene


def parse_body_frames(entries: Sequence[str], scene: Scene) -> dict[str, str]:
    """Frame of each driven body of a scene by the entries 'body frame' of the parameter.

    Raises UnknownDoll for a body that is not driven, WrongForm for a frame that the node publishes
    itself, DuplicateName for two frames of a body.
    """
    found: dict[str, str] = {}
    names = scene.driven_names
    for text in map(str.strip, filter(str.strip, entries)):
        body, _, frame = text.rpartition(' ')
        body = body.strip()
        if body not in names:
            raise errors.UnknownDoll('body_frames', text, (
                errors.one_of(names, body) if names else 'a body with follow; the scene has none')
                + ', followed by a frame')
        if frame in scene.bone_names:
            raise errors.WrongForm('body_frames', text, 'a frame that others publish')
        if body in found:
            raise errors.DuplicateName('body_frames', body, 'one frame for a body')
        found[body] = frame
    return found


def kept_body_frames(entries: Sequence[str], scene: Scene) -> tuple[str, ...]:
    """The entries that are valid in a scene; one empty text for none."""
    found = []
    for text in filter(str.strip, entries):
        with contextlib.suppress(errors.ModelError):
            parse_body_frames([*found, text], scene)
            found.append(text)
    return tuple(found) or ('',)

"""Loads the scripts and style sheets of this folder, and receives events that scripts send.

Viser has no call for either. <script> elements in the panel's HTML do not run, but the error
handler of an image that cannot be loaded runs, each time the panel is shown.
"""
from __future__ import annotations

import html
import json
from collections.abc import Callable
from pathlib import Path

import viser

from ..viser_internals import handle_id

FOLDER = Path(__file__).parent


def source(name: str) -> str:
    """Text of a file of this folder."""
    return (FOLDER / name).read_text('utf-8')


def script(*names: str, **constants: object) -> str:
    """HTML that runs scripts as one function, whose ``this`` is an <img> in the panel.

    ``constants``: names and values of the constants that the scripts use. A script runs each time
    the panel is shown and has to guard what may be done only once.
    """
    code = ''.join(f'const {key} = {json.dumps(value)};\n' for key, value in constants.items())
    code += '\n'.join(source(name) for name in names)
    return f'<img src="data:," style="display:none" onerror="{html.escape(code)}">'


def style(name: str, **properties: str) -> str:
    """HTML of a style sheet; ``properties``: texts of its custom properties --ragdoll-<name>."""
    custom = ''.join(f'--ragdoll-{key}: {json.dumps(value)};' for key, value in properties.items())
    return f'<style>:root {{{custom}}}\n{source(name)}</style>'


def add_listener(gui: viser.GuiApi, name: str, file: str, on_event: Callable[[int, str], None],
                 widget: viser.GuiInputHandle | None = None,
                 **constants: str) -> viser.GuiInputHandle[str]:
    """Run the ``listen(send, isTyped)`` of a script ``file`` on all pages; see client_events.js.

    ``on_event`` gets a page's client_id and what it sends, in viser's thread, so in order with all
    else that pages send. In the script, `isTyped(input)` tells whether an input belongs to
    ``widget``, which has a label. ``constants``: as in `script`. Returns the hidden text field
    whose values carry the events.
    """
    field = gui.add_text(name, '', visible=False)

    @field.on_update
    async def _(event: viser.GuiEvent) -> None:
        on_event(event.client_id, event.target.value.partition(' ')[2])

    gui.add_html(script(file, 'client_events.js', NAME=name, FIELD=handle_id(field),
                        WIDGET=handle_id(widget) if widget is not None else '', **constants))
    return field

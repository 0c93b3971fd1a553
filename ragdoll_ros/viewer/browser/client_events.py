"""Events of a page that viser's widgets do not report: keys that are down, focus, typed text."""
from __future__ import annotations

from collections.abc import Callable

import viser

from ..viser_internals import handle_id
from .scripts import script


def add_listener(gui: viser.GuiApi, name: str, file: str, on_event: Callable[[int, str], None],
                 widget: viser.GuiInputHandle | None = None) -> viser.GuiInputHandle[str]:
    """Run the ``listen(send, isTyped)`` of a script ``file`` on all pages; see client_events.js.

    ``on_event`` gets a page's client_id and what it sends, in viser's thread, so in order with all
    else that pages send. In the script, `isTyped(input)` tells whether an input belongs to
    ``widget``, which has a label. Returns the hidden text field whose values carry the events.
    """
    field = gui.add_text(name, '', visible=False)

    @field.on_update
    async def _(event: viser.GuiEvent) -> None:
        on_event(event.client_id, event.target.value.partition(' ')[2])

    gui.add_html(script(file, 'client_events.js', NAME=name, FIELD=handle_id(field),
                        WIDGET=handle_id(widget) if widget is not None else ''))
    return field

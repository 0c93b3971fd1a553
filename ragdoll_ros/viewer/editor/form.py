"""The fields of a sheet as widgets, each with room for what is wrong with it right below."""
from __future__ import annotations

import html
import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import viser

from ...model import errors
from ...model.ragdoll import JOINT_KINDS
from ...model.shapes import SHAPES
from .sheet import Field, Sheet, Value

RED, GREEN = '#c92a2a', '#2b8a3e'

STEPS = {'turn': 1.0, 'axis_1': 0.1, 'axis_2': 0.1, 'mass': 0.1}
"""What an arrow key adds to a number, 0.01 where nothing is said."""

ROOMY = """<style>
  .mantine-Flex-root:has(> .mantine-NumberInput-root) {column-gap: 0.25em !important}
  .mantine-Flex-root > .mantine-NumberInput-root .mantine-NumberInput-section {display: none}
  .mantine-Flex-root > .mantine-NumberInput-root input {padding: 0 0.3em !important}
  .mantine-Flex-root:has(> div > div > .mantine-Flex-root > .mantine-NumberInput-root)
    > :first-child {width: 4.7em !important}
</style>"""
"""Makes room for all digits in fields of three numbers, which viser cuts after four: without arrows
to click on (the arrow keys still count up and down), and with room for a short label only."""


class Quiet(threading.local):
    """While a thread is in it, what widgets call back there is not a user's doing."""

    now = False

    def __enter__(self) -> None:
        self.now = True

    def __exit__(self, *_: object) -> None:
        self.now = False


class Form:
    """Widgets of some fields. Programs fill it in; what people type stays until they do."""

    def __init__(self, gui: viser.GuiApi, fields: Sequence[Field],
                 on_kind: Callable[[str, str], None]) -> None:
        self._widgets: dict[str, Any] = {}
        self.errors: dict[str, viser.GuiHtmlHandle] = {}
        """What is written under the fields, seen where something is wrong."""
        self._on_kind = on_kind
        self._filling = Quiet()
        for field in fields:
            widget = self._widgets[field.key] = _widget(gui, field)
            self.errors[field.key] = gui.add_html('', visible=False)
            if field.widget in ('shape', 'joint'):
                widget.on_update(lambda event, key=field.key: self._chosen(key))

    def __getitem__(self, key: str) -> Any:
        """Widget of a field."""
        return self._widgets[key]

    def fill(self, sheet: Sheet) -> None:
        """Show the fields that a sheet has and hide the others; forget what was wrong."""
        self.tell(())
        with self._filling:
            for key, widget in self._widgets.items():
                widget.visible = key in sheet
                if key in sheet:
                    widget.value = sheet[key]

    def values(self) -> Sheet:
        """What stands in the fields that are shown."""
        return {key: widget.value for key, widget in self._widgets.items() if widget.visible}

    def tell(self, found: Iterable[errors.ModelError]) -> None:
        """Write each error under the field that its path names; take the others away."""
        said = {error.path: text_of(error) for error in found}
        for key, error in self.errors.items():
            error.content = colored(said.get(key, ''), RED)
            error.visible = key in said

    def _chosen(self, key: str) -> None:
        if not self._filling.now:
            self._on_kind(key, self._widgets[key].value)


def text_of(error: errors.ModelError) -> str:
    """What is wrong with a field: the value, and what would be right."""
    return str(type(error)('', error.value, error.expected))


def colored(text: str, color: str) -> str:
    """A text as HTML in a colour. What users send stands in it: nothing of it is HTML."""
    lines = '<br>'.join(html.escape(line) for line in text.splitlines())
    return (f'<div style="color: {color}; font-size: 0.85em; overflow-wrap: anywhere; '
            f'padding: 0 1em 0.4em">{lines}</div>') if text else ''


def _widget(gui: viser.GuiApi, field: Field) -> Any:
    hint = field.hint or None
    if field.widget in ('shape', 'joint'):
        return gui.add_dropdown(field.label, tuple(SHAPES if field.widget == 'shape'
                                                   else JOINT_KINDS), hint=hint)
    if field.widget == 'text':
        return gui.add_text(field.label, '', hint=hint)
    if field.widget == 'color':
        return gui.add_rgb(field.label, (0, 0, 0), hint=hint)
    start: Value = (0.0, 0.0, 0.0) if field.widget == 'vector' else 0.0
    add = gui.add_vector3 if field.widget == 'vector' else gui.add_number
    widget = add(field.label, start, step=STEPS.get(field.key, 0.01), hint=hint)
    widget.precision = 4 if field.key == 'turn' else 6
    return widget

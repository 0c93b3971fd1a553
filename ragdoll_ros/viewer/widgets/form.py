"""The fields of a sheet as widgets, each with room for what is wrong with it right below."""
from __future__ import annotations

import html
import threading
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

import viser

from ...model import errors
from ...model.ragdoll import JOINT_KINDS
from ...model.shapes import SHAPES
from ..browser.client_events import tell
from ..editor.sheet import Field, Sheet, Value
from . import error_text, number_parsing
from .color_field import LEFT, color

NUMBERS = ('number', 'vector')
"""Widgets that hold one number and three; both are text, in which everything can be typed."""

RED, GREEN, GREY = '#c92a2a', '#2b8a3e', '#495057'

ROOMY = """<style>
  .mantine-Flex-root:has(> * .mantine-TextInput-root) > :first-child {width: 5em !important}
  .mantine-TextInput-root input {padding: 0 0.3em !important}
</style>"""
"""Makes room for three numbers in a field, as a fitted doll has them."""


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
        self._fields = {field.key: field for field in fields}
        self._widgets: dict[str, Any] = {}
        self._filled: dict[str, tuple[str, Value]] = {}
        """What a field of numbers was filled with, as text and exactly."""
        self.errors: dict[str, viser.GuiHtmlHandle] = {}
        """What is written under the fields, seen where something is wrong."""
        self._colors: dict[str, Value] = {}
        """What a field of a colour shows."""
        self._unread: dict[str, errors.ModelError] = {}
        """What was typed there and is none: refused at the next reading, as the field itself shows
        the one before again."""
        self._on_kind = on_kind
        self._filling = Quiet()
        for field in fields:
            widget = self._widgets[field.key] = _widget(gui, field)
            self.errors[field.key] = gui.add_html('', visible=False)
            if field.widget in ('shape', 'joint'):
                widget.on_update(lambda event, key=field.key: self._chosen(key))
            if field.widget == 'color':
                self._connect_color(gui, field.key, widget)

    def __getitem__(self, key: str) -> Any:
        """Widget of a field."""
        return self._widgets[key]

    def fill(self, sheet: Sheet) -> None:
        """Show the fields that a sheet has and hide the others; forget what was wrong.

        What was typed and is what the sheet has stays as it was typed.
        """
        self.tell(())
        self._unread.clear()
        with self._filling:
            for key, widget in self._widgets.items():
                widget.visible = key in sheet
                if key in sheet:
                    self._fill(key, widget, sheet[key])

    def values(self) -> tuple[Sheet, list[errors.ModelError]]:
        """What stands in the fields that are shown, and what of it cannot be read."""
        sheet: Sheet = {}
        found = []
        for key, widget in self._widgets.items():
            if widget.visible:
                try:
                    sheet[key] = self._read(key, widget.value)
                except errors.ModelError as error:
                    found.append(error.at(key))
        return sheet, found

    def tell(self, found: Iterable[errors.ModelError]) -> None:
        """Write each error under the field that its path names; take the others away."""
        said = {error.path: error for error in found}
        for key in self.errors:
            self._say(key, said.get(key))

    def _say(self, key: str, error: errors.ModelError | None) -> None:
        place, text = self.errors[key], ''
        if error is not None:
            text = error_text.sentence(error, *_named(self._fields[key]))
        place.content = colored(text, RED)
        place.visible = error is not None

    def _connect_color(self, gui: viser.GuiApi, key: str, widget: viser.GuiRgbHandle) -> None:
        """Take what is typed into the field of a colour, and what is picked there."""
        def typed_there(page: int, told: str) -> None:
            try:
                self._colors[key] = color(told)
                self._unread.pop(key, None)
            except errors.ModelError as error:
                self._unread[key] = error
            self._say(key, self._unread.get(key))
            red, *others = self._colors[key]
            # Viser sends nothing that it holds to be there already; the last of both is sent.
            widget.value = (red ^ 1, *others)
            widget.value = self._colors[key]

        async def picked(event: viser.GuiEvent) -> None:
            if event.client is not None and max(event.target.value) <= 255:
                self._colors[key] = event.target.value
                self._unread.pop(key, None)
                self._say(key, None)

        widget.on_update(picked)
        tell(gui, key, LEFT, typed_there, widget)

    def _fill(self, key: str, widget: Any, value: Value) -> None:
        if self._fields[key].widget == 'color':
            self._colors[key] = value
        if self._fields[key].widget not in NUMBERS:
            widget.value = value
            return
        with suppress(errors.ModelError):
            if self._read(key, widget.value) == value:
                self._filled[key] = widget.value, value
                return
        text = number_parsing.shown_all(value if isinstance(value, tuple) else (value,))
        self._filled[key] = text, value
        widget.value = text

    def _read(self, key: str, given: Any) -> Value:
        """What a widget's value means; parts of a text that nobody touched are what they were."""
        if key in self._unread:
            raise self._unread.pop(key)
        field = self._fields[key]
        if field.widget not in NUMBERS:
            return given
        text, value = self._filled.get(key, ('', 0.0))
        if given == text:
            return value
        unit = _named(field)[1]
        if field.widget == 'number':
            return number_parsing.number(given, unit)
        new = number_parsing.numbers(given, 3, unit)
        with suppress(errors.ModelError):
            old = zip(number_parsing.parts(text, 3, unit), number_parsing.parts(given, 3, unit),
                      value, new, strict=True)
            return tuple(exact if was == now else number for was, now, exact, number in old)
        return new

    def _chosen(self, key: str) -> None:
        if not self._filling.now:
            self._on_kind(key, self._widgets[key].value)


def _named(field: Field) -> tuple[str, str]:
    """Name and unit of a field, from its label."""
    name, _, unit = field.label.partition(', ')
    return name, unit


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
    if field.widget == 'color':
        return gui.add_rgb(field.label, (0, 0, 0), hint=hint)
    return gui.add_text(field.label, '', hint=hint)

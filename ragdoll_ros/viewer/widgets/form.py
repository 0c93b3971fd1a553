"""Form of labelled fields, each with a place for its error right below."""
from __future__ import annotations

import html
import threading
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import viser

from ...model import errors
from ...model.ragdoll import JOINT_KINDS
from ...model.shapes import SHAPES
from ..browser.scripts import add_listener
from ..viser_internals import handle_id
from . import parsing
from .error_text import field_error

NUMBERS = ('number', 'vector')
"""Widgets of one number and of three; both are text fields."""

TYPED = (*NUMBERS, 'text')
"""Widgets into which text is typed, besides colours."""

RED, AMBER, GREEN, GREY = (f'var(--ragdoll-{name})' for name in ('red', 'amber', 'green', 'grey'))


MIXED = '(several)'
"""Value and text of a field that stands for different values; not read until it is changed."""

FieldValue = str | float | tuple[float, ...]
FormValues = dict[str, FieldValue]
"""Values by the keys of their fields."""


@dataclass(frozen=True)
class Field:
    """One line of a form: key, label with unit, kind of widget, and hint."""

    key: str
    label: str
    widget: str
    hint: str

    @property
    def name(self) -> str:
        """Label without the unit, as in a sentence."""
        return self.label.partition(', ')[0].lower()

    @property
    def unit(self) -> str:
        """Unit in the label; empty if there is none."""
        return self.label.partition(', ')[2]


class CallbackGuard(threading.local):
    """Marks callbacks that the program causes: ``active`` while its thread is in the context."""

    active = False

    def __enter__(self) -> None:
        self.active = True

    def __exit__(self, *_: object) -> None:
        self.active = False


class Form:
    """Widgets of fields. The text that users type stays until the program fills the form.

    ``on_kind`` takes the key and the value of a shape or joint kind that a user chooses. Values may
    be read in one thread while another one fills the form.
    """

    def __init__(self, gui: viser.GuiApi, fields: Sequence[Field],
                 on_kind: Callable[[str, str], None]) -> None:
        self._fields = {field.key: field for field in fields}
        self._widgets: dict[str, Any] = {}
        self._lock = threading.RLock()
        self._filled: dict[str, tuple[str, FieldValue]] = {}
        """Text and exact value that a field was last filled with."""
        self._submitted: dict[str, tuple[str, FieldValue]] = {}
        """Text and value that were read from a field since it was filled."""
        self._changed: set[str] = set()
        """Keys of fields that have had another value since they were filled."""
        self.errors: dict[str, viser.GuiHtmlHandle] = {}
        """Error texts below the fields; visible if there is an error."""
        self._colors: dict[str, FieldValue] = {}
        """Values of colour fields."""
        self._color_errors: dict[str, errors.ModelError] = {}
        """Of typed colours: raised at the next reading, as the widget shows the last valid one."""
        self._on_kind = on_kind
        self._filling = CallbackGuard()
        for field in fields:
            widget = self._widgets[field.key] = _widget(gui, field)
            self.errors[field.key] = gui.add_html('', visible=False)
            if field.widget in ('shape', 'joint'):
                widget.on_update(lambda event, key=field.key: self._on_choice(key))
            if field.widget == 'color':
                self._connect_color(gui, field.key, widget)

    def __getitem__(self, key: str) -> Any:
        """Widget of a field."""
        return self._widgets[key]

    def has(self, widget_id: str) -> bool:
        """Whether a widget with this id is a field of the form."""
        return any(handle_id(widget) == widget_id for widget in self._widgets.values())

    def fill(self, values: FormValues, keep_typed: bool = False, changed: bool = False) -> None:
        """Show these fields only, without errors; typed text that has the same value stays.

        ``keep_typed``: text that was typed since the values were read stays as well, unless
        something else has changed the value of its field. ``changed``: mark all of them as changed,
        so that `values` returns them.
        """
        self.show_errors(())
        self._color_errors.clear()
        with self._lock, self._filling:
            for key, widget in self._widgets.items():
                widget.visible = key in values
                if key in values:
                    self._fill(key, widget, values[key], keep_typed)
            self._changed = set(values) if changed else set()

    def values(self) -> tuple[FormValues, list[errors.ModelError]]:
        """Values of the visible fields that were changed since they were filled, and errors of
        those that cannot be read.
        """
        values: FormValues = {}
        found = []
        with self._lock:
            for key, widget in self._widgets.items():
                text = widget.value
                if widget.visible and not text == MIXED == self._filled[key][1]:
                    try:
                        value = self._read(key, text)
                        self._submitted[key] = text, value
                        if value != self._filled[key][1]:
                            self._changed.add(key)
                        if key in self._changed:
                            values[key] = value
                    except errors.ModelError as error:
                        found.append(error.at(key))
        return values, found

    def show_errors(self, found: Iterable[errors.ModelError]) -> None:
        """Show each error below the field that its path names; clear the others."""
        by_key = {error.path: error for error in found}
        for key in self.errors:
            self._show_error(key, by_key.get(key))

    def _show_error(self, key: str, error: errors.ModelError | None) -> None:
        html_, text = self.errors[key], ''
        if error is not None:
            text = field_error(error, self._fields[key].name, self._fields[key].unit)
        html_.content = colored(text, RED)
        html_.visible = error is not None

    def _connect_color(self, gui: viser.GuiApi, key: str, widget: viser.GuiRgbHandle) -> None:
        """Handle colours that are typed and picked."""
        def on_typed(page: int, event: str) -> None:
            try:
                self._colors[key] = parsing.parse_color(event)
                self._color_errors.pop(key, None)
            except errors.ModelError as error:
                self._color_errors[key] = error
            self._show_error(key, self._color_errors.get(key))
            red, *others = self._colors[key]
            # Viser does not send a value that equals the last one; of both the last is sent.
            widget.value = (red ^ 1, *others)
            widget.value = self._colors[key]

        async def on_picked(event: viser.GuiEvent) -> None:
            if event.client is not None and max(event.target.value) <= 255:
                self._colors[key] = event.target.value
                self._color_errors.pop(key, None)
                self._show_error(key, None)

        widget.on_update(on_picked)
        add_listener(gui, key, 'color_text.js', on_typed, widget)

    def _fill(self, key: str, widget: Any, value: FieldValue, keep_typed: bool) -> None:
        kind, stays = self._fields[key].widget, keep_typed and self._is_typed(key, widget, value)
        self._submitted.pop(key, None)
        if kind == 'color':
            self._colors[key] = value
        text: Any = value
        if kind in NUMBERS and value != MIXED:
            with suppress(errors.ModelError):
                if self._read(key, widget.value) == value:
                    self._filled[key] = widget.value, value
                    return
            text = parsing.format_numbers(value if isinstance(value, tuple) else (value,))
        self._filled[key] = text, value
        if not stays:
            widget.value = text

    def _is_typed(self, key: str, widget: Any, value: FieldValue) -> bool:
        """Whether the field has text that was typed since it was read, and ``value`` is not new.

        That text may equal the filled one: a user who types 7 and, while it is applied, the old 5
        again, wants 5.
        """
        known = [pair for pair in (self._filled.get(key), self._submitted.get(key)) if pair]
        return (self._fields[key].widget in TYPED
                and any(value == known_value for _, known_value in known)
                and widget.value != known[-1][0])

    def _read(self, key: str, given: Any) -> FieldValue:
        """Value of a widget's content; unchanged parts of a text keep their exact values."""
        if key in self._color_errors:
            raise self._color_errors.pop(key)
        field = self._fields[key]
        if field.widget not in NUMBERS:
            return given
        text, value = self._filled.get(key, ('', 0.0))
        if given == text:
            return value
        unit = field.unit
        if field.widget == 'number':
            return parsing.parse_number(given, unit)
        new = parsing.parse_numbers(given, 3, unit)
        with suppress(errors.ModelError):
            parts = zip(parsing.split_numbers(text, 3, unit),
                        parsing.split_numbers(given, 3, unit), value, new, strict=True)
            return tuple(exact if was == now else number for was, now, exact, number in parts)
        return new

    def _on_choice(self, key: str) -> None:
        if not self._filling.active:
            self._on_kind(key, self._widgets[key].value)


def colored(text: str, color: str) -> str:
    """HTML of a text in a colour; the text, which users may send, is escaped."""
    lines = '<br>'.join(html.escape(line) for line in text.splitlines())
    return (f'<div style="color: {color}; font-size: 0.85em; overflow-wrap: anywhere; '
            f'padding: 0 1em 0.4em">{lines}</div>') if text else ''


def _widget(gui: viser.GuiApi, field: Field) -> Any:
    hint = field.hint or None
    if field.widget in ('shape', 'joint'):
        return gui.add_dropdown(field.label, tuple(SHAPES if field.widget == 'shape'
                                                   else JOINT_KINDS), hint=hint)
    if field.widget == 'checkbox':
        return gui.add_checkbox(field.label, False, hint=hint)
    if field.widget == 'color':
        return gui.add_rgb(field.label, (0, 0, 0), hint=hint)
    return gui.add_text(field.label, '', hint=hint)

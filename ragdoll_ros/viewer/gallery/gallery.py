"""Cards of the shipped scenes in the panel; a click loads one."""
from __future__ import annotations

import base64
import html
import threading
from collections.abc import Callable
from typing import NamedTuple

import viser

from ...files import config, yaml_text
from ...model.scene import Scene
from ..browser.scripts import add_listener, style
from .cost import FOLDER, cost_text, estimated_cost, reference_cost

SEEN = 'seen'
"""Event of gallery.js: the cards are looked at."""

CARD = ('<button class="ragdoll-card" data-scene="{name}" {state}><img alt="" src="{picture}">'
        '<span><b>{name}</b> {description} <small class="{speed}">{cost}</small></span></button>')


class Entry(NamedTuple):
    """What a card tells of a scene before that is loaded."""

    description: str
    step: float
    pace: float
    picture: str
    """As data URL."""


class Gallery:
    """Cards in the GUI container that is current; ``load`` gets the page and the scene's name."""

    def __init__(self, server: viser.ViserServer,
                 load: Callable[[viser.ClientHandle | None, str], None]) -> None:
        gui = server.gui
        self._server, self._load = server, load
        self._entries = {path.stem: entry(path.stem) for path in sorted(FOLDER.glob('*.webp'))}
        self._reference = 0.0
        """As `reference_cost` has found it here, ms; 0 before."""
        self._is_measuring = False
        self._shown: tuple = ()
        gui.add_html(style('gallery.css'))
        self.events = add_listener(gui, 'gallery', 'gallery.js', self._take)
        self.cards = {name: gui.add_html(self._card(name, '', '')) for name in self._entries}

    def show(self, current: Scene | None, loading: str) -> None:
        """Show which scene runs, which one is being loaded, and what all cost."""
        name = '' if current is None else current.name
        shown = name, loading, self._reference
        if shown == self._shown:
            return
        self._shown = shown
        for card, handle in self.cards.items():
            content = self._card(card, name, loading)
            if handle.content != content:
                handle.content = content

    def _card(self, name: str, current: str, loading: str) -> str:
        """HTML of a card."""
        scene, text, is_slow = self._entries[name], '', False
        if name == loading:
            text = 'Loading …'
        elif self._reference:
            text, is_slow = cost_text(estimated_cost(name, self._reference), scene.step, scene.pace)
        state = 'aria-busy="true"' if name == loading else (
            'aria-current="true"' if name == current else '')
        return CARD.format(name=html.escape(name), state=state, picture=scene.picture,
                           description=html.escape(scene.description), cost=text,
                           speed='slow' if is_slow else '')

    def _take(self, page: int, text: str) -> None:
        """Load the scene of a clicked card, or measure this machine once cards are seen."""
        if text in self._entries:
            self._load(self._server.get_clients().get(page), text)
        elif text == SEEN and not self._is_measuring:
            self._is_measuring = True
            threading.Thread(target=self._measure, daemon=True).start()

    def _measure(self) -> None:
        self._reference = reference_cost()


def entry(name: str) -> Entry:
    """What the file of a shipped scene says, and its picture."""
    data = yaml_text.read(config.find(name))
    return Entry(data.get('description', ''), data.get('step', Scene.step),
                 data.get('pace', Scene.pace), picture_url(name))


def picture_url(name: str) -> str:
    """The picture of a scene as a data URL."""
    content = base64.b64encode((FOLDER / f'{name}.webp').read_bytes()).decode()
    return f'data:image/webp;base64,{content}'

"""The banner over the picture while the scene is edited, and the keys E, W and R."""
from __future__ import annotations

from collections.abc import Callable

import viser

from ..browser.scripts import add_listener, script, style
from .handles.body_handles import Mode

MODES: dict[Mode, str] = {'move': 'W', 'turn': 'E', 'size': 'R'}
"""Keys of the modes."""


class Banner:
    """In the GUI container that is current, which must always be shown."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self.on_action: Callable[[str], None] = lambda action: None
        """Called in viser's thread with 'edit', 'run' or a mode."""
        gui.add_html(style('edit_banner.css'))
        add_listener(gui, 'edit', 'edit_keys.js', lambda _, action: self.on_action(action))
        self._html = gui.add_html('')
        self.show(None)

    def show(self, mode: Mode | None) -> None:
        """Show the banner with a mode, or nothing."""
        self._html.content = script('edit_banner.js', MODE=mode or '', MODES=MODES)

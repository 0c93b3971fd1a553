"""Check boxes for what is shown."""
from __future__ import annotations

from collections.abc import Callable

import viser

from ..sources.source import Wanted


def theme(server: viser.ViserServer, dark: bool) -> None:
    """Set how pages look; the background follows."""
    server.gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=dark)


class View:
    """What the page is asked to show."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._home = server.gui.add_button('Home view', icon='home', hint='H')
        self._home_key = server.gui.add_command('Home view', hotkey='H')
        with server.gui.add_folder('Show'):
            self.follow = server.gui.add_checkbox(
                'Follow', initial_value=False,
                hint='the camera goes where the doll goes, and back where it was after')
            self.contacts = server.gui.add_checkbox(
                'Contacts', initial_value=False, hint='where something touches, yellow, '
                'and how hard: a line of 1 m is the weight of the first doll')
            self.limits = server.gui.add_checkbox(
                'Joint limits', initial_value=False,
                hint='an arc for what a joint may do; its needle is red at the end')
            self.dark = server.gui.add_checkbox(
                'Dark', initial_value=False, hint='a dark page and ground, for all who look')
            self.dark.on_update(lambda _: theme(server, self.dark.value))
            self.skin = server.gui.add_checkbox(
                'Skin', initial_value=True, visible=False,
                hint="the fitted character's skin, following the bones")
            self.bones = server.gui.add_checkbox(
                'Bones', initial_value=False, visible=False,
                hint='the bodies that move the skin, as of glass')

    def on_home(self, go: Callable[[viser.ClientHandle], None]) -> None:
        """Call this with the page that asks for its home view."""
        for trigger in (self._home.on_click, self._home_key.on_trigger):
            trigger(lambda event: event.client and go(event.client))

    def show_scene(self, has_skin: bool) -> None:
        """Offer what there is to show."""
        self.skin.visible = self.bones.visible = has_skin

    @property
    def wanted(self) -> Wanted:
        """What a source must give while a page is open."""
        return Wanted(True, self.contacts.value, self.limits.value)

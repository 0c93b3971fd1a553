"""Check boxes that select what is shown."""
from __future__ import annotations

from collections.abc import Callable

import viser

from ..sources.source import RequestedData
from ..worst_impact import WorstImpact


def configure_theme(server: viser.ViserServer, dark: bool) -> None:
    """Make the pages, and their background, dark or light."""
    server.gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=dark)


class DisplayOptions:
    """Widgets for camera and display, in the GUI container that is current."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._home = server.gui.add_button('Home view', icon='home', hint='H')
        self._home_key = server.gui.add_command('Home view', hotkey='H')
        with server.gui.add_folder('Show'):
            self.follow = server.gui.add_checkbox(
                'Follow', initial_value=False,
                hint='The camera moves with the pushed doll; it returns when this is switched off; '
                'it comes on by itself when the doll would leave the picture')
            self.contacts = server.gui.add_checkbox(
                'Contacts', initial_value=False, hint='Contact points and normal forces as arrows: '
                '1 m is the weight of the first doll; a node publishes points without forces')
            self.impacts = server.gui.add_checkbox(
                'Impacts', initial_value=False, hint='For a second after each impact an arrow '
                'along its impulse, with the bone, the peak force and its ratio to the limit of '
                'the body region; engine rigid')
            self.worst_impact = WorstImpact(server.gui)
            self.limits = server.gui.add_checkbox(
                'Joint limits', initial_value=False,
                hint="An arc for a joint's range; its needle is red at the limits")
            self.dark = server.gui.add_checkbox(
                'Dark', initial_value=False, hint='A dark page and ground, on all pages')
            self.dark.on_update(lambda _: configure_theme(server, self.dark.value))
            self.skin = server.gui.add_checkbox(
                'Skin', initial_value=True, visible=False,
                hint="The fitted character's skin, which follows the bones")
            self.bones = server.gui.add_checkbox(
                'Bones', initial_value=False, visible=False,
                hint='The bodies that move the skin, translucent')

    def on_home(self, callback: Callable[[viser.ClientHandle], None]) -> None:
        """Call ``callback`` with each page that asks for the home view."""
        for trigger in (self._home.on_click, self._home_key.on_trigger):
            trigger(lambda event: event.client and callback(event.client))

    def show_scene(self, has_skin: bool) -> None:
        """Offer the options that the scene has."""
        self.skin.visible = self.bones.visible = has_skin

    @property
    def requested(self) -> RequestedData:
        """Data that a source must provide while a page is open."""
        return RequestedData(True, self.contacts.value, self.limits.value, self.impacts.value)

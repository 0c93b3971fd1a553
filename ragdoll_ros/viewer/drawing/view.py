"""Check boxes for what is shown."""
from __future__ import annotations

import viser

from ..sources.source import Wanted


class View:
    """What the page is asked to show."""

    def __init__(self, server: viser.ViserServer) -> None:
        with server.gui.add_folder('Show'):
            self.follow = server.gui.add_checkbox(
                'Follow', initial_value=False, hint='the camera goes where the doll goes')
            self.contacts = server.gui.add_checkbox(
                'Contacts', initial_value=False, hint='where something touches, yellow')
            self.limits = server.gui.add_checkbox(
                'Joint limits', initial_value=False,
                hint='an arc for what a joint may do; its needle is red at the end')
            self.skin = server.gui.add_checkbox(
                'Skin', initial_value=True, visible=False,
                hint="the fitted character's skin, following the bones")
            self.bones = server.gui.add_checkbox(
                'Bones', initial_value=False, visible=False,
                hint='the bodies that move the skin, as of glass')

    def show_scene(self, has_skin: bool) -> None:
        """Offer what there is to show."""
        self.skin.visible = self.bones.visible = has_skin

    @property
    def wanted(self) -> Wanted:
        """What a source must give while a page is open."""
        return Wanted(True, self.contacts.value, self.limits.value)

"""Check boxes for what is shown."""
from __future__ import annotations

import viser

from ..sources.source import Wanted


class View:
    """What the page is asked to show."""

    def __init__(self, server: viser.ViserServer) -> None:
        with server.gui.add_folder('Show'):
            self._follow = server.gui.add_checkbox(
                'Follow', initial_value=False, hint='the camera goes where the doll goes')
            self._contacts = server.gui.add_checkbox(
                'Contacts', initial_value=False, hint='where something touches, yellow')
            self._limits = server.gui.add_checkbox(
                'Joint limits', initial_value=False,
                hint='an arc for what a joint may do; its needle is red at the end')
            self._skin = server.gui.add_checkbox(
                'Skin', initial_value=True, visible=False,
                hint="the fitted character's skin, following the bones")
            self._bones = server.gui.add_checkbox(
                'Bones', initial_value=False, visible=False,
                hint='the bodies that move the skin, as of glass')

    def show_scene(self, has_skin: bool) -> None:
        """Offer what there is to show."""
        self._skin.visible = self._bones.visible = has_skin

    @property
    def wanted(self) -> Wanted:
        """What a source must give while a page is open."""
        return Wanted(True, self._contacts.value, self._limits.value)

    @property
    def follow(self) -> bool:
        """Whether the camera follows."""
        return self._follow.value

    @property
    def skin(self) -> bool:
        """Whether skins are shown."""
        return self._skin.value

    @property
    def bones(self) -> bool:
        """Whether bones are shown though there is a skin."""
        return self._bones.value

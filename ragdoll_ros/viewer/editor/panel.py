"""The panel: which bone, its numbers and those of its joint, and what can be done."""
from __future__ import annotations

from collections.abc import Callable, Iterable

import viser

from ...model import errors
from ...model.scene import Scene
from ..widgets.error_text import in_words
from ..widgets.form import RED, ROOMY, Form, Quiet, colored
from .history import History
from .sheet import BODY, JOINT, Sheet

NONE = '(no bone)'


class Panel:
    """Widgets in the GUI container that is current.

    ``select`` takes the name of a chosen bone, or None; ``suggest`` what a Form's ``on_kind`` does.
    The buttons are without a deed of their own: the editor gives them one.
    """

    def __init__(self, gui: viser.GuiApi, select: Callable[[str | None], None],
                 suggest: Callable[[str, str], None]) -> None:
        self._filling = Quiet()
        self.edit = gui.add_button('Edit', icon='pencil', hint='E: pause in the bind pose')
        self.undo = gui.add_button('Undo', icon='arrow-back-up', hint='Ctrl+Z')
        self.redo = gui.add_button('Redo', icon='arrow-forward-up', hint='Ctrl+Shift+Z')
        self.doll = gui.add_dropdown('doll', (NONE,), visible=False, hint='chooses its root')
        self.bone = gui.add_dropdown('bone', (NONE,), hint='or click on it')
        self.limb = gui.add_checkbox('whole limb', False, hint='what hangs from the bone moves '
                                     'and turns with it; else the body alone, and pivots stay')
        self.both = gui.add_checkbox('both sides', False,
                                     hint='the bone on the other side becomes its mirror image')
        gui.add_html(ROOMY)
        self.body_folder = gui.add_folder('Body')
        with self.body_folder:
            self.body = Form(gui, BODY, suggest)
        self.joint_folder = gui.add_folder('Joint to the parent')
        with self.joint_folder:
            self.joint = Form(gui, JOINT, suggest)
        self.update = gui.add_button('Update', icon='check', color='green',
                                     hint='apply the numbers; a running doll starts anew')
        self.said = gui.add_html('')
        self.growth_folder = gui.add_folder('Bones', expand_by_default=False)
        with self.growth_folder:
            self.name = gui.add_text('name', 'new bone')
            self.add = gui.add_button('Add a bone here', icon='plus')
            self.remove = gui.add_button('Remove this limb', icon='trash')
        self._roots: dict[str, str] = {}
        self.doll.on_update(lambda _: self._filling.now or select(
            self._roots.get(self.doll.value)))
        self.bone.on_update(lambda _: self._filling.now or select(
            None if self.bone.value == NONE else self.bone.value))

    def show_bones(self, scene: Scene, chosen: str | None) -> None:
        """Offer the bones of one doll, the chosen bone's or the first; and the other dolls."""
        index = 0 if chosen is None else int(scene.doll_of_bone[scene.bone_index(chosen)])
        self._roots = {placement.name: scene.qualified(placement, placement.doll.root.name)
                       for placement in scene.dolls}
        self.doll.visible = len(scene.dolls) > 1
        with self._filling:
            _offer(self.doll, tuple(self._roots), scene.dolls[index].name)
            _offer(self.bone, (NONE, *scene.bone_names[scene.bone_slices[index]]), chosen or NONE)

    def show_sheet(self, sheet: Sheet | None, parent: str | None) -> None:
        """Show a bone's numbers, or none."""
        self.say('')
        for part in (self.body_folder, self.growth_folder, self.update, self.limb, self.both):
            part.visible = sheet is not None
        self.joint_folder.visible = sheet is not None and 'kind' in sheet
        self.joint_folder.label = f'Joint to {parent}'
        self.body.fill(sheet or {})
        self.joint.fill(sheet or {})

    def values(self) -> tuple[Sheet, list[errors.ModelError]]:
        """What stands in the fields, and what of it cannot be read."""
        (body, in_body), (joint, in_joint) = self.body.values(), self.joint.values()
        return {**body, **joint}, in_body + in_joint

    def tell(self, found: Iterable[errors.ModelError]) -> None:
        """Write each error under its field; what belongs to none, under the Update button."""
        found = list(found)
        self.body.tell(found)
        self.joint.tell(found)
        keys = {field.key for field in (*BODY, *JOINT)}
        self.say('\n'.join(in_words(error) for error in found if error.path not in keys))

    def say(self, text: str) -> None:
        """Write under the Update button why something was refused; nothing: take that away."""
        self.said.content = colored(text, RED)

    def show_history(self, history: History) -> None:
        """Label the buttons with what they would undo and redo."""
        for button, word, what in ((self.undo, 'Undo', history.undoes),
                                   (self.redo, 'Redo', history.redoes)):
            button.disabled = not what
            button.label = f'{word}: {what}' if what else word

    def show_editing(self, editing: bool) -> None:
        """Label the button with what it would do."""
        self.edit.label = 'Drop it' if editing else 'Edit'
        self.edit.icon = 'arrow-big-down-lines' if editing else 'pencil'


def _offer(dropdown: viser.GuiDropdownHandle, options: tuple[str, ...], chosen: str) -> None:
    if dropdown.options != options:
        dropdown.options = options
    dropdown.value = chosen

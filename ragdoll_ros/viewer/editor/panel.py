"""The editor's panel: selection of a bone, the form of it and its joint, and actions."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import viser

from ...model import errors
from ...model.scene import Scene
from ..browser.scripts import style
from ..widgets.bone_tree import BoneTree
from ..widgets.error_text import error_text
from ..widgets.form import GREY, RED, CallbackGuard, Form, FormValues, colored
from .bone_form import BODY, JOINT
from .scene_folder import MESHES
from .undo_history import UndoHistory

NONE, NO_BODY = '(no bone)', '(no body)'

MOST_LISTED = 1000
"""Static bodies in the list: a page of more names is slow."""

KEYS = {field.key for field in (*BODY, *JOINT)}


class EditorPanel:
    """Widgets in the GUI container that is current; the editor connects the buttons.

    ``select`` takes the name of a bone, or None, and whether other selected bones stay selected;
    ``select_static`` takes that of a static body, or None; ``suggest`` is a Form's ``on_kind``.
    """

    def __init__(self, gui: viser.GuiApi, select: Callable[[str | None, bool], None],
                 select_static: Callable[[str | None], None],
                 suggest: Callable[[str, str], None]) -> None:
        self._filling = CallbackGuard()
        self.edit = gui.add_button('Edit', icon='pencil',
                                   hint='E: pauses in the bind pose; Space runs')
        self.undo = gui.add_button('Undo', icon='arrow-back-up', hint='Ctrl+Z')
        self.redo = gui.add_button('Redo', icon='arrow-forward-up', hint='Ctrl+Shift+Z')
        self.doll = gui.add_dropdown('Doll', (NONE,), visible=False, hint='Selects its root')
        self.bone = gui.add_dropdown('Bone', (NONE,), hint='Or click on it')
        self.tree = BoneTree(gui, select)
        self.advice = gui.add_html('')
        self.limb = gui.add_checkbox('Whole limb', False, hint='The subtree of the bone '
                                     'moves with it; else the body alone, and joints stay')
        self.both = gui.add_checkbox('Both sides', False,
                                     hint='The bone on the other side becomes its mirror image')
        self.snap = gui.add_checkbox('Snap', False, hint='Handles go in steps of 1 cm and 5°')
        gui.add_html(style('form.css'))
        self.body_folder = gui.add_folder('Body')
        with self.body_folder:
            self.body = Form(gui, BODY, suggest)
        self.joint_folder = gui.add_folder('Joint to the parent')
        with self.joint_folder:
            self.joint = Form(gui, JOINT, suggest)
        self.update = gui.add_button('Update', icon='check', color='green',
                                     hint='Enter in a field: apply the values; a running '
                                     'simulation restarts')
        self.message = gui.add_html('')
        self.growth_folder = gui.add_folder('Bones', expand_by_default=False)
        with self.growth_folder:
            self.name = gui.add_text('Name', 'new bone')
            self.add = gui.add_button('Add a bone here', icon='plus')
            self.remove = gui.add_button('Remove this limb', icon='trash')
        with gui.add_folder('Static bodies', expand_by_default=False):
            self.static = gui.add_dropdown('Static body', (NO_BODY,), hint='A wall, a stair')
            self.static_name = gui.add_text('Its name', 'new body')
            self.add_static = gui.add_button('Add a body', icon='cube-plus')
            self.add_mesh = gui.add_upload_button(
                'Add a mesh', icon='upload', mime_type=','.join(MESHES), hint='A file '
                + ', '.join(MESHES) + '; it stands beside the first doll')
            self.remove_static = gui.add_button('Remove this body', icon='trash', visible=False)
        self.parent = ''
        """Bone to which another one is added."""
        self._roots: dict[str, str] = {}
        self.doll.on_update(lambda _: self._filling.active or select(
            self._roots.get(self.doll.value), False))
        self.bone.on_update(lambda _: self._filling.active or select(
            None if self.bone.value == NONE else self.bone.value, False))
        self.static.on_update(lambda _: self._filling.active or select_static(
            None if self.static.value == NO_BODY else self.static.value))

    def show_static(self, scene: Scene, selected: str | None) -> None:
        """List the first MOST_LISTED static bodies, of which one may be selected."""
        names = (body.name for body in scene.bodies[:MOST_LISTED])
        with self._filling:
            _set_options(self.static, (NO_BODY, *names), selected or NO_BODY)
        self.remove_static.visible = selected is not None

    def show_bones(self, scene: Scene, selected: Sequence[str]) -> None:
        """List all dolls, and the bones of one: that of the last selected bone, or the first."""
        last = selected[-1] if selected else None
        index = 0 if last is None else int(scene.doll_of_bone[scene.bone_index(last)])
        placement = scene.dolls[index]
        self._roots = {each.name: scene.qualified(each, each.doll.root.name)
                       for each in scene.dolls}
        self.doll.visible = len(scene.dolls) > 1
        with self._filling:
            _set_options(self.doll, tuple(self._roots), placement.name)
            _set_options(self.bone, (NONE, *scene.bone_names[scene.bone_slices[index]]),
                         last or NONE)
        self.tree.show(scene, placement, selected)
        self.advice.content = colored(_advice(selected), GREY)
        self.parent = last or self._roots[placement.name]
        self.add.label = 'Add a bone here' if last else f'Add a bone to {placement.doll.root.name}'

    def show_values(self, values: FormValues, parents: Sequence[str], keep_typed: bool) -> None:
        """Show the values of the selected bones, whose ``parents`` are these, or hide the form.

        ``keep_typed``: see Form.fill.
        """
        self.show_message('')
        is_one = 'position' in values
        is_bone = 'mass' in values
        for part in (self.body_folder, self.update):
            part.visible = bool(values)
        self.both.visible, self.snap.visible = is_bone, is_one
        for part in (self.limb, self.remove):
            part.visible = is_one and is_bone
        self.joint_folder.visible = 'damping' in values
        self.joint_folder.label = f'Joint to {parents[0]}' if is_one and parents else 'Joints'
        self.body.fill(values, keep_typed)
        self.joint.fill(values, keep_typed)

    def has(self, widget_id: str) -> bool:
        """Whether a widget with this id is a field of the form."""
        return self.body.has(widget_id) or self.joint.has(widget_id)

    def values(self) -> tuple[FormValues, list[errors.ModelError]]:
        """Changed values of the form, and errors of those that cannot be read."""
        (body, in_body), (joint, in_joint) = self.body.values(), self.joint.values()
        return {**body, **joint}, in_body + in_joint

    def show_errors(self, found: Iterable[errors.ModelError]) -> None:
        """Show each error below its field, and the others below the Update button.

        The names of the fields are listed there, too, as the fields may be out of view.
        """
        found = list(found)
        self.body.show_errors(found)
        self.joint.show_errors(found)
        paths = {error.path for error in found}
        names = [field.name for field in (*BODY, *JOINT) if field.key in paths]
        lines = [error_text(error) for error in found if error.path not in KEYS]
        if names:
            lines.insert(0, f'Nothing is applied: see {", ".join(names)}')
        self.show_message('\n'.join(lines))

    def show_message(self, text: str) -> None:
        """Show why something was refused, below the Update button; empty text clears it."""
        self.message.content = colored(text, RED)

    def show_history(self, history: UndoHistory) -> None:
        """Label the buttons with the changes that they would undo and redo."""
        for button, label, name in ((self.undo, 'Undo', history.undo_name),
                                    (self.redo, 'Redo', history.redo_name)):
            button.disabled = not name
            button.label = f'{label}: {name}' if name else label

    def show_editing(self, editing: bool) -> None:
        """Label the button 'Edit', or 'Run' while editing."""
        self.edit.label = 'Run' if editing else 'Edit'
        self.edit.icon = 'player-play' if editing else 'pencil'


def _advice(selected: Sequence[str]) -> str:
    """What can be done with the selection."""
    if not selected:
        return ('Click on a bone in the picture or in this tree to edit it. '
                'Ctrl+click selects several. Below, add a bone.')
    return '' if len(selected) == 1 else (
        f'{len(selected)} bones are selected: a value applies to all of them')


def _set_options(dropdown: viser.GuiDropdownHandle, options: tuple[str, ...], value: str) -> None:
    if dropdown.options != options:
        dropdown.options = options
    dropdown.value = value

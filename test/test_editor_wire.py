"""The editor as an open page speaks to it: clicks, drags, typed values and files over the wire."""
import time

import fit_rigs
import pytest

viser = pytest.importorskip('viser')

from page_client import PATIENCE, PageClient, batch_of, served, wait  # noqa: E402
from test_editor import RUBBISH, errors_in  # noqa: E402
from test_fit_broken import BROKEN  # noqa: E402
from viser import _messages  # noqa: E402

from ragdoll_ros.files.scene import load_scene  # noqa: E402
from ragdoll_ros.viewer.editor import changes  # noqa: E402
from ragdoll_ros.viewer.sources.simulation import SimulationSource  # noqa: E402

DROP = load_scene('drop')


class Browser(PageClient):
    """One open page, and what a user does there."""

    def click_body(self, page, bone):
        """Click where the page draws a bone."""
        node, number, _ = batch_of(page, bone)
        self.send(_messages.SceneNodeClickMessage(
            node, number, (4.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.5, 0.5), None))

    def press_button(self, button):
        self.update(button, True)

    def drag_handle(self, handle, position):
        """Take a handle, bring it somewhere in ten steps, let it go."""
        begin, name = handle.position, handle.name
        self.send(_messages.TransformControlsDragStartMessage(name))
        for k in range(1, 11):
            at = tuple(a + (b - a) * k / 10 for a, b in zip(begin.tolist(), position, strict=True))
            self.send(_messages.TransformControlsUpdateMessage(name, tuple(handle.wxyz), at))
        self.send(_messages.TransformControlsDragEndMessage(name))

    def upload(self, button, name, content):
        """Send a file in parts of 1 MB, as the page does."""
        uuid, size = button._impl.uuid, 1_000_000
        parts = [content[k:k + size] for k in range(0, len(content), size)]
        self.send(_messages.FileTransferStartUpload(uuid, name, name, 'x', len(parts),
                                                    len(content)))
        for number, part in enumerate(parts):
            self.send(_messages.FileTransferPart(uuid, name, number, part))


@pytest.fixture
def page(tmp_path):
    with served(SimulationSource(DROP), tmp_path) as page:
        yield page


@pytest.fixture
def browser(page):
    browser = page.open(Browser)
    # The first frame is drawn: by then, clicks are listened to.
    wait(lambda: page.frame is not None)
    return browser


def settled(editor):
    """Wait until what the editor has begun is done: it fills in the fields last.

    A person does not type into them in the few ms between. Neither asks for anything; each waits
    for its turn.
    """
    editor.redo()
    editor.select(editor.bone)


def test_a_bone_is_clicked_dragged_typed_and_undone(page, browser):
    editor = page.editor
    browser.click_body(page, 'left_shin')
    wait(lambda: editor.bone == 'left_shin')
    browser.press_button(editor.panel.edit)
    wait(lambda: editor.handles.body is not None)
    assert page.source.status.paused and page.source.frame.time == 0
    browser.drag_handle(editor.handles.body, (0.02, 0.1, 0.45))
    wait(lambda: editor.panel.body['position'].value == '0.02, 0.1, 0.45')
    settled(editor)
    moved = editor.scene
    assert changes.find(moved, 'left_shin')[1].position == pytest.approx((0.02, 0.1, 0.45))
    assert page.source.frame.scene is moved
    browser.update(editor.panel.body['mass'], 7)
    browser.update(editor.panel.joint['limits_1'], '-5, 100')
    browser.press_button(editor.panel.update)
    wait(lambda: changes.find(editor.scene, 'left_shin')[1].mass == 7)
    settled(editor)
    browser.update(editor.panel.joint['limits_1'], '100, -5')
    browser.press_button(editor.panel.update)
    wait(lambda: 'limits_1' in errors_in(editor.panel))
    browser.press(page, 'Undo')
    wait(lambda: editor.scene == moved and not errors_in(editor.panel))
    browser.press(page, 'Undo')
    wait(lambda: editor.scene == DROP and page.source.frame.scene is editor.scene)
    browser.press(page, 'Edit or run')
    wait(lambda: page.source.frame.time > 0.05 and editor.handles.body is None)


def test_editing_ends_where_the_page_goes_on(page, browser):
    page.editor.select('head')
    browser.press_button(page.editor.panel.edit)
    # The bar shows nothing before the page's first frame.
    wait(lambda: page.editor.handles.body is not None and page.transport.shown is not None
         and not page.transport.shown.playing)
    browser.press(page, 'Play or pause')
    wait(lambda: page.editor.handles.body is None)
    assert not page.editor.editing


def test_a_step_ends_editing(page, browser):
    """The doll leaves its bind pose by one tick, without handles in the air; it stays paused."""
    page.editor.select('head')
    browser.press_button(page.editor.panel.edit)
    wait(lambda: page.editor.handles.body is not None and page.frame.time == 0)
    browser.press(page, 'Step')
    wait(lambda: page.frame.time > 0)
    assert page.editor.handles.body is None and not page.editor.editing
    assert page.source.status.paused and page.frame.time == pytest.approx(0.01)


def test_undo_stays_in_a_scene_from_elsewhere(page, browser):
    page.source.load('crowd')
    wait(lambda: page.editor.scene.name == 'crowd')
    browser.press(page, 'Undo')
    wait(lambda: page.editor.panel.undo.disabled)
    assert page.source.frame.scene.name == 'crowd'


def test_a_character_is_uploaded_and_its_skin_shown(page, browser):
    """3 MB of it, with a picture that nothing reads."""
    made = fit_rigs.document(fit_rigs.RIGS['vrm'])
    made.view(bytes(3_000_000))
    browser.upload(page.editor.files.fit_button, 'vrm.glb', made.glb())
    wait(lambda: page.editor.scene.dolls[0].doll.model is not None)
    wait(lambda: page.stage.scene is page.editor.scene and page.stage.skins.handles)
    assert page.stage.skins.notes == []


def test_rubbish_leaves_the_page_as_it_was(page, browser):
    """The doll falls on meanwhile, in the same process."""
    files = page.editor.files
    wait(lambda: page.frame is not None)
    for number, (name, content) in enumerate([*list(BROKEN.items())[::8], *RUBBISH.items()]):
        button = (files.fit_button, files.upload_button)[number % 2]
        before = page.source.frame.time
        browser.upload(button, f'{number}_{name}', content)
        wait(lambda number=number: f'{number}_' in files.message.content
             and 'expected' in files.message.content)
        wait(lambda before=before: page.source.frame.time > before)
    # Values that no field can have, buttons that are none.
    for handle, value in ((page.editor.panel.body['mass'], 'x'), (page.editor.panel.bone, 'nobody'),
                          (page.editor.panel.body['size'], [1]), (files.name, None),
                          (page.editor.panel.body['shape'], 'cone')):
        browser.update(handle, value)
    browser.press_button(page.editor.panel.update)
    browser.send(_messages.TransformControlsDragEndMessage(page.editor.handles.root + '/body'))
    before = page.source.frame.time
    wait(lambda: page.source.frame.time > before + 0.05)
    assert page.editor.scene == DROP
    browser.click_body(page, 'head')
    wait(lambda: page.editor.bone == 'head')
    settled(page.editor)
    # A busy machine may only now get to what was sent before, and fill in the fields once more.
    for _ in range(100):
        browser.update(page.editor.panel.body['mass'], 2)
        browser.press_button(page.editor.panel.update)
        end = time.monotonic() + PATIENCE / 100
        wait(lambda end=end: changes.find(page.editor.scene, 'head')[1].mass == 2
             or time.monotonic() > end)
        if changes.find(page.editor.scene, 'head')[1].mass == 2:
            break
    assert changes.find(page.editor.scene, 'head')[1].mass == 2

"""The editor in headless Chromium: keys, fields and handles as a user has them."""
from __future__ import annotations

import itertools

import numpy as np
import pytest
from browser import editing, start_of

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.editor import changes

SCENE = load_scene('drop')
START = start_of(SCENE)
BONE = 'left_shin'
NUMBERS = itertools.count()


@pytest.fixture(scope='module')
def view(tmp_path_factory):
    """The page at the scene's start, paused."""
    with editing(SCENE, tmp_path_factory.mktemp('editing')) as view:
        view.hold_at(SCENE, START)
        yield view


def saved(view):
    """The scene as the page saves it."""
    name = f'edited_{next(NUMBERS)}'
    view.field('File').fill(name)
    view.press('Save')
    view.see(f'saved {name}.yaml')
    return load_scene(str(view.folder / f'{name}.yaml'))


def choose(view, name):
    """Choose a bone by a click on it, at the start."""
    index = SCENE.bone_index(name)
    view.page.mouse.click(*view.pixels(START[index:index + 1])[0])
    view.wait(lambda: view.field('Bone').input_value() == name
              and float(view.field('Mass, kg').input_value()) == SCENE.bones[index].mass)


FOCUSED = """() => document.activeElement?.closest('.mantine-Flex-root')
    ?.querySelector('label')?.textContent ?? ''"""
"""Label of the field that has the focus."""


def tab_to(view, label):
    """Press Tab until the field beside a label has the focus."""
    for _ in range(60):
        view.key('Tab')
        if view.page.evaluate(FOCUSED) == label:
            return
    raise AssertionError(label)


TYPED = {'Size, m': '0.08 0.08 0.4', 'Mass, kg': '3.5', 'Inertia, kg m²': '0.1 0.1 0.05',
         'Position, m': '0 0.1 0.31', 'Rotation, °': '0 0 30', 'Friction': '0.7',
         'Rolling, m': '0.01', 'Restitution': '0.25', 'Colour': 'rebeccapurple',
         'Anchor, m': '0 0.1 0.55', 'Limits 1, °': '-5 100', 'Damping, N m s': '0.5'}
"""Twelve fields in the order of the form, each as it is typed."""


MEANT = [0.08, 0.08, 0.4, 3.5, 0.1, 0.1, 0.05, 0, 0.1, 0.31, 0, 0, np.sin(np.radians(15)),
         np.cos(np.radians(15)), 0.7, 0.01, 0.25, 0.4, 0.2, 0.6, 0, 0.1, 0.55,
         *np.radians((-5, 100)), 0.5]
"""Their numbers in the scene; an angle as a quaternion, a colour from 0 to 1."""


def numbers(scene):
    """What those fields are in a scene."""
    (_, bone), joint = changes.find(scene, BONE), changes.joint_of(scene, BONE)
    return [*bone.shape.size, bone.mass, *(bone.moments or ()), *bone.position, *bone.orientation,
            bone.friction, bone.rolling_friction, bone.restitution, *(bone.color or ())[:3],
            *joint.anchor, *joint.limits[0], joint.damping]


def test_ten_fields_by_keyboard_alone(view):
    """Tab, type, Enter, without a pause; each is a step that can be undone."""
    view.tab('Edit')
    choose(view, BONE)
    for label, text in TYPED.items():
        tab_to(view, label)
        view.page.keyboard.type(text)
        view.key('Enter')
    view.see(f'Undo: numbers of {BONE}')
    view.wait(lambda: numbers(saved(view)) == pytest.approx(MEANT, abs=1e-12))
    # The client may send two clicks that come at once as one.
    for label in reversed(TYPED):
        typed = view.field(label).input_value()
        view.press(f'Undo: numbers of {BONE}')
        view.wait(lambda label=label, typed=typed: view.field(label).input_value() != typed)
    view.button('Undo').wait_for()
    assert saved(view) == SCENE


def test_a_refused_value_is_told_at_the_field_and_at_the_button(view):
    """The field keeps its text and the focus; the next Enter applies what is right."""
    view.tab('Edit')
    choose(view, BONE)
    field = view.field('Friction')
    field.focus()
    field.fill('-1')
    view.key('Enter')
    view.see('friction must be')
    told = view.page.get_by_text('Nothing is applied: see friction')
    told.wait_for()
    assert 0 < view.top(told) - view.top(view.button('Update')) < 60
    assert field.input_value() == '-1' and view.page.evaluate(FOCUSED) == 'Friction'
    field.fill('0.5')
    view.key('Enter')
    told.wait_for(state='hidden')
    assert changes.find(saved(view), BONE)[1].friction == 0.5
    view.press(f'Undo: numbers of {BONE}')
    view.button('Undo').wait_for()


def test_what_is_typed_while_a_value_is_applied_stays(view):
    """The scene restarts meanwhile, and the form is filled anew."""
    view.tab('Edit')
    choose(view, BONE)
    mass, friction = view.field('Mass, kg'), view.field('Friction')
    friction.fill('0.7')
    mass.fill('4')
    mass.press('Enter')
    mass.fill('4.25')
    view.see(f'Undo: numbers of {BONE}')
    bone = changes.find(saved(view), BONE)[1]
    assert (bone.mass, bone.friction) == (4, 0.7)
    assert mass.input_value() == '4.25'
    view.press(f'Undo: numbers of {BONE}')
    view.wait(lambda: float(mass.input_value()) == SCENE.bones[SCENE.bone_index(BONE)].mass)


AT_ONCE = """async ([update, file, name, save]) => {
  update.click();
  await null;
  Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(file, name);
  file.dispatchEvent(new Event('input', {bubbles: true}));
  await null;
  save.click();
}"""
"""Presses Update, types a file's name and presses Save before the browser comes to any timer."""


def test_nothing_is_lost_of_what_a_busy_browser_hears_at_once(view):
    view.field('Mass, kg').fill('4.5')
    name = f'edited_{next(NUMBERS)}'
    update, file, save = (part.element_handle() for part in (
        view.button('Update'), view.field('File'), view.button('Save')))
    view.page.evaluate(AT_ONCE, [update, file, name, save])
    view.see(f'saved {name}.yaml')
    view.see(f'Undo: numbers of {BONE}')
    assert changes.find(saved(view), BONE)[1].mass == 4.5
    view.press(f'Undo: numbers of {BONE}')
    view.button('Undo').wait_for()


def banner(view):
    return view.page.locator('.ragdoll-edit-banner')


def mode(view):
    """What the banner says that handles do."""
    return banner(view).locator('[aria-pressed=true]').text_content().split()[0]


def run(view):
    """End editing, and go back to the start."""
    view.key(' ')
    banner(view).wait_for(state='detached')
    view.tab('Play')
    view.hold_at(SCENE, START)


def test_e_edits_and_w_e_r_choose_what_handles_do(view):
    """E opens the tab and starts editing, which a banner says; there it turns."""
    view.tab('Play')
    view.page.mouse.click(20, 700)
    view.key('e')
    banner(view).wait_for()
    view.button('Run').first.wait_for()
    assert mode(view) == 'Move'
    for key, name in (('e', 'Turn'), ('r', 'Size'), ('w', 'Move'), ('e', 'Turn')):
        view.key(key)
        view.wait(lambda name=name: mode(view) == name)
    banner(view).get_by_role('button', name='Size').click()
    view.wait(lambda: mode(view) == 'Size')
    run(view)


def test_keys_mean_no_two_things(view):
    """In a field E is a letter; where the tab is closed E opens it, R resets and W flies."""
    view.tab('Play')
    view.page.mouse.click(20, 700)
    view.key('e')
    banner(view).wait_for()
    view.key('w')
    view.wait(lambda: mode(view) == 'Move')
    choose(view, BONE)
    view.field('Mass, kg').fill('')
    view.page.keyboard.type('5e0')
    assert view.field('Mass, kg').input_value() == '5e0'
    view.page.mouse.click(20, 700)
    view.tab('Play')
    view.page.mouse.click(20, 700)
    before = view.pixels(START)
    view.key('r')
    view.page.keyboard.down('w')
    view.wait(lambda: abs(view.pixels(START) - before).max() > 5)
    view.page.keyboard.up('w')
    view.key('e')
    view.button('Run').first.wait_for()
    assert mode(view) == 'Move'
    banner(view).get_by_role('button', name='Run').click()
    banner(view).wait_for(state='detached')
    view.wait(lambda: abs(view.bodies(SCENE) - START).max() > 0.01)
    view.tab('Play')
    view.hold_at(SCENE, START)


def row(view, name):
    """The line of the tree with a bone."""
    return view.page.locator(f'.ragdoll-tree [data-bone="{name}"]')


def selected(view):
    return set(view.page.locator('.ragdoll-tree [aria-selected=true]').all_text_contents())


def test_bones_are_chosen_in_the_tree_and_in_the_picture(view):
    """With Ctrl several, whose masses are changed and undone as one step; a child is indented."""
    view.tab('Edit')
    row(view, 'torso').click()
    view.wait(lambda: selected(view) == {'torso'} and view.field('Bone').input_value() == 'torso')
    left = [row(view, name).evaluate('row => parseFloat(getComputedStyle(row).paddingLeft)')
            for name in ('torso', 'left_thigh', 'left_shin')]
    assert left == sorted(set(left))
    row(view, 'left_shin').click(modifiers=['Shift'])
    view.page.keyboard.down('Control')
    index = SCENE.bone_index('head')
    view.page.mouse.click(*view.pixels(START[index:index + 1])[0])
    view.page.keyboard.up('Control')
    names = {'torso', 'left_shin', 'head'}
    view.wait(lambda: selected(view) == names)
    view.see('3 bones are selected')
    field = view.field('Mass, kg')
    assert field.input_value() == '(several)'
    field.fill('6.5')
    field.press('Enter')
    view.see('Undo: numbers of 3 bones')
    scene = saved(view)
    assert [bone.mass == 6.5 for bone in scene.bones] == [
        bone.name in names for bone in scene.bones]
    view.press('Undo: numbers of 3 bones')
    view.button('Undo').wait_for()
    assert saved(view) == SCENE
    row(view, 'head').click()
    view.wait(lambda: selected(view) == {'head'})


SPHERES = """() => {
  const nodes = window.__viserMutable.nodeRefFromName;
  const names = Object.keys(nodes).filter(name => /^.editor.*.limit_0_1$/.test(name)
                                                  && nodes[name]);
  if (names.length !== 1) return null;
  nodes[names[0]].updateWorldMatrix(true, false);
  const toWorld = nodes[''].matrixWorld.clone().invert();
  return toWorld.multiply(nodes[names[0]].matrixWorld).elements.slice(12, 15);
}"""
"""Where the one sphere of an upper limit is drawn, m, z up."""


def test_a_joint_range_is_dragged_by_its_edge(view):
    """The knee's upper limit, seen from the side: to 90 degrees, where the shin is level behind."""
    view.tab('Play')
    view.page.mouse.click(20, 700)
    view.key('e')
    banner(view).wait_for()
    row(view, BONE).click()
    view.look((0, 3, 0.8), (0, 0.075, 0.6))
    anchor, limit = np.array((0, 0.075, 0.625)), np.radians(126)
    spoke = -np.array((np.sin(limit), 0, np.cos(limit)))
    view.wait(lambda: view.page.evaluate(SPHERES))
    view.wait(lambda: np.cross(np.subtract(view.page.evaluate(SPHERES), anchor), spoke)
              == pytest.approx(0, abs=1e-6))
    at = view.page.evaluate(SPHERES)
    radius = np.subtract(at, anchor) @ spoke
    assert radius > 0.2
    view.wait(lambda: 0 < view.pixels([at])[0][0] < 900)
    (x0, y0), (x1, y1) = view.pixels([at, anchor - radius * np.array((1, 0, 0))])
    view.page.mouse.move(x0, y0)
    view.page.mouse.down()
    view.page.mouse.move(x1, y1, steps=10)
    view.page.mouse.up()
    view.see(f'Undo: range of {BONE}')
    scene = saved(view)
    low, high = np.degrees(changes.joint_of(scene, BONE).limits[0])
    assert low == 0 and high == pytest.approx(90, abs=1.5)
    assert changes.change_joint(scene, BONE, limits=changes.joint_of(
        SCENE, BONE).limits) == SCENE
    view.press(f'Undo: range of {BONE}')
    view.button('Undo').wait_for()
    view.key('h')
    run(view)


def test_a_root_is_fixed_by_its_checkbox(view):
    """Not while the doll spins; then it hangs by its torso, also where the page runs it."""
    view.tab('Edit')
    row(view, 'torso').click()
    view.field('Root fixed to the world').check()
    view.press('Update')
    view.see('spin must be none: the root is fixed')
    view.field('Spin, rad/s').fill('0 0 0')
    view.press('Update')
    view.wait(lambda: row(view, 'torso').text_content() == 'torso (fixed)')
    assert saved(view).dolls[0].fixed_root
    index = SCENE.bone_index('torso')
    moved = np.arange(len(START)) != index
    view.press('Play')
    view.wait(lambda: abs(view.bodies(SCENE) - START)[moved].max() > 0.05)
    assert view.all_bodies(SCENE)[index] == pytest.approx(START[index], abs=1e-6)
    view.press('Undo: numbers of torso')
    view.wait(lambda: row(view, 'torso').text_content() == 'torso')
    assert saved(view) == SCENE


def test_enter_in_a_setting_applies_it(view):
    view.tab('Play')
    view.page.get_by_text('Settings', exact=True).click()
    # The first: the form of the tab Edit has one, too.
    friction = view.row('Friction').locator('input').first
    friction.fill('0.05')
    friction.press('Enter')
    view.page.get_by_text('Friction is unlimited').wait_for(state='hidden')
    view.tab('Edit')
    view.wait(lambda: saved(view).material.friction == 0.05)

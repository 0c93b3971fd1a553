"""Forty things that people type, into ten fields of the page: used to the digit, or refused."""
# ruff: noqa: RUF001 digits of other scripts are what is typed here
from __future__ import annotations

import itertools
import math
import re

import numpy as np
import pytest
from browser import editing

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.viewer.editor import changes

SCENE = load_scene('drop')
BONE = 'left_shin'

TYPED = {
    '1': 1, '7.5': 7.5, '.5': 0.5, '5.': 5, '1e6': 1e6, '1e-3': 1e-3, ' 3,5': 3.5, '0,125': 0.125,
    '+2': 2, '1 000': 1000, "1'000": 1000, '1,234.5': 1234.5, '1.234,5': 1234.5, '７': 7,
    '٧٠': 70, '0.12345678901234567': 0.12345678901234567, '1\u202f000': 1000, '0.1': 0.1,
    '123 456': 123456, '1.000': 1,
    '-5': -5, '−5': -5, '0': 0, '': None, '   ': None, 'abc': None, 'nan': None, 'inf': math.inf,
    '1,000': None, '1e400': None, '1e-400': None, '--5': None, '1_000': None, '0x10': None,
    '½': None, '10²': None, '5%': None, '1 00': None, '<b>1</b>': None, '1/2': None, '1e9': 1e9,
    '1e-9': 1e-9}
"""And what each says, if it says anything."""

FIELDS = {
    'Mass, kg': lambda bone, joint: bone.mass,
    'Friction': lambda bone, joint: bone.friction,
    'Rolling, m': lambda bone, joint: bone.rolling_friction,
    'Restitution': lambda bone, joint: bone.restitution,
    'Damping, N m s': lambda bone, joint: joint.damping,
    'Size, m': lambda bone, joint: bone.shape.size,
    'Position, m': lambda bone, joint: bone.position,
    'Anchor, m': lambda bone, joint: joint.anchor,
    'Inertia, kg m²': lambda bone, joint: bone.moments,
    'Limits 1, °': lambda bone, joint: joint.limits[0]}

OF_THREE = ('Size, m', 'Position, m', 'Anchor, m', 'Inertia, kg m²')
"""Fields of three numbers; each is typed with a semicolon between them."""

OPTIONAL = ('Friction', 'Rolling, m', 'Restitution', 'Inertia, kg m²')
"""Fields in which nothing means something."""


COUNT = itertools.count()

HANDLE = """() => {
  const nodes = window.__viserMutable.nodeRefFromName;
  const names = Object.keys(nodes).filter(name => /^.editor.*.frame$/.test(name) && nodes[name]);
  if (names.length !== 1) return null;
  nodes[names[0]].updateWorldMatrix(true, false);
  const root = nodes[''].matrixWorld.clone().invert();
  return root.multiply(nodes[names[0]].matrixWorld).elements.slice(12, 15);
}"""
"""Where the one highlight stands, m, z up."""


@pytest.fixture(scope='module')
def view(tmp_path_factory):
    """The page, with a bone chosen."""
    with editing(SCENE, tmp_path_factory.mktemp('typed')) as view:
        view.tab('Edit')
        view.row('Bone').locator('input').first.click()
        view.page.get_by_role('option', name=BONE, exact=True).click()
        view.wait(lambda: view.field('Mass, kg').input_value() == '5')
        yield view


def written(label, text):
    """What stands in a field that is to hold a number: alone, three times, or below itself."""
    if label == 'Limits 1, °':
        return f'-90; {text}'
    return ';'.join([text] * 3) if label in OF_THREE else text


def meant(label, number):
    """And what the scene has then."""
    if number is None:
        return None
    if label == 'Limits 1, °':
        # As precise as a conversion from degrees is.
        return pytest.approx(np.radians((-90, number)), rel=1e-15)
    return (number,) * 3 if label in OF_THREE else number


def said(view):
    """What is written in red."""
    return view.page.evaluate("""() => [...document.querySelectorAll('div')].filter(
        each => each.style.color === 'var(--ragdoll-red)' && each.checkVisibility())
        .map(each => each.textContent)""")


def used(view, label):
    """What a field's number is in the scene, as the page saves it under another name each time."""
    name = f'typed_{next(COUNT)}'
    view.field('File').fill(name)
    view.press('Save')
    view.see(f'saved {name}.yaml')
    scene = load_scene(str(view.folder / f'{name}.yaml'))
    return FIELDS[label](changes.find(scene, BONE)[1], changes.joint_of(scene, BONE))


@pytest.mark.parametrize(('label', 'every'), [
    ('Mass, kg', 7), *(pytest.param(label, 1, marks=pytest.mark.slow) for label in FIELDS)])
def test_what_is_typed_is_used_to_the_digit_or_refused_in_words(view, label, every):
    field, first, taken = view.field(label), view.field(label).input_value(), 0
    before = used(view, label)
    for text, number in list(TYPED.items())[::every]:
        typed, expected = written(label, text), meant(label, number)
        field.fill(typed)
        view.press('Update')
        means_something = number is not None or (not text.strip() and label in OPTIONAL)
        # What means nothing is refused, also where the scene has nothing there anyhow.
        view.wait(lambda expected=expected, meant=means_something: said(view) or (
            meant and used(view, label) == expected))
        words = said(view)
        if words:
            name = label.partition(',')[0].lower()
            assert words[0].startswith(f'{name} must be ') and len(words[0].split()) > 4, words
            assert not re.search('[a-z][A-Z]', words[0]), words
            assert used(view, label) == before, (text, words)
            assert field.input_value() == typed
        else:
            taken += 1
        field.fill(first)
        view.press('Update')
        view.wait(lambda: not said(view) and used(view, label) == before)
    assert 0 < taken < len(TYPED) / every


def highlight_is_on_the_body(view):
    at = view.page.evaluate(HANDLE)
    body = view.all_bodies(SCENE)[SCENE.bone_index(BONE)]
    return at is not None and np.abs(np.subtract(at, body)).max() < 1e-3


@pytest.mark.parametrize('edits', [3, pytest.param(200, marks=pytest.mark.slow)])
def test_handles_stay_on_the_body_that_is_edited(view, edits):
    """After each of many sizes, places and turns, back to where it was ones among them."""
    random = np.random.default_rng(3)
    if view.button('Edit').count():
        view.press('Edit')
    choices = {'Size, m': ['19 19 19', '.3 .3 .3', '0.08 0.08 0.2'],
               'Position, m': ['0 0 0', '0 0.1 0.5', '0 3 9'], 'Rotation, °': ['0 0 0', '10 20 30']}
    labels = ['Size, m', 'Size, m', *random.choice(list(choices), edits)][:edits]
    for count, label in enumerate(labels):
        text = choices[label][count] if count < 2 else random.choice(choices[label])
        view.field(label).fill(text)
        view.press('Update')
        view.wait(lambda: highlight_is_on_the_body(view))
    assert not view.errors

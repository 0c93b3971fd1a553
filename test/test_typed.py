"""Numbers as people type them: each of these is read to the digit, or refused in words."""
# ruff: noqa: RUF001 digits of other scripts are what is typed here
from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip('viser')

from ragdoll_ros.model import errors
from ragdoll_ros.viewer.widgets.parsing import format_number, parse_number, parse_numbers


@pytest.mark.parametrize(('text', 'value'), [
    ('70', 70.0), ('70.5', 70.5), ('.5', 0.5), ('5.', 5.0), ('-5', -5.0), ('+5', 5.0),
    ('1e9', 1e9), ('1e-9', 1e-9), ('1E+3', 1000.0), ('-2.5e-3', -0.0025), ('007', 7.0),
    (' 3,5', 3.5), ('3,5 ', 3.5), ('0,125', 0.125), ('1234,125', 1234.125), ('-,5', -0.5),
    ('1 000', 1000.0), ('12 345 678', 12345678.0), ("1'000", 1000.0), ('1’000', 1000.0),
    ('1\u00a0000', 1000.0), ('1\u202f000,5', 1000.5), ('1,234.5', 1234.5), ('1.234,5', 1234.5),
    ('1,234,567', 1234567.0), ('1.234.567', 1234567.0), ('1.000', 1.0), ('1.234', 1.234),
    ('７０', 70.0), ('７，５', 7.5), ('٧٠', 70.0), ('−5', -5.0), ('0', 0.0), ('-0', 0.0),
    ('0.1234567890123456789', 0.1234567890123456789), ('1e308', 1e308), ('5e-324', 5e-324),
    ('70 kg', 70.0), ('70kg', 70.0), ('500 g', 0.5), ('7e1 kg', 70.0), ('1 000 g', 1.0),
    ('0.3 t', 300.0)])
def test_what_is_typed_is_read_to_the_digit(text, value):
    assert parse_number(text, 'kg') == value


@pytest.mark.parametrize('text', [
    '', '   ', 'abc', '1,000', '12,345', '-1,000', '1 00', '1 0000', '1,2,3', '1,23,456', 'inf',
    'nan', '∞', '1e', 'e9', '--5', '5-', '1_000', '0x10', '1/2', '½', '10²', '5%', '1e400',
    '1e-400', '1e9999999', '1..2', '1.2.3', '70 m', '70 lb', 'kg', '<b>1</b>', '1\x00', '1;2'])
def test_what_may_be_another_number_or_none_is_refused_in_words(text):
    with pytest.raises(errors.WrongForm) as caught:
        parse_number(text, 'kg')
    assert caught.value.value == text and len(caught.value.expected.split()) > 1


def test_a_comma_that_may_be_two_things_is_told_with_both():
    with pytest.raises(errors.WrongForm, match=r'write 1000, or 1\.000'):
        parse_number('1,000')


def test_infinity_is_a_number_where_it_means_something():
    assert parse_number(' inf', infinite=True) == math.inf
    assert parse_number('∞', infinite=True) == math.inf
    with pytest.raises(errors.WrongForm):
        parse_number('nan', infinite=True)


@pytest.mark.parametrize(('text', 'values'), [
    ('1, 2, 3', (1, 2, 3)), ('1 2 3', (1, 2, 3)), ('1,2,3', (1, 2, 3)), ('(1, 2, 3)', (1, 2, 3)),
    ('[.1 -.2 3e-1]', (0.1, -0.2, 0.3)), ('1,5; 2; -0,5', (1.5, 2, -0.5)), ('1;2;3', (1, 2, 3)),
    ('10 20 30 cm', (0.1, 0.2, 0.3)), ('10 cm; 2; 3 mm', (0.1, 2, 0.003)),
    ('1; 2,5; 3 cm', (0.01, 0.025, 0.03)), ('1; 2; 3 m', (1, 2, 3)), ('1 cm; 2; 3', (0.01, 2, 3)),
    ('7cm 8cm 9cm', (0.07, 0.08, 0.09)), ('10 cm, 20 cm, 30 cm', (0.1, 0.2, 0.3)),
    ('1 m 2 m -.3 m', (1, 2, -0.3)),
    ('1,5 m； 2 m； 3 m', (1.5, 2, 3)), ('1m, 2, 3m', (1, 2, 3)), ('７ ８ ９', (7, 8, 9))])
def test_three_numbers(text, values):
    assert parse_numbers(text, 3, 'm') == values


@pytest.mark.parametrize('text', ['', '1', '1 2', '1 2 3 4', '1,5 2,5 3,5', '1,,2', '1, 2, x',
                                  '1; 2', '1; 2; 1,000', '1 2 inf', 'a b c', '1, 2,',
                                  '1cm 2 3', '1 2cm 3m', '1 cm, 2 m, 3 m', '1; x; 3'])
def test_what_is_not_three_numbers_is_refused(text):
    """As such, or as what may be two numbers."""
    with pytest.raises(errors.WrongForm) as caught:
        parse_numbers(text, 3, 'm')
    assert ('3 numbers' if '1,000' not in text else 'unambiguous') in caught.value.expected


def test_an_acceleration_has_its_unit():
    assert parse_numbers('0 0 -9.8 m/s²', 3, 'm/s²') == (0, 0, -9.8)
    assert parse_numbers('0 m/s2, 0 m/s^2, -9.8m/s²', 3, 'm/s²') == (0, 0, -9.8)


def test_what_is_shown_is_read_as_what_is_shown():
    """Seven digits, also of numbers that were never typed."""
    random = np.random.default_rng(5)
    for value in [0.0, 1.0, -0.25, 1e9, 1e-9, *random.normal(size=200) * 10.0 **
                  random.integers(-12, 12, 200)]:
        assert parse_number(format_number(value)) == pytest.approx(value, rel=6e-7, abs=0)
    assert [format_number(value) for value in (70.0, 1e9, 1e-9, 0.1, -0.0)] == [
        '70', '1e9', '1e-9', '0.1', '0']
    assert format_number(1.436107e-31) == format_number(-1.2e-16) == '0'

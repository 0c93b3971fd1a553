"""What people type for a colour, as pages tell it: what the browser makes of it, and the text."""
from __future__ import annotations

import pytest

from ragdoll_ros.model import errors
from ragdoll_ros.viewer.widgets.color_field import parse_color

DODGER_BLUE = (30, 144, 255)


@pytest.mark.parametrize('told', [
    '#1e90ff dodgerblue', '#1e90ff #1E90FF', '- 1e90ff', '- 30 144 255', '- 30, 144, 255',
    '- 30;144;255', '- (30, 144, 255)', '#1e90ff rgb(30, 144, 255)',
    '#1e90ff hsl(209.6 100% 55.9%)', '#1e90ff rgb(11.8% 56.5% 100%)'])
def test_a_colour_in_any_usual_form_is_read(told):
    assert parse_color(told) == DODGER_BLUE


@pytest.mark.parametrize(('told', 'words'), [
    ('- redd', 'such as red'), ('- #1e90f', 'such as red'), ('- 30 144', 'such as red'),
    ('- rgba(30, 144, 255, 0.5)', 'such as red'), ('-  ', 'the field is empty'),
    ('#ff90ff rgb(300, 144, 255)', '0 to 255'), ('- 30 144 256', '0 to 255'),
    ('- -1 0 0', '0 to 255'), ('- 0.5 0.5 0.5', '0 to 255')])
def test_what_is_none_is_refused_and_nothing_is_cut_to_fit(told, words):
    with pytest.raises(errors.WrongForm, match=words):
        parse_color(told)

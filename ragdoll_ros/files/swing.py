"""Swings as plain lists and numbers, the form of config/doll.schema.json."""
from __future__ import annotations

from collections.abc import Callable

from ..model.errors import ModelError
from ..model.swing import Link, Swing, strand


def swing_from(data: dict) -> Swing:
    """Make a swing of what a file holds; a ModelError tells where in it."""
    fields = dict(data)
    if 'strand' in fields:
        links = _at('strand', strand, fields.pop('strand'))
    else:
        links = tuple(_at(f'links[{index}]', Link, entry)
                      for index, entry in enumerate(fields.pop('links')))
    return Swing(links=links, **fields)


def swing_data(swing: Swing) -> dict:
    """A swing as a file holds it; swing_from gives an equal one back."""
    data = {'name': swing.name, 'bone': swing.bone, 'root': list(swing.root),
            'direction': list(swing.direction), 'gravity': swing.gravity, 'mode': swing.mode}
    if any(swing.velocity):
        data['velocity'] = list(swing.velocity)
    data['links'] = [_link_data(link) for link in swing.links]
    return data


def _link_data(link: Link) -> dict:
    data = {key: getattr(link, key) for key in ('length', 'mass', 'stiffness', 'damping')}
    if link.direction is not None:
        data['direction'] = list(link.direction)
    return data


def _at(where: str, make: Callable[..., object], fields: dict) -> object:
    try:
        return make(**fields)
    except ModelError as error:
        raise error.at(where) from None

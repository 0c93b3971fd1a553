"""What differs between engines that are compared at equal parameters, for the notes of tables."""
from collections.abc import Iterable

from .figures import Row, sound

LAWS = {
    'quickstart': 'PyBullet quickstart: default damping of bodies, joint motors that brake, '
                  'contacts from a distance of 20 mm, no self-collision',
    'bullet': 'PyBullet: rigid contacts solved by 20 sweeps per step; no restitution below 0.05 '
              'm/s; limits and penetration are corrected over 10 ms, so that limits are passed by '
              'degrees',
    'mujoco': 'MuJoCo: contacts and joint limits are springs with dampers, with time constants of '
              '4 and 2 steps at critical damping, which is no restitution; restitution is less '
              'damping at the same frequency; what these springs store counts as lost and, when '
              'they give it back, as energy excess',
    'dart': 'DART: rigid contacts and limits; friction is a pyramid, up to 41 % more in its '
            'diagonals; no restitution below 0.1 m/s',
    'drake': 'Drake: SAP with compliant contacts, one point for each pair of bodies; no '
             'restitution'}
"""By the first word of a method's name."""

FAMILIES = {'PyBullet': 'bullet', 'MuJoCo': 'mujoco', 'DART': 'dart', 'Drake': 'drake'}
"""Engines by the first word of a label, for rows without a method."""

UNLIMITED = ('Where friction is unlimited, as in the default scene, it is 0.7 in PyBullet and '
             'MuJoCo, which have no unlimited friction.')


def law_name(row: Row) -> str:
    """Contact parameters of a row; empty for figures of older versions."""
    if 'restitution' not in row:
        return ''
    return f'e = {row["restitution"]:g}, µ = {row["friction"]:g}'


def law_note(rows: Iterable[Row]) -> str:
    """Friction of the methods of some rows, and what differs; empty for ours alone.

    Rows without their friction are of scenes where it may be unlimited.
    """
    good = sound(rows)
    frictions = sorted({row['friction'] for row in good if 'friction' in row})
    shared = UNLIMITED
    if frictions:
        shared = f'All methods have the same friction, {" or ".join(map(str, frictions))}.'
    differing = _differing(good)
    return f'{shared} {differing}' if differing else ''


def motion_law_note(rows: Iterable[Row]) -> str:
    """As law_note(), for motions whose friction every engine represents."""
    differing = _differing(sound(rows))
    return f'All methods have the parameters in the titles. {differing}' if differing else ''


def _differing(rows: Iterable[Row]) -> str:
    names = {_engine(row) for row in rows}
    found = [text for name, text in LAWS.items() if name in names]
    if not found:
        return ''
    return ('What differs, beside step and integrator, from our rigid contacts and limits under '
            f"Newton's law of restitution: {'; '.join(found)}.")


def _engine(row: Row) -> str:
    if 'method' in row:
        return str(row['method']).partition('-')[0]
    return FAMILIES.get(str(row.get('label', '')).partition(' ')[0], '')

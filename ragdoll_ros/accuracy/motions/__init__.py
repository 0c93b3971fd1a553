"""Motions whose truth is known, and the list of them all."""
from __future__ import annotations

from .contact import contact_motions
from .flight import flight_motions
from .mechanisms import mechanism_motions
from .motion import Motion


def every_motion() -> list[Motion]:
    """All motions, simple ones first."""
    return [*flight_motions(), *mechanism_motions(), *contact_motions()]


__all__ = ['Motion', 'every_motion']

"""Stand-in for the simulation while no world is loaded, and the message that says so."""
from __future__ import annotations

from ...model.errors import ModelError

NO_WORLD = 'no world is loaded: load one by ~/load_world or by the parameter scene'


class NoWorldLoaded(ModelError):
    """Raised by an operation on a world while none is loaded."""

    def __init__(self) -> None:
        super().__init__('', 'no world', 'one that is loaded')

    def __str__(self) -> str:
        return NO_WORLD


class NoWorld:
    """Stand-in for a simulation: access to any of its attributes raises NoWorldLoaded."""

    def __getattr__(self, name: str) -> object:
        raise NoWorldLoaded

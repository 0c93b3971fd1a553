"""What stands for the simulation while no world is loaded, and what is said of it."""
from __future__ import annotations

from ...model.errors import ModelError

NO_WORLD = 'no world is loaded: load one by ~/load_world or by the parameter scene'


class NoWorldLoaded(ModelError):
    """Something is asked of a world while there is none."""

    def __init__(self) -> None:
        super().__init__('', 'no world', 'one that is loaded')

    def __str__(self) -> str:
        return NO_WORLD


class NoWorld:
    """In the place of a simulation: whatever is asked of it raises NoWorldLoaded."""

    def __getattr__(self, name: str) -> object:
        raise NoWorldLoaded

"""Recipes for tests: a ball that drops, which costs nothing, and what is written of it."""
import copy
from pathlib import Path

from ragdoll_ros.falls.recipe import build_recipe

BALL = {'name': 'ball', 'bones': [
    {'name': 'ball', 'shape': {'sphere': {'radius': 0.1}}, 'mass': 2.0, 'position': [0, 0, 0.1]}]}

DROP = {'name': 'drops', 'who': {'dolls': [BALL]}, 'start': {'clearance': {'uniform': [0.1, 0.5]}},
        'duration': 0.6, 'record': {'rate': 50}}


def recipe(base=None, **changes):
    """A recipe from plain data with some keys changed; all errors are raised."""
    data = {**copy.deepcopy(base or DROP), **changes}
    made, found = build_recipe(data, Path('recipe.yaml'))
    assert not found, found
    return made


def contents(folder):
    """Bytes of every file of a folder by its path."""
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob('*')) if path.is_file()}

"""Recipes for tests: a ball that drops, which costs nothing, and the default doll, shoved."""
import copy
from pathlib import Path

from ragdoll_ros.falls.recipe import build_recipe

BALL = {'name': 'ball', 'bones': [
    {'name': 'ball', 'shape': {'sphere': {'radius': 0.1}}, 'mass': 2.0, 'position': [0, 0, 0.1]}]}

DROP = {'name': 'drops', 'who': {'dolls': [BALL]}, 'start': {'clearance': {'uniform': [0.1, 0.5]}},
        'duration': 0.6, 'record': {'rate': 50}}


SHOVE = {
    'name': 'shove', 'who': {'dolls': ['doll']}, 'feet': ['left_shin', 'right_shin'],
    'start': {'heading_deg': {'uniform': [0, 360]}, 'lean_deg': {'uniform': [0, 3]},
              'lean_towards_deg': {'uniform': [0, 360]}},
    'pushes': [{'bone': 'torso', 'force': {'normal': [500, 150], 'within': [200, 1000]},
                'towards_deg': {'uniform': [0, 360]}, 'at': {'uniform': [0.05, 0.3]},
                'duration': {'uniform': [0.1, 0.3]}}],
    'ground': {'friction': {'uniform': [0.4, 1.0]}}, 'duration': 3}


def recipe(base=None, **changes):
    """A recipe from plain data with some keys changed; all errors are raised."""
    data = {**copy.deepcopy(base or DROP), **changes}
    made, found = build_recipe(data, Path('recipe.yaml'))
    assert not found, found
    return made


def file_bytes(folder):
    """Bytes of every file of a folder by its path."""
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob('*')) if path.is_file()}

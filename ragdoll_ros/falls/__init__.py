"""Data sets of falls: drawn from a recipe, simulated on all cores, written in several formats."""
from ..people.fall_phases import Phases
from .fall import Fall
from .recipe import Recipe, load_recipe
from .simulate import generate

__all__ = ['Fall', 'Phases', 'Recipe', 'generate', 'load_recipe']

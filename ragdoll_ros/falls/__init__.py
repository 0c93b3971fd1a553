"""Falls by the thousand: drawn by a recipe, simulated on all cores, written as a data set."""
from .fall import Fall, Phases
from .recipe import Recipe, load_recipe
from .simulate import generate

__all__ = ['Fall', 'Phases', 'Recipe', 'generate', 'load_recipe']

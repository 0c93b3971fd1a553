"""People as dolls: bodies of a height, mass and sex, and what holds them upright."""
from .person import person, standard
from .standing import standing

__all__ = ['person', 'standard', 'standing']

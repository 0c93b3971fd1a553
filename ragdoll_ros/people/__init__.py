"""People as dolls: bodies of a given height, mass and sex; standing; phases of their falls."""
from .person import person, standard
from .standing import standing

__all__ = ['person', 'standard', 'standing']

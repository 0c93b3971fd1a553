"""People as dolls: bodies of a height, mass and sex."""
from .person import person, standard

__all__ = ['person', 'standard']

"""Kept importable for those who draw skins: see model/skeleton.py."""
from .model.skeleton import Riders, rider_names

__all__ = ['Riders', 'rider_names']

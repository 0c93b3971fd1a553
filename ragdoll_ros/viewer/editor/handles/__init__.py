"""Handles in the picture for the selected bone: its pose, its size, and the ranges of its joint."""

"""Keyboard teleoperation of a node from a terminal."""

"""Dolls from URDF descriptions of robots, and shapes from their meshes."""

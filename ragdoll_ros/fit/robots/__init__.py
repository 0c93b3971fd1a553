"""Dolls of robots' URDFs and meshes."""

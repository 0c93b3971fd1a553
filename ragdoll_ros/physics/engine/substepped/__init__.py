"""Engines with equal substeps, PyBullet and MuJoCo, and what both share."""

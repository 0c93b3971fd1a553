"""Kinds of contacts. The number of a kind is that of its rows."""
from __future__ import annotations

LIMIT, FRICTIONAL, ROLLING = 1, 3, 5
"""A joint at a limit: one row. A contact point: its normal and two tangents. A contact point with
rolling friction: these and rolling about the two tangents."""

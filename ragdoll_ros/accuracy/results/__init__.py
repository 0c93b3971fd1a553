"""Figures of the report, what they are held to, and how they are run."""

"""Motions whose truth is known."""

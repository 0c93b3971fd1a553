"""Inertial sensors of a simulation."""

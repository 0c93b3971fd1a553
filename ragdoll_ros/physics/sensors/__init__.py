"""Sensors that read a simulation."""

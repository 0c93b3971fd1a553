"""Ragdolls fitted to rigged, skinned characters and to robots, with a report and a verdict."""

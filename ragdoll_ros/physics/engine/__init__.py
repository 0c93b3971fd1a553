"""Engines: what turns a scene into motion. One small protocol, one file for each engine."""

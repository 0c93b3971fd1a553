"""A character's file: its skin, skeleton and springs, in metres and REP 103's axes."""

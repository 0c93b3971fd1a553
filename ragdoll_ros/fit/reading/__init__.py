"""Reader of glTF and VRM characters: skin, skeleton and spring bones in m and REP 103 axes."""

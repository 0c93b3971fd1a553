"""How a scene moves; Simulation is its only door."""

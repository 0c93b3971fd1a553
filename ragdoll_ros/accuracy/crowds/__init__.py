"""Many dolls at once: cost, penetration, reproducibility."""

"""Many dolls at once: cost, depth, equal bits."""

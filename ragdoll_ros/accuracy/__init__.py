"""How wrong and how fast: cases with independent references, methods, metrics, a report."""

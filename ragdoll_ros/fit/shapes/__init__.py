"""Principal axes of point clusters, and collision shapes fitted to them."""

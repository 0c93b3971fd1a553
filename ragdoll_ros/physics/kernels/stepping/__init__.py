"""Where something touches: steps, impacts, and what both keep."""

"""Pushing on the page: which way, how hard, which bone, and its speed below the pointer."""

"""Gaps, contact points of whole patches, and the rows of contacts."""

"""Impulses of contacts and limits, by Newton's, Signorini's and Coulomb's laws."""

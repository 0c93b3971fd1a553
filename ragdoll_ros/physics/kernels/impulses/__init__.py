"""Impulses of contacts and limits, by Newton's, Signorini's and Coulomb's laws.

An island has m contacts, its members, and n rows. Impulses p (n,) give the rows the velocities u =
W p + b; W is flat, (n * n).
"""

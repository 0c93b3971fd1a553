"""Subscriptions that move the dolls, the interactive marker server, and counts of refusals."""

"""Impacts of bones on ~/impacts."""

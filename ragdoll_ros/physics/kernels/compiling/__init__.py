"""Compiling functions to machine code, and keeping it on disk for the next process."""

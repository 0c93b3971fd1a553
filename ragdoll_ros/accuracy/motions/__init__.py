"""Reference motions: trials with an exact solution."""

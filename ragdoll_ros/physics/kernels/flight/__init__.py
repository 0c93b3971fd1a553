"""Flight, where nothing touches: steps of order 8 up to the time of the next contact."""

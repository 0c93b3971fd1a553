"""Where nothing touches: steps of order 8 up to the located instant of the next touch."""

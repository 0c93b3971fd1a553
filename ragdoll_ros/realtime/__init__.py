"""Real time: the pacer of ticks, and arrow keys that are held."""

"""What the node does after a tick that ends in a bad state."""

"""Where two shapes touch, whatever bodies they are of."""

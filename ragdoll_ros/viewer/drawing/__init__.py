"""What the page draws of a scene."""

"""Selection of the bones that become bodies, and their kinematic tree."""

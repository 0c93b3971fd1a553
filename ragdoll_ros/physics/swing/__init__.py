"""Hair, tails and straps: cheap pendulums and springs that ride on bones."""

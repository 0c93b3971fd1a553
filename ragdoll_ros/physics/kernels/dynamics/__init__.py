"""How trees of bodies move in the air: kinematics, mass matrices, accelerations."""

"""Dynamics of kinematic trees without contacts: kinematics, mass matrices, accelerations."""

"""Inertial sensors: the parameter `imus` and the Imu publishers."""

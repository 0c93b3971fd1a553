"""Signals and the rclpy context of a process."""

"""Signals, the rclpy context and the executor of a process."""

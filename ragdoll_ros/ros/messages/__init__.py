"""Conversion of states to ROS messages, and serialized message templates."""

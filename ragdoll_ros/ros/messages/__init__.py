"""Arrays as ROS messages."""

"""A running node `ragdoll` as a source, over ROS 2."""

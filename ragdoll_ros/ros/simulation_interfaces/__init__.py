"""The services of the package simulation_interfaces, the standard of ROS 2 simulators."""

"""The ROS side: it converts, schedules and shows, and leaves the physics to the simulation."""
from .signals import hold_back

hold_back()

"""The ROS 2 side: nodes, publishers, subscriptions and messages. Physics is in the simulation."""
from .process.signals import block_signals

block_signals()

"""The ROS 2 side: nodes, publishers, subscriptions and messages around a simulation."""
from .process.signals import block_signals

block_signals()

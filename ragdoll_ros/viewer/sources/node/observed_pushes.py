"""Pushes that any publisher sends to a node, read from the same topics as the node does."""
from __future__ import annotations

from ....model.drive import Drive
from ....model.push import Push
from ....model.scene import Scene


class NoInputCounts:
    """Input counts for ros/inputs that count nothing: the node itself reports them."""

    def refuse(self, source: str, reason: object) -> None:
        """Do nothing."""

    def clamp(self, source: str, reason: object) -> None:
        """Do nothing."""


class ObservedPushes:
    """Takes the place of the node's simulation in ros/inputs/subscriptions.py."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.time = 0.0
        """Simulated time of the newest poses, s."""
        self._pushes: dict[str, tuple[float, Push]] = {}

    def push(self, push: Push | Drive, channel: str) -> None:
        """Start a push in place of the last one of its channel."""
        self._pushes[channel] = (self.time, push.at_rest if isinstance(push, Drive) else push)

    def release(self, channel: str) -> None:
        """End the push of a channel."""
        self._pushes.pop(channel, None)

    @property
    def pushes(self) -> tuple[Push, ...]:
        """Pushes that act now; a time before a push's start, after a reset, ends it."""
        return tuple(push for start, push in list(self._pushes.values())
                     if start <= self.time < start + push.duration)

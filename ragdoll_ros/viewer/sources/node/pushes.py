"""Pushes that a node is sent, by whomever: taken from the topics, as the node takes them."""
from __future__ import annotations

from ....model.drive import Drive
from ....model.push import Push
from ....model.scene import Scene


class Silent:
    """Stands for the node's InputCounts: what is refused or clamped, the node counts and tells."""

    def refuse(self, source: str, reason: object) -> None:
        """Say nothing."""

    def clamp(self, source: str, reason: object) -> None:
        """Say nothing."""


class HeardPushes:
    """Stands for the node's simulation as the target of ros/inputs/subscriptions.py."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.time = 0.0
        """s simulated, of the newest poses."""
        self._pushes: dict[str, tuple[float, Push]] = {}

    def push(self, push: Push | Drive, channel: str) -> None:
        """A push acts from now on in place of the last one of its channel."""
        self._pushes[channel] = (self.time, push.at_rest if isinstance(push, Drive) else push)

    def release(self, channel: str) -> None:
        """End the push of a channel."""
        self._pushes.pop(channel, None)

    @property
    def pushes(self) -> tuple[Push, ...]:
        """Pushes that act now; a time that went backwards is a reset and ends all."""
        return tuple(push for start, push in list(self._pushes.values())
                     if start <= self.time < start + push.duration)

"""Publishers of the inertial sensors (REP 145)."""
from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import Imu

from ...model.scene import Scene
from ...physics.sensors.imu import ImuMount, tick_samples
from ...physics.sensors.response import ImuResponse, ResponseFilter
from ..messages.convert import to_imu
from ..messages.serialized import SerializedTemplate
from .imu_parameters import imu_topic, parse_mount

if TYPE_CHECKING:
    from ...physics.simulation import Simulation
    from ..parameters.node_settings import NodeSettings

DEPTH = 100
"""Queue depth: the samples of a tick of 0.1 s at 1 kHz."""


class Sensor(NamedTuple):
    """A mounted sensor and its publisher; ``bone`` is an index."""

    publisher: Publisher
    mount: ImuMount
    bone: int
    template: SerializedTemplate
    response: ContinuousResponse


class ContinuousResponse:
    """The filter of a sensor. It restarts at a reset, and after ticks without a subscriber."""

    def __init__(self, response: ImuResponse) -> None:
        self._response = response
        self._end: tuple[int, int] | None = None

    def at(self, simulation: Simulation) -> ResponseFilter:
        """The filter for the samples of the last tick."""
        run, end = simulation.reset_count, simulation.time
        if self._end != (run, end - simulation.tick):
            self._filter = ResponseFilter(self._response)
        self._end = run, end
        return self._filter


class ImuPublishers:
    """Publishers of the sensors of the parameter ``imus``."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._sensors: dict[str, Sensor] = {}
        """By topic."""

    @property
    def has_subscribers(self) -> bool:
        """Whether a sensor has a subscriber."""
        return any(sensor.publisher.get_subscription_count() for sensor in self._sensors.values())

    def configure(self, scene: Scene, settings: NodeSettings) -> None:
        """Create the publishers of these settings and destroy the others."""
        self._flaws, self._seed = settings.imu_flaws, settings.imu_seed
        self._stamp_factor = 1.0 if settings.publish_clock else settings.real_time_factor
        publishers = {topic: sensor.publisher for topic, sensor in self._sensors.items()}
        self._sensors = {}
        for text in filter(str.strip, settings.imus):
            mount = parse_mount(text, scene.bone_names)
            topic = imu_topic(mount.bone)
            publisher = publishers.pop(topic, None) or self._node.create_publisher(
                Imu, topic, DEPTH)
            make = partial(to_imu, f'{mount.bone}_imu', self._flaws)
            self._sensors[topic] = Sensor(publisher, mount, scene.bone_index(mount.bone),
                                          SerializedTemplate.trace(make, (3,), (3,)),
                                          ContinuousResponse(settings.imu_response))
        for publisher in publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, simulation: Simulation, stamp: int) -> None:
        """Publish the samples of the last tick, which ends at ``stamp``, ns, where subscribed."""
        for index, sensor in enumerate(self._sensors.values()):
            publisher, mount, bone, template, response = sensor
            if not publisher.get_subscription_count():
                continue
            exact = tick_samples(simulation.substates, bone, mount, simulation.step,
                                 simulation.scene.gravity, response.at(simulation))
            samples = self._flaws(exact, _noise(self._seed, index, simulation.time))
            spacing = simulation.tick / len(samples) / self._stamp_factor
            for number, sample in enumerate(samples, 1 - len(samples)):
                publisher.publish(template.serialize(stamp + round(number * spacing), sample[3:],
                                                     sample[:3]))


def _noise(seed: int, sensor: int, time: int) -> np.random.Generator:
    """Random generator of a sensor's noise in the tick that ends at ``time``, ns."""
    return np.random.Generator(np.random.Philox(key=[seed, sensor], counter=[0, 0, 0, time]))

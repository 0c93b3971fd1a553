"""Worn inertial sensors: which there are, and their samples as messages (REP 145)."""
from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import Imu

from ..model.scene import Scene
from ..physics.sensors.imu import tick_samples
from .imu_parameters import mount_of, sensor_topic
from .messages.convert import to_imu
from .messages.serialized import Packed

if TYPE_CHECKING:
    from ..physics.simulation import Simulation
    from .parameters import Settings

QUEUE = 100
"""Samples that wait for who listens: a tick of 0.1 s of a sensor of 1 kHz."""


class Imus:
    """Publishers of all sensors that the settings name, and what each reads."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._worn: dict[str, tuple] = {}
        """Of each topic its publisher, the sensor, its bone's place, its messages' layout."""

    @property
    def heard(self) -> bool:
        """Whether somebody listens."""
        return any(worn[0].get_subscription_count() for worn in self._worn.values())

    def use(self, scene: Scene, settings: Settings) -> None:
        """Offer the topics of these settings and no others."""
        self._flaws, self._seed = settings.imu_flaws, settings.imu_seed
        self._pace = 1.0 if settings.publish_clock else settings.real_time_factor
        publishers = {topic: worn[0] for topic, worn in self._worn.items()}
        self._worn = {}
        for text in filter(str.strip, settings.imus):
            mount = mount_of(text, scene.bone_names)
            topic = sensor_topic(mount.bone)
            publisher = publishers.pop(topic, None) or self._node.create_publisher(
                Imu, topic, QUEUE)
            self._worn[topic] = (publisher, mount, scene.bone_index(mount.bone),
                                 Packed(partial(to_imu, f'{mount.bone}_imu', self._flaws),
                                        (3,), (3,)))
        for publisher in publishers.values():
            self._node.destroy_publisher(publisher)

    def publish(self, simulation: Simulation, stamp: int) -> None:
        """Publish the samples of the last tick, which ends at a stamp, ns, where one is heard."""
        for index, (publisher, mount, bone, layout) in enumerate(self._worn.values()):
            if not publisher.get_subscription_count():
                continue
            true = tick_samples(simulation.substates, bone, mount, simulation.step,
                                simulation.scene.gravity)
            samples = self._flaws(true, _random(self._seed, index, simulation.time))
            apart = simulation.tick / len(samples) / self._pace
            for number, sample in enumerate(samples, 1 - len(samples)):
                publisher.publish(layout.message(stamp + round(number * apart), sample[3:],
                                                 sample[:3]))


def _random(seed: int, sensor: int, time: int) -> np.random.Generator:
    """Noise of a sensor in the tick that ends at a time, ns: the same whoever listened before."""
    return np.random.Generator(np.random.Philox(key=[seed, sensor], counter=[0, 0, 0, time]))

"""Draw docs/ponytail.png: the ponytail during the default fall. Needs matplotlib.

python docs/ponytail.py [picture.png]
"""
from __future__ import annotations

import itertools
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial import ConvexHull

from ragdoll_ros.files.scene import load_scene
from ragdoll_ros.model import rotation
from ragdoll_ros.model.scene import SECOND
from ragdoll_ros.physics.simulation import Simulation

TIMES = (0.0, 0.28, 0.32, 0.36, 0.42, 0.50, 0.60, 0.75, 0.90, 3.00)
"""Times of the pictures, s; each also shows the motion of the tail in the 0.12 s before."""
WAY = 12
"""Ticks of that motion."""
CAMERA = np.array([-1.0, -0.9, 0.3])
"""Direction from the doll to the camera, world frame; the projection is orthographic."""


def screen(points: np.ndarray) -> np.ndarray:
    """Points (..., 3) m from the world frame to right, up and towards the camera."""
    toward = CAMERA / np.linalg.norm(CAMERA)
    right = np.cross([0, 0, 1], toward)
    right /= np.linalg.norm(right)
    return points @ np.stack([right, np.cross(toward, right), toward], axis=1)


def outline(half_extents: np.ndarray, round_: bool) -> np.ndarray:
    """Points of a shape's surface, own frame, m: a box's corners or a ball's points."""
    if not round_:
        return np.array(list(itertools.product((-1, 1), repeat=3))) * half_extents
    directions = np.random.default_rng(0).normal(size=(400, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True) * half_extents


def draw(axes: plt.Axes, simulation: Simulation, way: list[np.ndarray]) -> None:
    """Draw the doll as outlines from back to front, the tail as a line, its motion fading."""
    state, swings = simulation.state, simulation.swings
    for bone, place, turn in zip(simulation.scene.bones, state.positions, state.orientations,
                                 strict=True):
        surface = outline(np.array(bone.shape.half_extents), bone.shape.kind == 'sphere')
        points = screen(place + rotation.rotate(turn, surface))
        hull = points[ConvexHull(points[:, :2]).vertices]
        axes.fill(hull[:, 0], hull[:, 1], facecolor=bone.color, edgecolor='0.25', linewidth=0.6,
                  zorder=10 + screen(place)[2])
    for age, chain in enumerate(reversed(way), start=1):
        line = screen(chain)
        axes.plot(line[:, 0], line[:, 1], color='#b5651d', alpha=0.6 * 0.85 ** age, linewidth=1,
                  zorder=9)
    for begin, end in zip(swings.roots, swings.positions, strict=True):
        line = screen(np.array([begin, end]))
        axes.plot(line[:, 0], line[:, 1], color='#4a2a10', linewidth=3, solid_capstyle='round',
                  zorder=10 + line[:, 2].mean())
    axes.axhspan(-2, 0, color='0.9', zorder=0)
    axes.set(xlim=(-0.75, 0.75), ylim=(-0.15, 1.65), aspect='equal', xticks=[], yticks=[],
             title=f't = {simulation.time / SECOND:.2f} s')


def main(path: Path) -> None:
    """Simulate the fall and draw it at TIMES."""
    figure, panels = plt.subplots(2, len(TIMES) // 2, figsize=(13, 6.8), layout='tight')
    way: list[np.ndarray] = []
    with Simulation(load_scene('ponytail')) as simulation:
        for time, axes in zip(TIMES, panels.flat, strict=True):
            while simulation.time < round(time * SECOND):
                tail = simulation.swings
                way = [*way[-WAY:], np.vstack([tail.roots[:1], tail.positions])]
                simulation.advance()
            draw(axes, simulation, way)
    figure.savefig(path, dpi=80)


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name('ponytail.png'))

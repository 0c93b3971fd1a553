"""Draws docs/fall.png: the default scene at six instants, by PyBullet's TinyRenderer.

python docs/fall.py
"""
from pathlib import Path

import numpy as np
from matplotlib.image import imsave

from ragdoll_ros.push import Push
from ragdoll_ros.scene_file import load_scene
from ragdoll_ros.simulation import Simulation

INSTANTS = (0.0, 0.28, 0.5, 0.7, 1.0, 3.0)
SIZE = (320, 480)


def main() -> None:
    """Let the doll fall with a push from behind, and put the pictures side by side."""
    views = []
    with Simulation(load_scene('drop')) as simulation:
        simulation.push(Push('torso', force=(350, 120, 0), duration=0.2))
        for instant in INSTANTS:
            while simulation.time < instant * 1e9:
                simulation.advance()
            x, y, _ = simulation.state.positions.mean(axis=0)
            target = np.array((x, y, 0.75))
            views.append(simulation.render(np.add(target, (3.2, -1.6, 0.9)), target, *SIZE))
    imsave(Path(__file__).with_name('fall.png'), np.concatenate(views, axis=1))


if __name__ == '__main__':
    main()

"""The ground with its shadows, and the light."""
from __future__ import annotations

import numpy as np
import viser

from ...model import rotation
from ...model.scene import Scene
from .bodies import WXYZ


def show_ground(server: viser.ViserServer, scene: Scene) -> None:
    """Draw the plane as a grid of 1 m that takes shadows; no ground, none drawn."""
    if scene.ground is None:
        return
    normal = np.array(scene.ground.normal)
    orientation = rotation.shortest_arc(np.array([0.0, 0.0, 1.0]), normal)
    server.scene.add_grid(
        '/scene/ground', infinite_grid=True, cell_size=0.25, section_size=1.0,
        cell_color=(205, 208, 212), section_color=(170, 174, 180), fade_distance=30.0,
        plane_color=(236, 238, 240), plane_opacity=1.0, shadow_opacity=0.35,
        wxyz=orientation[WXYZ], position=normal * scene.ground.offset)


def light(server: viser.ViserServer) -> None:
    """Switch on viser's own lights, which follow the scene, with shadows."""
    server.scene.configure_default_lights(enabled=True, cast_shadow=True)
    server.scene.configure_environment_map('city', environment_intensity=0.4)

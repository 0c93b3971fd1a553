"""The ground with its shadows, and the light."""
from __future__ import annotations

import numpy as np
import viser

from ...model import rotation
from ...model.scene import Scene
from .bodies import WXYZ

LIGHT = {'cell_color': (205, 208, 212), 'section_color': (170, 174, 180),
         'plane_color': (236, 238, 240), 'shadow_opacity': 0.35}
DARK = {'cell_color': (52, 55, 60), 'section_color': (84, 88, 95),
        'plane_color': (34, 36, 40), 'shadow_opacity': 0.6}
"""Colours, and how dark a shadow makes what is below it."""

FADE = 20.0
"""m from the eye at which the grid is gone: beyond, its lines are closer than a picture's dots."""


def show_ground(server: viser.ViserServer, scene: Scene, dark: bool) -> None:
    """Draw the plane as a grid of 1 m that takes shadows; no ground, none drawn."""
    if scene.ground is None:
        return
    normal = np.array(scene.ground.normal)
    orientation = rotation.shortest_arc(np.array([0.0, 0.0, 1.0]), normal)
    server.scene.add_grid(
        '/scene/ground', infinite_grid=True, cell_size=0.25, section_size=1.0,
        fade_distance=FADE, plane_opacity=1.0, **(DARK if dark else LIGHT),
        wxyz=orientation[WXYZ], position=normal * scene.ground.offset)


def light(server: viser.ViserServer) -> None:
    """Switch on viser's own lights, which follow the scene, with shadows."""
    server.scene.configure_default_lights(enabled=True, cast_shadow=True)
    server.scene.configure_environment_map('city', environment_intensity=0.4)

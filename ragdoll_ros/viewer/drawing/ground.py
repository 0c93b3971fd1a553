"""The ground with its shadows, and the light."""
from __future__ import annotations

import math

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

CELL, FADE = 0.25, 20.0
"""m: between two lines of the grid; from the eye to where it is gone, as beyond, lines are closer
than a picture's dots. At least so far: what is wide is seen from further away."""

COARSER = 4
"""Cells of which a thicker line goes around so many, which in a wide scene are the cells."""


def grid(scene: Scene) -> tuple[float, float]:
    """Cell and reach of the grid, m: all dolls stand on it, seen from where all are seen.

    It reaches 2.5 times the diagonal of the box about where they are placed, and at most 160 cells.
    """
    places = np.array([placement.position for placement in scene.dolls])
    reach = max(FADE, 2.5 * float(np.linalg.norm(np.ptp(places, axis=0))))
    coarser = max(0, math.ceil(math.log(reach / (160 * CELL), COARSER)))
    return CELL * COARSER**coarser, reach


def show_ground(server: viser.ViserServer, scene: Scene, dark: bool) -> None:
    """Draw the plane as a grid that takes shadows; no ground, none drawn."""
    if scene.ground is None:
        return
    normal = np.array(scene.ground.normal)
    orientation = rotation.shortest_arc(np.array([0.0, 0.0, 1.0]), normal)
    cell, reach = grid(scene)
    server.scene.add_grid(
        '/scene/ground', infinite_grid=True, cell_size=cell, section_size=COARSER * cell,
        fade_distance=reach, plane_opacity=1.0, **(DARK if dark else LIGHT),
        wxyz=orientation[WXYZ], position=normal * scene.ground.offset)


def light(server: viser.ViserServer) -> None:
    """Switch on viser's own lights, which follow the scene, with shadows."""
    server.scene.configure_default_lights(enabled=True, cast_shadow=True)
    server.scene.configure_environment_map('city', environment_intensity=0.4)

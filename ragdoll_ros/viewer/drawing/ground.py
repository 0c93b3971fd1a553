"""The ground with its shadows, and the lights."""
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
"""Colours, and opacity of shadows."""

CELL, FADE = 0.25, 20.0
"""m: cell size; distance from the camera at which the grid has faded out, because lines farther
away are closer than pixels. Both are smallest values: a wide scene is seen from farther away."""

COARSER = 4
"""Cells per section; in a wide scene sections become cells, one level or more up."""


def grid_size(scene: Scene) -> tuple[float, float]:
    """Cell size and fade distance of a grid that is visible below all dolls in the home view, m.

    It fades at 2.5 times the diagonal of the box around all placements, after at most 160 cells.
    """
    places = np.array([placement.position for placement in scene.dolls])
    fade = max(FADE, 2.5 * float(np.linalg.norm(np.ptp(places, axis=0))))
    levels = max(0, math.ceil(math.log(fade / (160 * CELL), COARSER)))
    return CELL * COARSER**levels, fade


def draw_ground(server: viser.ViserServer, scene: Scene, dark: bool) -> None:
    """Draw the ground, if any, as a grid that receives shadows."""
    if scene.ground is None:
        return
    normal = np.array(scene.ground.normal)
    orientation = rotation.shortest_arc(np.array([0.0, 0.0, 1.0]), normal)
    cell, fade = grid_size(scene)
    server.scene.add_grid(
        '/scene/ground', infinite_grid=True, cell_size=cell, section_size=COARSER * cell,
        fade_distance=fade, plane_opacity=1.0, **(DARK if dark else LIGHT),
        wxyz=orientation[WXYZ], position=normal * scene.ground.offset)


def configure_lights(server: viser.ViserServer) -> None:
    """Switch on viser's default lights, with shadows."""
    server.scene.configure_default_lights(enabled=True, cast_shadow=True)
    server.scene.configure_environment_map('city', environment_intensity=0.4)

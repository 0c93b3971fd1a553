"""All that is drawn of one scene, with its ground and lights."""
from __future__ import annotations

import math

import numpy as np
import viser

from ...model import rotation
from ...model.compound import Compound
from ...model.mesh import Hull
from ...model.plane import Plane
from ...model.scene import Scene
from ...model.static_body import DEFAULT_COLOR
from ..sources.source import Frame
from .bodies import WXYZ, Bodies, linear
from .joint_limits import JointLimits
from .meshes import MESHES, box
from .overlays import Overlays
from .skin_meshes import SkinMeshes

LIGHT = {'cell_color': (222, 225, 229), 'section_color': (204, 208, 214),
         'plane_color': (240, 241, 243), 'shadow_opacity': 0.3}
DARK = {'cell_color': (70, 74, 82), 'section_color': (88, 93, 102),
        'plane_color': (34, 36, 40), 'shadow_opacity': 0.6}
"""Colours, and opacity of shadows."""

CELL, FADE = 0.5, 20.0
"""m: cell size; distance from the camera at which the grid has faded out, because lines farther
away are closer than pixels. Both are smallest values: a wide scene is seen from farther away."""

KEY, RIM = (2.0, -2.4, 3.6), (-2.2, 1.6, 1.4)
"""Where the light comes from, and the one from behind that lets edges stand out from the ground;
any length. Seen from the home view the first one is at the left, so shadows lie at the right."""

FLAT = MESHES | {'box': box()}
"""Meshes of static bodies: walls and stairs have sharp edges."""

COARSER = 4
"""Cells per section; in a wide scene sections become cells, one level or more up."""


class Stage:
    """Draws one scene, in place of the stage before."""

    def __init__(self, server: viser.ViserServer, frame: Frame) -> None:
        self.scene = frame.scene
        server.scene.remove_by_name('/scene')
        self._server, self._dark = server, False
        draw_ground(server, self.scene, dark=False)
        draw_static_bodies(server, self.scene)
        self.skins = SkinMeshes(server, self.scene)
        self.bodies = Bodies(server, self.scene, frame.state, self.skins.skinned)
        self._overlays = Overlays(server)
        self._limits = JointLimits(server, self.scene)
        self._shows_rods_in_skins = False

    def show(self, frame: Frame) -> None:
        """Draw a frame of the scene."""
        self.bodies.show(frame.state)
        self.skins.show(frame.state, frame.rods)
        rods = frame.rods
        if rods is not None and not self._shows_rods_in_skins:
            rods = np.delete(rods, self.skins.links, axis=0)
        self._overlays.show(frame, rods)
        self._limits.show(frame.state, frame.angles)

    def set_dark(self, dark: bool) -> None:
        """Draw the ground for a dark page or a light one."""
        if dark != self._dark:
            self._dark = dark
            draw_ground(self._server, self.scene, dark)

    def set_visible(self, bones: bool, skins: bool) -> None:
        """Show or hide bones and skins; bones are shown at least where skins are hidden.

        So are the rods of swings that move a skin.
        """
        self._shows_rods_in_skins = bones or not skins
        self.bodies.set_visible(bones or not skins, translucent=skins)
        self.skins.set_visible(skins)


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


def draw_static_bodies(server: viser.ViserServer, scene: Scene) -> None:
    """Draw the static bodies: all primitives of one kind in one batch, and the hulls of a body, a
    surface or a plane in a mesh each.
    """
    parts = [(part, body.color or DEFAULT_COLOR)
             for body in scene.bodies for part in body.primitives]
    for kind in MESHES:
        chosen = [(part, color[:3]) for part, color in parts if part.kind == kind]
        if chosen:
            own, colors = zip(*chosen, strict=True)
            server.scene.add_batched_meshes_simple(
                f'/scene/static/{kind}', *FLAT[kind],
                np.array([part.orientation for part in own])[:, WXYZ],
                np.array([part.position for part in own]),
                batched_scales=np.array([part.size for part in own]),
                batched_colors=np.round(linear(np.array(colors)) * 255).astype(np.uint8),
                lod='off')
    for index, body in enumerate(scene.bodies):
        hulls = tuple(part for part in body.shape.primitives if isinstance(part.shape, Hull))
        if hulls:
            vertices, faces = Compound(hulls).mesh()
            server.scene.add_mesh_simple(
                f'/scene/static/hulls_{index}', vertices.astype(np.float32),
                faces.astype(np.uint32), color=(body.color or DEFAULT_COLOR)[:3],
                flat_shading=True, wxyz=np.array(body.orientation)[WXYZ], position=body.position)
        if not body.shape.primitives:
            red, green, blue = (body.color or DEFAULT_COLOR)[:3]
            vertices, faces = body.shape.mesh()
            is_plane = isinstance(body.shape, Plane)
            # A plane hides nothing from below, and nothing is behind it to be in its shadow.
            server.scene.add_mesh_simple(
                f'/scene/static/surface_{index}', vertices.astype(np.float32),
                faces.astype(np.uint32), color=(red, green, blue), flat_shading=True,
                side='front' if is_plane else 'double', cast_shadow=not is_plane,
                wxyz=np.array(body.orientation)[WXYZ], position=body.position)


def configure_lights(server: viser.ViserServer) -> None:
    """Add a main light with shadows, one from behind, and the light of sky and ground.

    They replace viser's lights, which shine from above and leave the front dark, and its
    reflections of a city, which cost every page 0.2 MB and, without a GPU, 8 s.
    """
    scene = server.scene
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere('/lights/sky', position=(0.0, 0.0, 1.0), intensity=2.2,
                               sky_color=(255, 255, 255), ground_color=(196, 192, 188))
    scene.add_light_directional('/lights/key', position=KEY, intensity=3.2, cast_shadow=True,
                                color=(255, 250, 244))
    scene.add_light_directional('/lights/rim', position=RIM, intensity=1.2,
                                color=(235, 242, 255))

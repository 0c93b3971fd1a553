"""Generalised coordinates of dolls as a scene places them."""
from collections.abc import Sequence

import numpy as np

from .dof_layout import DofLayout as DofLayout
from .dof_layout import GeneralizedState as GeneralizedState
from .scene import Placement
from .scene_change import SceneChange


def placed_coordinates(placements: Sequence[Placement],
                       layout: DofLayout | None = None) -> GeneralizedState:
    """Coordinates and velocities of dolls as they are placed, at which a simulation starts.
    ``layout`` is that of the dolls; None: it is computed.
    """
    layout = layout or DofLayout([placement.doll for placement in placements])
    q, v = np.zeros(layout.sizes[0]), np.zeros(layout.sizes[1])
    for index, placement in enumerate(placements):
        placement = placement.start
        pose, velocity = placement.root_motion
        q[layout.root_positions[index]] = pose.position
        q[layout.root_orientations[index]] = pose.orientation
        v[layout.root_velocities[index]] = velocity
        v[layout.root_angular_velocities[index]] = placement.spin
    angles, rates = (np.array([
        getattr(placement.start, key).get(name, 0.0) for placement in placements
        for joint in placement.doll.joints for name in joint.angle_names])
        for key in ('angles', 'rates'))
    state = GeneralizedState(layout.with_joint_angles(q, angles), v)
    return GeneralizedState(state.q, layout.with_joint_rates(state, rates))


def changed_coordinates(coordinates: GeneralizedState, change: SceneChange) -> GeneralizedState:
    """Coordinates and velocities of the dolls after a change. Dolls that stay keep those in
    ``coordinates``, which are of the scene before; new dolls start as they are placed.
    """
    before, after = (DofLayout([placement.doll for placement in scene.dolls])
                     for scene in (change.before, change.after))
    placed = placed_coordinates(change.after.dolls)
    for doll, old in enumerate(change.old_dolls):
        if old >= 0:
            placed.q[after.doll_q[doll]] = coordinates.q[before.doll_q[old]]
            placed.v[after.doll_v[doll]] = coordinates.v[before.doll_v[old]]
    return placed

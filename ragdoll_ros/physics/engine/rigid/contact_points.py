"""Contacts of clusters' last steps as points between bones of the scene, with their wrenches."""
import numpy as np

from ...kernels.contact_kind import LIMIT
from ...rigid_body import cross
from ..protocol import GROUND


def contact_points(contacts: np.ndarray, bone_of_body: np.ndarray, first: np.ndarray,
                   static: np.ndarray,
                   dt: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contacts that are no joint limits, with what touches and lengths of steps as
    Clusters.contacts() returns them.

    Bodies of a contact count from ``first`` (c,) in ``bone_of_body``, the bones of the scene;
    ``static`` (c,): static bodies, or GROUND; ``dt`` (c,): lengths of steps, s.
    """
    found = np.flatnonzero(contacts['kind'] != LIMIT)
    # take: an index in brackets copies such wide records field by field
    contacts, dt = contacts.take(found), dt[found]
    touching = bone_pairs(contacts, bone_of_body, first[found], static[found])
    return contacts, touching, np.where(dt > 0, dt, 1.0)


def bone_pairs(records: np.ndarray, bone_of_body: np.ndarray, first: np.ndarray,
               static: np.ndarray) -> np.ndarray:
    """What touches in each of the CONTACTs or IMPACTs (c,): (c, 3), as Clusters.contacts() returns
    it.
    """
    a, other = bone_of_body[first + records['body_a']], records['body_b']
    b = np.where(other < 0, GROUND, bone_of_body[first + other])
    return np.stack([a, b, static], 1)


def contact_wrenches(contacts: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """Wrenches (c, 6) on the first bone of each CONTACT, by its impulse over its step of ``dt`` s:
    force, N, and torque about its point, N m, world frame.
    """
    impulse = contacts['impulse'] / dt[:, None]
    friction = np.einsum('ck,ckx->cx', impulse[:, 1:3], contacts['tangents'])
    torque = cross(contacts['friction_point'] - contacts['point'], friction)
    torque += np.einsum('ck,ckx->cx', impulse[:, 3:], contacts['tangents'])
    return np.concatenate([impulse[:, :1] * contacts['normal'] + friction, torque], axis=1)

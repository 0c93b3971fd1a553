"""One of each kind of shape: a new kind is added here, and every test of shapes has it."""
from ragdoll_ros.model.compound import Compound
from ragdoll_ros.model.mesh import Hull
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Part, Sphere

HEAD, HANDLE = Capsule(0.05, 0.2), Box((0.04, 0.06, 0.3))
ARM = 0.2 / (HEAD.volume + HANDLE.volume)
HAMMER = Compound((Part(HEAD, (0, 0, ARM * HANDLE.volume), (0, 1, 0, 1)),
                   Part(HANDLE, (0, 0, -ARM * HEAD.volume))))
"""The head lies along x on top of the handle, 0.2 m from the middle of one to that of the other."""

OCTAHEDRON = Compound((Part(Hull(
    [(0.1, 0, 0), (-0.1, 0, 0), (0, 0.2, 0), (0, -0.2, 0), (0, 0, 0.3), (0, 0, -0.3)],
    [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]),
    (0, 0, 0), (0.0, 0.0, 1.0, 0.0)),))
"""A hull: of the engine rigid alone."""

SPECIMENS = {shape.kind: shape for shape in (
    Sphere(0.2), Box((0.1, 0.2, 0.4)), Cylinder(0.1, 0.5), Capsule(0.1, 0.3), HAMMER)}
"""Every kind of shape in every place that must know it: files, engines, kernels, editor, page."""

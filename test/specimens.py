"""One of each kind of shape: a new kind is added here, and every test of shapes has it."""
from ragdoll_ros.model.shapes import Box, Capsule, Cylinder, Sphere

SPECIMENS = {shape.kind: shape for shape in (
    Sphere(0.2), Box((0.1, 0.2, 0.4)), Cylinder(0.1, 0.5), Capsule(0.1, 0.3))}

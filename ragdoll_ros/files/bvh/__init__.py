"""BVH files of motion capture: the skeleton, the joints of a doll's bodies, the doll's motion."""

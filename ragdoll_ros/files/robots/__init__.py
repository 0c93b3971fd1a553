"""Files of robots and worlds: URDF and SDF, and the meshes that they name."""

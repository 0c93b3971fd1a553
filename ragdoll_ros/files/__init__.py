"""Files of the model: YAML with JSON schemas, URDF, MJCF; messages of bags."""

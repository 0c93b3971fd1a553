"""Files of the model: YAML with JSON schemas, URDF, MJCF; recorded bags."""

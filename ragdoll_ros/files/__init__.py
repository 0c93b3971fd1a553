"""The model as text and back: YAML with its schema, URDF, MJCF."""

"""People as REP 155 (draft) publishes them: tracked bodies with their joints, URDF and frame."""

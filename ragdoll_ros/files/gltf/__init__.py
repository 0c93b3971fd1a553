"""glTF 2.0 files: container, nodes, bind poses, animations."""

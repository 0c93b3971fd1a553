"""The parameters of the node: declaration, validation, callbacks."""

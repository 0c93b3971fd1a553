"""What of a scene touches: gaps, contacts with whole patches, and their rows."""

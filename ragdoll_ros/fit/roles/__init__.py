"""Whether a skeleton is a person's."""

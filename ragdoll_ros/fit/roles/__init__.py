"""What bones are, by their names, and whether all of them are a person's."""

"""Form fields of the panels, and the parsing of typed values."""

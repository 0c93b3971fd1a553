"""Files of falls, one format each."""

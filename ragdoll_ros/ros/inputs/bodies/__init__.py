"""What moves driven bodies and robots: their topics, and frames of /tf."""

"""The shipped scenes as cards: picture, sentence and cost on this machine."""

"""References independent of all engines: closed forms and high-order integration."""

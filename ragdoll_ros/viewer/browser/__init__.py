"""What runs in the browser: scripts, style sheets and the events that they send."""

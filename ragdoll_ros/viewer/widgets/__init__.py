"""Fields of the page's panels, and how they read what is typed."""

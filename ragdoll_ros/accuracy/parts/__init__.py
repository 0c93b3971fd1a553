"""Parts of the report: each defines jobs, whose rows go into the JSON under its NAME."""

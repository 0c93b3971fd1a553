"""Results of the report: jobs that produce them, JSON, acceptance criteria, Markdown."""

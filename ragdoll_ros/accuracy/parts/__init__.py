"""Parts of the report: each names its jobs; what they find goes into the JSON as rows."""

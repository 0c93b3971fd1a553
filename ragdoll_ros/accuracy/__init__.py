"""The accuracy report: trials with independent references, methods, metrics, plots and pages."""

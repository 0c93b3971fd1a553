"""The report's pages, plots and command."""

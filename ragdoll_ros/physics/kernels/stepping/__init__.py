"""Steps with contacts, impacts, and what both conserve."""

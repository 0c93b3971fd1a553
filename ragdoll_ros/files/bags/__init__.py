"""Messages of recorded bags: MCAP and SQLite storage, and their CDR encoding."""

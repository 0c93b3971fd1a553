"""Truth that owes nothing to any engine: closed forms and high-order integration."""

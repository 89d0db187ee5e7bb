"""Pure physics and device tables."""

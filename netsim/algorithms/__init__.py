"""The algorithms that nodes run, by name."""

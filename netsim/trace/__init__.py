"""The vocabulary of events, and how a run is recorded."""

"""From a trace to Rerun."""

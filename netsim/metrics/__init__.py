"""Figures computed from the event stream."""

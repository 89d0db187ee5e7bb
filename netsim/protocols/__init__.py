"""Reusable conversations over a node handle."""

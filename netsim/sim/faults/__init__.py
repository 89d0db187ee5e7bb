"""Faults as rules of the scenario, outside the code that they befall."""

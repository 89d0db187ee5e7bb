"""The simulation proper: the only package that imports SimPy."""

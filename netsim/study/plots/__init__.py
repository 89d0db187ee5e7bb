"""The plots of a study's report; every figure is an object of its own, nothing of matplotlib's global state is changed."""

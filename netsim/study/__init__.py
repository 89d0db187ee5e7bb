"""Studies: a scenario with sweeps, repetitions and a question; run, tabulated, compared and reported."""

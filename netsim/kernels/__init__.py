"""Pure mathematics: arrays in, arrays out; no simulation, no files, no clock, no stored random state."""

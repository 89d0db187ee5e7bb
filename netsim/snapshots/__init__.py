"""Snapshots of a track: what the network believes of a target at some instants, and who leads.

After Liu, Reich, Zhao 2002, Fig. 8. `load` reads a trace, `moment` says how things stand at an instant, `panel` draws it,
`picture` puts panels and the error over time together.
"""

"""Information flow in a graphical model: who sends to whom in which round, who falls silent, who wakes whom.

After Chen, Wainwright, Cetin, Willsky 2006, Figs. 10 and 13. `rounds` counts, `load` reads a trace, `layout` finds a place
for every vertex, `picture` draws one panel a round.
"""

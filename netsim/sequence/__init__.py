"""Sequence charts: who sent what to whom in a window of a trace, and which reception led to which sending.

One life line a node, time downwards. `gather` reads the window of a trace, `scale` says where instants lie, `arrows`,
`lifelines`, `links` and `frame` draw the parts, `chart` puts them together as SVG, `page` as an HTML page that stands alone.
"""

from netsim.sequence.gather import Asked
from netsim.sequence.write import ENDINGS, write_chart

__all__ = ["ENDINGS", "Asked", "write_chart"]

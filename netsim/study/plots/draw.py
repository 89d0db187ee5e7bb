"""All plots of a report, by topic."""

from collections.abc import Callable, Iterator, Mapping

import matplotlib as mpl

from netsim.study.plots.style import RC, Plot
from netsim.study.plots.tradeoff import tradeoff_plots
from netsim.study.reporting.view import View

TOPICS: Mapping[str, Callable[[View], Iterator[Plot]]] = {
    "tradeoff": tradeoff_plots,
}


def draw(view: View) -> dict[str, list[Plot]]:
    """The plots that the results are good for, by topic."""
    if not view.variants:
        return {}
    with mpl.rc_context(dict(RC)):
        return {topic: list(make(view)) for topic, make in TOPICS.items()}

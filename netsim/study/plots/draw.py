"""All plots of a report, by topic."""

from collections.abc import Callable, Iterator, Mapping

from netsim.study.plots.bars import energy_plots
from netsim.study.plots.distribution import distribution_plots
from netsim.study.plots.forest import difference_plots, lifetime_plots, published_plots
from netsim.study.plots.nodes import node_plots
from netsim.study.plots.style import Plot, settle, styled
from netsim.study.plots.tradeoff import tradeoff_plots
from netsim.study.plots.trend import trend_plots
from netsim.study.reporting.view import View

TOPICS: Mapping[str, Callable[[View], Iterator[Plot]]] = {
    "tradeoff": tradeoff_plots,
    "differences": difference_plots,
    "trend": trend_plots,
    "distribution": distribution_plots,
    "published": published_plots,
    "energy": energy_plots,
    "nodes": node_plots,
    "lifetime": lifetime_plots,
}


def draw(view: View) -> dict[str, list[Plot]]:
    """The plots that the results are good for, by topic."""
    if not view.variants:
        return {}
    with styled():
        plots = {topic: list(make(view)) for topic, make in TOPICS.items()}
        for found in plots.values():
            for plot in found:
                settle(plot.figure)
        return plots

"""The Grenoble testbed in whole simulations: what arrives on each link is what was measured there, by chance alone."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from netsim.models.delivery import Rounds, rounds_of
from netsim.models.k7 import read_k7
from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.trace.events import OUTCOMES, Frame

SCENARIO = """\
kind: scenario
schema_version: 1
name: grenoble
duration_s: {duration_s}
field: {{width_m: 60, height_m: 30}}
nodes:
  - name: sensors
    placement: {{type: grid, rows: 5, columns: 10, spacing_m: 5}}
    battery: {{type: mains}}
medium: {{type: trace, file: grenoble.k7.gz, format: k7, channel: 20, reception: {reception}}}
mac: {{type: csma}}
network: {{type: one-hop}}
algorithm: {{type: neighbour-traffic, period_s: 10, payload_byte: 60, rounds: {rounds}}}
"""
ARRIVED = {"received", "overheard"}
LOST_ON_THE_LINK = {"sinr": {"weak"}, "prr": {"lost"}}
"""Outcomes that the link itself is to blame for: not interference, and not a receiver that was busy or sending."""


class Links:
    """Counts each link's frames and those that arrived."""

    def __init__(self, lost: set[str]) -> None:
        self._lost = lost
        self.sent: Counter[tuple[int, int]] = Counter()
        self.arrived: Counter[tuple[int, int]] = Counter()

    def handlers(self) -> dict[type, Callable[[Frame, int], None]]:
        """Frames only."""
        return {Frame: self._count}

    def _count(self, event: Frame, _: int) -> None:
        for node, code in zip(event.rx_node, event.rx_outcome, strict=True):
            pair, outcome = (event.source, int(node)), OUTCOMES[code]
            self.sent[pair] += outcome in ARRIVED | self._lost
            self.arrived[pair] += outcome in ARRIVED


def ratio_of(rounds: dict[int, Rounds], pair: tuple[int, int]) -> float:
    """What was measured in the first round, which holds throughout these runs (the next one begins 2.5 hours later)."""
    place = int(np.searchsorted(rounds[pair[0]].listeners, pair[1]))
    return float(rounds[pair[0]].ratio[0, place])


@pytest.mark.parametrize("reception", ["sinr", "prr"])
def test_frames_arrive_at_the_measured_ratios(tmp_path: Path, measured_data: Path, reception: str) -> None:
    """Every link of channel 20: perfect ones lose nothing, mute ones deliver nothing, the others lie in the interval.

    Each interval's level is 1 - 1 % over the number of links with ratios between 0 and 1, so the whole is one test at 99 %.
    """
    (tmp_path / "grenoble.k7.gz").symlink_to(measured_data / "grenoble.k7.gz")
    path = tmp_path / "grenoble.yaml"
    path.write_text(SCENARIO.format(duration_s=110, rounds=10, reception=reception))
    links = Links(LOST_ON_THE_LINK[reception])
    simulation = build(load(path), [links]).simulation
    simulation.run()
    simulation.conclude()
    rounds = rounds_of(read_k7(tmp_path / "grenoble.k7.gz"), 20, range(50))
    ratios = {pair: ratio_of(rounds, pair) for pair, sent in links.sent.items() if sent}
    assert sum(links.sent.values()) > 30_000
    uncertain = [pair for pair, ratio in ratios.items() if 0.0 < ratio < 1.0]
    assert len(uncertain) > 40
    for pair, ratio in ratios.items():
        if pair not in uncertain:
            assert links.arrived[pair] == ratio * links.sent[pair], pair
    values = {pair: binomtest(links.arrived[pair], links.sent[pair], ratios[pair]).pvalue for pair in uncertain}
    assert min(values.values()) > 0.01 / len(uncertain), min(values, key=lambda pair: values[pair])

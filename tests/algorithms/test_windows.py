"""Radios that sleep between rounds: who listens when, and that no decision changes."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.algorithms.message_passing_parameters import CsmpParameters
from netsim.algorithms.windows import Quietness
from netsim.errors import ScenarioError
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import OUTCOME_CODE, Association, Event, Frame


@given(
    wishes=st.lists(st.sets(st.sampled_from([(a, b) for a in range(4) for b in range(4) if a != b])), max_size=30),
    after=st.integers(1, 4),
    every=st.integers(1, 6),
    data=st.data(),
)
def test_who_is_sent_to_listens(
    wishes: list[set[tuple[int, int]]], after: int, every: int, data: st.DataObject
) -> None:
    """Whatever is wished to be sent, and whether or not the sender hears that it arrived, it goes to a node that listens."""
    parameters = CsmpParameters(sleep="when_quiet", quiet_rounds=after, common_every=every, spread_s=0.1)
    nodes = [Quietness(parameters) for _ in range(4)]
    for number, wished in enumerate(wishes):
        listening = [node.listens(number) for node in nodes]
        sent = [
            (source, to)
            for source, node in enumerate(nodes)
            for to in node.passed(number, {b: [(a, b, None)] for a, b in wished if a == source})  # type: ignore[list-item]
        ]
        assert all(listening[to] for _, to in sent)
        if number % every == 0:
            assert wished <= set(sent)
        for source, to in sent:
            nodes[to].exchanged(source, number)
            if data.draw(st.booleans()):
                nodes[source].exchanged(to, number)


class Decisions:
    """The last decisions, and how often a frame found its addressee asleep."""

    def __init__(self) -> None:
        self.last: dict[int, list[int]] = {}
        self.asleep = 0

    def handlers(self) -> dict[type[Event], Any]:
        return {Association: self._decided, Frame: self._sent}

    def _decided(self, event: Association, _: int) -> None:
        self.last[event.node] = list(event.target)

    def _sent(self, event: Frame, _: int) -> None:
        outcomes = zip(event.rx_node, event.rx_outcome, strict=True)
        self.asleep += (event.destination, OUTCOME_CODE["asleep"]) in {(int(n), int(o)) for n, o in outcomes}


def test_sleeping_saves_joules_and_changes_no_decision(scenarios: Path) -> None:
    base = ["medium={type: ideal}", "mac={type: ideal}", "network={type: one-hop}", "algorithm.tolerance=0.5"]
    rounds = ["algorithm.rounds=20", "algorithm.round_s=1", "algorithm.spread_s=0.2", "duration_s=60"]
    joules, decided = {}, {}
    for sleep in ("never", "scheduled", "when_quiet"):
        seen = Decisions()
        loaded = load(scenarios / "quickstart.yaml", [*base, *rounds, f"algorithm.sleep={sleep}"])
        joules[sleep] = run(loaded, observers=[seen]).metrics["energy_j"]
        decided[sleep] = seen.last
        assert seen.asleep == 0
    assert decided["never"] == decided["scheduled"] == decided["when_quiet"]
    assert joules["when_quiet"] < 0.8 * joules["scheduled"] < 0.5 * joules["never"]


@pytest.mark.parametrize(
    ("overrides", "remedy"),
    [
        (["algorithm.sleep=scheduled", "algorithm.spread_s=0.9"], "window_margin_s"),
        (["algorithm.sleep=when_quiet", "algorithm.silence=notice"], "never quiet"),
        (["algorithm.sleep=when_quiet", "algorithm.rehost=true"], "rehost"),
    ],
)
def test_what_does_not_go_together_is_refused(scenarios: Path, overrides: list[str], remedy: str) -> None:
    with pytest.raises(ScenarioError, match=remedy):
        load(scenarios / "quickstart.yaml", overrides)

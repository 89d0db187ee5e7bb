"""Notices: what their bytes hold, and that they make a lossy link as good as a lossless one."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.algorithms.notices import decode_notice, encode_notice
from netsim.errors import ScenarioError
from netsim.kernels.communication import CommunicationRule, EdgeMemory, View
from netsim.kernels.semiring import log_normalise
from netsim.scenario.load import load
from netsim.scenario.run import run

EDGES = [(1, 2), (1, 5), (3, 2), (3, 4), (3, 5), (7, 2), (7, 4), (7, 5), (8, 2)]


@given(new=st.sets(st.sampled_from(EDGES)), number=st.integers(0, 65535), first=st.integers(0, 65535))
def test_a_notice_holds_a_bit_an_edge_and_the_new_messages(new: set[tuple[int, int]], number: int, first: int) -> None:
    entries = [(*edge, np.array([-0.5, float(edge[0])])) for edge in sorted(new)]
    payload = encode_notice(number, first, EDGES, entries, "float64")
    assert len(payload) == 6 + 2 + len(entries) * (8 + 16)
    got = decode_notice(payload, "float64")
    assert got[:3] == (number, first, [edge in new for edge in EDGES])
    assert [(source, to, message.tolist()) for _, source, to, message in got[3]] == [
        (source, to, message.tolist()) for source, to, message in entries
    ]


def marginals(scenarios: Path, *overrides: str) -> tuple[Any, dict[str, Any]]:
    rounds = ["algorithm.rounds=12", "algorithm.round_s=1", "algorithm.spread_s=0.1", "duration_s=60"]
    common = ["algorithm.type=cssp", "algorithm.tolerance=0.01", "mac={type: ideal}", "network={type: one-hop}"]
    metrics = run(load(scenarios / "graphs" / "grid-sum-product.yaml", [*common, *rounds, *overrides])).metrics
    return metrics["marginals"], metrics


def test_asking_makes_good_what_was_lost_and_a_time_out_does_not(scenarios: Path) -> None:
    lossless = "medium={type: ideal}"
    lossy = "medium={type: ideal, loss_probability: 0.2}"
    asked = ["algorithm.silence=notice", "algorithm.asks=10"]
    whole, _ = marginals(scenarios, lossless)
    assert marginals(scenarios, lossless, *asked)[0] == whole  # bit for bit
    mended, metrics = marginals(scenarios, lossy, *asked)
    assert metrics["repeats_asked"] > 0
    assert metrics["notices_missed"] == 0
    assert mended == whole
    assert marginals(scenarios, lossy)[0] != whole
    counted = marginals(scenarios, lossy, "algorithm.silence=notice", "algorithm.asks=0")[1]
    assert counted["notices_missed"] > 0
    assert counted["repeats_asked"] == 0


def test_notices_need_rounds(scenarios: Path) -> None:
    overrides = ["algorithm.schedule=asynchronous", "algorithm.silence=notice"]
    with pytest.raises(ScenarioError, match="synchronous"):
        load(scenarios / "graphs" / "grid-sum-product.yaml", overrides)


@given(logs=st.lists(st.lists(st.floats(-5, 0), min_size=3, max_size=3), min_size=2, max_size=6), data=st.data())
def test_a_message_taken_back_leaves_the_memory_as_if_it_had_not_been_sent(
    logs: Sequence[Sequence[float]], data: st.DataObject
) -> None:
    """The next divergence is that from the last message that arrived."""
    memory = EdgeMemory(CommunicationRule(tolerance=0.05), np.ones(3))
    arrived = EdgeMemory(CommunicationRule(tolerance=0.05), np.ones(3))
    for row in logs:
        message = log_normalise(np.array(row))
        decision = memory.decide(message)
        fails = data.draw(st.booleans())
        if decision.send and fails:
            memory.take_back()
            assert arrived.decide(message, View(tolerance=np.inf)).divergence == decision.divergence
        else:
            assert arrived.decide(message) == decision

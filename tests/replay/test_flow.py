"""The graphical model in the replay: rows of a recording worked out by hand."""

from pathlib import Path

import numpy as np
from recordings import MS, named_nodes, recording, timed

from netsim.replay import style
from netsim.trace.events import Association, GraphMessages, MessageSent, NodeTable, TruthOrigins, VariablePlacement
from netsim.trace.writer import TraceWriter

ROUNDS = [[(0, 1), (1, 0)], [(1, 0)], [(0, 1)], []]


def write(path: Path, *, shared: bool = True, unknown: int | None = None) -> Path:
    """Two sensors 10 m apart; round `k` is recorded at `k` seconds."""
    none = [""] * 2
    with TraceWriter(path, {}) as writer:
        writer.write(NodeTable([0, 1], ["a", "b"], none, ["sensor"] * 2, [0, 10], [0, 0], none, none, [1.0] * 2), 0)
        writer.write(VariablePlacement([0, 1], ["sensor 0", "sensor 1"], [0, 1], [0], [1]), 0)
        for number, edges in enumerate(ROUNDS):
            source, to = [a for a, _ in edges], [b if unknown is None else unknown for _, b in edges]
            event = GraphMessages(0, number, source, to, [1] * len(edges), 2, 0.5, int(shared), 0)
            writer.write(event, number * 1000 * MS)
    return path


def packed(state: str) -> int:
    red, green, blue, alpha = style.FLOW_COLOURS[state]
    return red << 24 | green << 16 | blue << 8 | alpha


def test_states_arrows_and_captions_follow_the_rounds(tmp_path: Path) -> None:
    rows = recording(write(tmp_path / "flow.mcap"), tmp_path)
    colours = timed(rows["/graph/vertices"], "Points2D:colors")
    states = [("sends", "sends"), ("fell silent", "sends"), ("wakes", "fell silent"), ("fell silent", "silent")]
    assert {time: list(each) for time, each in colours.items()} == {
        1000 * number * MS: [packed(state) for state in pair] for number, pair in enumerate(states)
    }
    messages = timed(rows["/graph/messages"], "Arrows2D:vectors")
    assert [len(messages[1000 * number * MS]) for number in range(4)] == [2, 0, 1, 0]
    wakes = timed(rows["/graph/wakes"], "Arrows2D:vectors")
    assert [len(wakes[1000 * number * MS]) for number in range(4)] == [0, 1, 0, 0]
    (vector,) = wakes[1000 * MS]
    assert vector[0] < 0  # from sensor 1 to sensor 0
    np.testing.assert_allclose(vector[1], 0.0, atol=1e-6)
    captions = timed(rows["/graph/caption"], "Points2D:labels")
    assert captions[2000 * MS] == ["round 2: 1 send, 1 fall silent; wake: s0 after s1"]


def test_a_window_begins_with_the_round_that_is_on(tmp_path: Path) -> None:
    rows = recording(write(tmp_path / "flow.mcap"), tmp_path, start_s=1.5, end_s=2.5)
    captions = timed(rows["/graph/caption"], "Points2D:labels")
    assert {time // MS: text[0][:7] for time, text in captions.items()} == {1500: "round 1", 2000: "round 2"}


def test_without_common_rounds_or_a_fitting_model_there_is_no_view(tmp_path: Path) -> None:
    for path in (write(tmp_path / "own.mcap", shared=False), write(tmp_path / "odd.mcap", unknown=9)):
        assert not [entity for entity in recording(path, tmp_path) if entity.startswith("/graph")]


def test_a_round_that_began_before_the_window_is_counted_whole(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "own.mcap", {}) as writer:
        writer.write(named_nodes("a", "b"), 0)
        for time_ms, node, number in ((500, 0, 0), (600, 1, 0), (1000, 0, 1), (3000, 1, 1)):
            writer.write(GraphMessages(node, number, [node], [1 - node], [1], 2, 0.5, 0, 0), time_ms * MS)
    rows = recording(tmp_path / "own.mcap", tmp_path, start_s=2.0)
    messages = timed(rows["/plots/senders/graph_messages"], "Scalars:scalars")
    assert {at: value[0] for at, value in messages.items()} == {3000 * MS: 2.0}


def test_decisions_of_before_the_window_hold_in_it(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "own.mcap", {}) as writer:
        writer.write(named_nodes("a", "b"), 0)
        for node in (0, 1):
            writer.write(TruthOrigins(node, [0.0], [0.0], [5]), 0)
        writer.write(Association(0, [5], 0), 1000 * MS)
        writer.write(Association(1, [4], 0), 3000 * MS)
    rows = recording(tmp_path / "own.mcap", tmp_path, start_s=2.0)
    accuracy = timed(rows["/plots/accuracy"], "Scalars:scalars")
    assert {at: value[0] for at, value in accuracy.items()} == {2000 * MS: 1.0, 3000 * MS: 0.5}


def test_bars_count_all_of_their_time(tmp_path: Path) -> None:
    """Ten messages a second, and a window that begins within a second."""
    with TraceWriter(tmp_path / "even.mcap", {}) as writer:
        writer.write(named_nodes("a", "b"), 0)
        for number in range(1, 701):
            writer.write(MessageSent(number, 0, 1, "tick", 20, 1, []), 100 * number * MS)
    rows = recording(tmp_path / "even.mcap", tmp_path, start_s=5.75, end_s=65.75)
    rates = timed(rows["/plots/messages/tick"], "Scalars:scalars")
    assert min(rates) == 5750 * MS
    assert {value[0] for value in rates.values()} == {10.0}

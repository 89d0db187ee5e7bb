"""Rounds worked out by hand, and laws that hold of any messages."""

from hypothesis import given
from hypothesis import strategies as st

from netsim.flow.rounds import Round, RoundLog, waking
from netsim.metrics.collect import metrics_of
from netsim.trace.events import Event, GraphMessages, VariablePlacement

Edges = list[tuple[int, int]]


def event(number: int, edges: Edges, node: int = 0, *, shared: bool = True) -> GraphMessages:
    source, to = [a for a, _ in edges], [b for _, b in edges]
    return GraphMessages(node, number, source, to, [1] * len(edges), len(edges), 0.5, int(shared), 0)


def rounds_of(sent: list[Edges]) -> tuple[Round, ...]:
    log = RoundLog()
    for number, edges in enumerate(sent):
        log.add(event(number, edges), 10 * number)
    return log.rounds()


def test_a_chain_of_waking() -> None:
    """0 falls silent in round 1 and wakes in round 2 after 1, which wakes 2 in round 3; 3 speaks late for the first time."""
    sent = [[(0, 1), (1, 0), (2, 0)], [(1, 0)], [(0, 2), (0, 1)], [(2, 3), (3, 2)], []]
    rounds = rounds_of(sent)
    assert [sorted(each.senders) for each in rounds] == [[0, 1, 2], [1], [0], [2, 3], []]
    assert [dict(each.woken) for each in rounds] == [{}, {}, {0: (1,)}, {2: (0,)}, {}]
    assert [sorted(each.fell_silent) for each in rounds] == [[], [0, 2], [1], [0], [2, 3]]
    assert [sorted(waking(a, b)) for a, b in zip(rounds, [*rounds[1:], None], strict=True)] == [
        [], [(1, 0)], [(0, 2)], [], [],
    ]  # fmt: skip
    assert [rounds[2].state_of(vertex) for vertex in range(4)] == ["wakes", "fell silent", "silent", "silent"]
    assert [each.time_ns for each in rounds] == [0, 10, 20, 30, 40]
    assert [each.over_air for each in rounds] == [3, 1, 2, 2, 0]


def test_nodes_are_put_together_and_gaps_are_silent() -> None:
    log = RoundLog()
    log.add(event(0, [(5, 6)], node=1), 7)
    log.add(event(0, [(0, 5)], node=0), 4)
    log.add(event(2, [(5, 0)], node=1), 30)
    rounds = log.rounds()
    assert [each.messages for each in rounds] == [((0, 5), (5, 6)), (), ((5, 0),)]
    assert [each.time_ns for each in rounds] == [4, 4, 30]
    assert dict(rounds[2].woken) == {5: ()}


def test_metrics_count_senders_and_wakers() -> None:
    model = VariablePlacement([0, 1, 2], ["a", "b", "c"], [0, 0, 0], [0, 1], [1, 2])
    sent = [[(0, 1), (1, 0), (1, 2)], [(1, 0)], [(0, 1)]]
    events: list[tuple[int, Event]] = [(0, model), *((number, event(number, each)) for number, each in enumerate(sent))]
    figures = metrics_of(events)
    assert figures["senders_by_round"] == [2, 1, 1]
    assert figures["vertices_woken"] == 1
    events.append((9, event(3, [(0, 1)], shared=False)))
    assert "senders_by_round" not in metrics_of(events)
    assert "vertices_woken" not in metrics_of([(0, model)])


vertices = st.integers(0, 5)
histories = st.lists(st.lists(st.tuples(vertices, vertices), max_size=6), min_size=1, max_size=8)


@given(histories)
def test_the_books_of_the_senders_balance(sent: list[Edges]) -> None:
    """Senders of a round: those of the round before, less the silenced, and the woken, and those that never sent before."""
    known: set[int] = set()
    before: set[int] = set()
    for each in rounds_of(sent):
        first = each.senders - known
        assert each.senders == (before - each.fell_silent) | set(each.woken) | first
        assert not set(each.woken) & before
        assert set(each.woken) <= known
        before, known = set(each.senders), known | each.senders


@given(histories, st.randoms())
def test_the_order_of_the_nodes_does_not_show(sent: list[Edges], random: object) -> None:
    whole = rounds_of(sent)
    parts = [event(number, [edge]) for number, edges in enumerate(sent) for edge in edges]
    parts += [event(number, []) for number in range(len(sent))]
    random.shuffle(parts)  # type: ignore[attr-defined]
    log = RoundLog()
    for each in parts:
        log.add(each, 10 * each.round)
    assert log.rounds() == whole

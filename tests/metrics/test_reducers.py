"""Metrics from hand-made events: every figure can be counted on one's fingers."""

from collections import Counter

import numpy as np
import pytest
from scipy import stats

from netsim.kernels.association_marginals import exact_origins
from netsim.kernels.association_model import AssociationInstance, SensorModel
from netsim.metrics import inference, origins
from netsim.metrics.collect import metrics_of
from netsim.metrics.conversations import Conversation, Conversations
from netsim.trace.events import (
    BROADCAST,
    OUTCOME_CODE,
    Association,
    EnergyLedger,
    Event,
    Frame,
    GraphMessages,
    Marginals,
    MessageDelivered,
    MessageDropped,
    MessageSent,
    NodeLife,
    NodeTable,
    Problem,
    TruthOrigins,
    VariablePlacement,
)

MS = 1_000_000


def nodes(count: int) -> NodeTable:
    ids = list(range(count))
    text = [f"n{node:02d}" for node in ids]
    return NodeTable(
        ids, text, ["g"] * count, ["sensor"] * count, [0.0] * count, [0.0] * count, text, text, [1.0] * count
    )


def frame(kind: str, *, ack: bool = False, attempt: int = 0, size_byte: int = 20) -> Frame:
    return Frame(1, 0, 2 * MS, 0, 1, kind, int(ack), size_byte, attempt, 1, 0.0, [], [], [], [])


def test_traffic_counts_messages_frames_bytes_airtime_and_losses() -> None:
    events: list[tuple[int, Event]] = [
        (0, MessageSent(1, 0, 1, "a", 30, 1, [])),
        (0, MessageSent(2, 0, BROADCAST, "b", 10, 1, [])),
        (0, MessageSent(3, 0, 1, "a", 30, 1, [])),
        (MS, frame("a")),
        (2 * MS, frame("a", attempt=1)),
        (3 * MS, frame("a", ack=True, size_byte=5)),
        (3 * MS, MessageDelivered(1, 0, 1, "a", 30, 1, 3 * MS)),
        (4 * MS, frame("b")),
        (4 * MS, MessageDelivered(2, 0, 1, "b", 10, 1, 1 * MS)),
        (4 * MS, MessageDelivered(2, 0, 2, "b", 10, 1, 2 * MS)),
        (5 * MS, MessageDropped(3, 0, 1, 0, "a", "no_ack")),
    ]
    figures = metrics_of(events)
    assert figures["radio_messages_by_kind"] == {"a": 2, "b": 1}
    assert figures["message_payload_byte"] == 70
    assert (figures["deliveries"], figures["delivery_ratio_unicast"], figures["unicasts_undelivered"]) == (3, 0.5, 1)
    assert figures["drops_by_reason"] == {"no_ack": 1}
    assert figures["latency_mean_s"] == pytest.approx(0.002)
    assert figures["latency_max_s"] == pytest.approx(0.003)
    assert [figures[f"frames{part}"] for part in ("", "_data", "_retry", "_ack")] == [4, 2, 1, 1]
    assert figures["frame_by_kind_byte"] == {"a": 45, "b": 20}
    assert figures["airtime_s"] == pytest.approx(0.008)


def test_conversations_add_up_the_data_frames_of_each_pair() -> None:
    conversations = Conversations()
    take = conversations.handlers()[Frame]
    got, weak, over = (OUTCOME_CODE[name] for name in ("received", "weak", "overheard"))
    for destination, attempt, ack, size_byte, codes in (
        (1, 0, 0, 20, [weak, over]),
        (1, 1, 0, 20, [got, over]),
        (1, 0, 1, 5, [got, over]),
        (2, 0, 0, 30, [over, weak]),
        (BROADCAST, 0, 0, 40, [got, weak]),
    ):
        ears = [0.0, 0.0]
        take(Frame(1, 0, MS, 0, destination, "a", ack, size_byte, attempt, 1, 0.0, [1, 2], codes, ears, ears), MS)
    assert dict(conversations.found) == {
        (0, 1): Conversation(2, 1, 40, Counter(weak=1, received=1)),
        (0, 2): Conversation(1, 0, 30, Counter(weak=1)),
        (0, BROADCAST): Conversation(1, 0, 40, Counter()),
    }


def test_of_unicast_data_frames_it_is_told_what_was_lost_at_the_addressee_to_what() -> None:
    def sent(destination: int, heard: dict[int, str], ack: bool = False, attempt: int = 0) -> tuple[int, Event]:
        codes = [OUTCOME_CODE[name] for name in heard.values()]
        ears = [0.0] * len(heard)
        return MS, Frame(
            1, 0, MS, 0, destination, "a", int(ack), 20, attempt, 1, 0.0, list(heard), codes, ears, ears
        )  # fmt: skip

    events = [
        sent(1, {1: "collided", 2: "overheard"}),
        sent(1, {2: "overheard", 1: "received"}, attempt=1),
        sent(1, {2: "jammed", 1: "jammed"}, attempt=2),
        sent(2, {1: "overheard", 2: "jammed"}),
        sent(2, {1: "overheard"}),  # the addressee hears nothing of it
        sent(0, {0: "weak", 1: "overheard"}, ack=True),
        sent(BROADCAST, {1: "weak", 2: "received"}),
    ]
    figures = metrics_of(events)
    assert figures["frames_unicast_data"] == 5
    assert figures["frames_lost_by_reason"] == {"collided": 1, "jammed": 2, "out_of_reach": 1}
    assert figures["frame_reception_ratio_unicast"] == pytest.approx(1 / 5)
    assert metrics_of(events[-2:])["frame_reception_ratio_unicast"] is None


def test_energy_is_summed_every_way() -> None:
    ledger = EnergyLedger(
        node=[0, 0, 1],
        device=["radio", "radio", "cpu"],
        state=["listen", "transmit", "active"],
        kind=["", "a", ""],
        energy_j=[1.0, 0.25, 0.5],
        time_s=[1.0, 1.0, 1.0],
    )
    figures = metrics_of([(0, nodes(2)), (7 * MS, NodeLife(1, "died", "")), (9 * MS, ledger)])
    assert figures["energy_j"] == 1.75
    assert figures["energy_by_state_j"] == {"cpu.active": 0.5, "radio.listen": 1.0, "radio.transmit": 0.25}
    assert figures["energy_by_kind_j"] == {"(none)": 1.5, "a": 0.25}
    assert figures["energy_by_node_j"] == {"n00": 1.25, "n01": 0.5}
    assert (figures["energy_most_node"], figures["energy_most_j"]) == ("n00", 1.25)
    assert (figures["deaths"], figures["first_death_s"], figures["death_by_node_s"]) == (1, 0.007, {"n01": 0.007})
    assert figures["simulated_s"] == 0.009


def test_a_node_that_finished_and_then_died_counts_once() -> None:
    lives = [NodeLife(0, "finished", ""), NodeLife(0, "died", ""), NodeLife(1, "failed", "x"), NodeLife(2, "died", "")]
    figures = metrics_of([(0, nodes(3)), *((MS, life) for life in lives)])
    assert [figures[f"nodes_{end}"] for end in ("finished", "failed", "died")] == [1, 1, 1]


def graph_messages(
    node: int, number: int, sent: int, change: float, synchronous: int = 1, late_ns: int = 0
) -> GraphMessages:
    return GraphMessages(node, number, [node] * sent, [9] * sent, [1] * sent, 3, change, synchronous, late_ns)


def test_rounds_convergence_and_messages_per_hosting_node() -> None:
    placement = VariablePlacement([0, 1, 2], ["a", "b", "c"], [0, 1, 1], [0], [1])
    counts = [(0, 0, 3, 0.0), (1, 0, 1, 0.0), (0, 1, 2, 0.5), (1, 1, 0, 0.01), (0, 2, 2, 0.0), (1, 2, 0, 0.0)]
    events: list[tuple[int, Event]] = [(0, placement)]
    events += [
        (1000 * MS * number, graph_messages(node, number, sent, change)) for node, number, sent, change in counts
    ]
    figures = metrics_of(events)
    assert figures["graph_messages"] == 8
    assert figures["graph_messages_per_sensor"] == 4.0  # two nodes host variables
    assert figures["graph_messages_by_round"] == [4, 2, 2]
    assert figures["converged_round"] == 2
    assert figures["graph_messages_until_convergence_per_sensor"] == 4.0
    assert figures["last_news_s"] == 1.0
    late = metrics_of([*events, (3, graph_messages(0, 3, 1, 0.2, late_ns=5 * MS))])
    assert (late["rounds_begun_late"], late["round_lateness_max_s"], late["converged_round"]) == (1, 0.005, None)
    loose = metrics_of([(0, placement), (MS, graph_messages(0, 7, 2, 0.5, synchronous=0))])
    assert "rounds" not in loose


def instance() -> AssociationInstance:
    """Two sensors that see nothing in common; one target each, far apart."""
    eye = ((1.0, 0.0), (0.0, 1.0))
    return AssociationInstance(
        sensor_nodes=(0, 1),
        measurements_m=(np.array([[0.1, 0.0], [3.9, 0.0]]), np.array([[20.0, 0.1]])),
        means_m=np.array([[0.0, 0.0], [20.0, 0.0]]),
        covariances_m2=np.array([eye, eye]),
        coverage=((0,), (1,)),
        hosts=(None, None),
        model=SensorModel(eye, 0.8, 0.15, "strict", 5.0),
    )


def association_events() -> list[tuple[int, Event]]:
    return [
        (0, Problem("association", instance().to_json())),
        (0, TruthOrigins(0, [0.1, 3.9], [0.0, 0.0], [0, -1])),
        (0, TruthOrigins(1, [20.0], [0.1], [1])),
        (1, Association(0, [-1, 0], 0)),
        (1, Association(1, [1], 0)),
        (2, Association(0, [0, -1], 1)),
    ]


def test_association_error_by_round_keeps_the_last_word_of_who_fell_silent() -> None:
    figures = metrics_of(association_events())
    assert figures["association_error_by_round"] == [pytest.approx(2 / 3), 0.0]
    assert figures["association_error"] == 0.0
    assert figures["association_error_exact_map"] == 0.0
    assert figures["association_differs_from_exact_map"] == 0.0
    assert figures["association_error_independent"] == 0.0
    early = metrics_of(association_events()[:-1])
    assert early["association_error"] == pytest.approx(2 / 3)
    assert early["association_error_target_originated"] == 0.5
    assert metrics_of(association_events()[:3])["association_error"] is None


def test_a_problem_too_large_for_the_exact_map_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inference, "MOST_MEASUREMENTS_FOR_EXACT_MAP", 2)
    figures = metrics_of(association_events())
    assert figures["association_error_exact_map"] is None
    assert figures["association_differs_from_exact_map"] is None
    assert figures["association_error"] == 0.0


def origins_told(*beliefs: tuple[int, list[float]]) -> dict[str, object]:
    """The figures of the two-sensor problem where sensors tell where their measurements came from."""
    told = [(3, Marginals(sensor, sensor, belief, 1, 0)) for sensor, belief in beliefs]
    return metrics_of([(0, Problem("association", instance().to_json())), *told])


def test_beliefs_about_origins_are_compared_with_the_exact_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measurements of sensor 0 are of target 0 or false, by hand: strict, so that one is the target's and one is false."""
    near, far = exact_origins(instance())
    weights = [stats.multivariate_normal([0, 0], 2 * np.eye(2)).pdf(point) for point in ([0.1, 0.0], [3.9, 0.0])]
    share = weights[0] / sum(weights)
    np.testing.assert_allclose(near, [[share, 1 - share], [1 - share, share]], rtol=1e-12)
    right = [(0, (near / 2).ravel().tolist()), (1, far.ravel().tolist())]
    figures = origins_told(*right)
    assert figures["marginal_error_linf"] == pytest.approx(0.0, abs=1e-15)
    assert figures["marginals_exact"] == {"sensor 0": near.tolist(), "sensor 1": far.tolist()}
    even = origins_told((0, [0.25] * 4), right[1])
    assert even["marginal_error_linf"] == pytest.approx(share - 0.5)
    entropy = -share * np.log(share) - (1 - share) * np.log(1 - share)
    assert even["marginal_error_kl_nat"] == pytest.approx(2 * (np.log(2) - entropy) / 3)
    assert origins_told((0, [1.0, 0.0, 0.0, 1.0]), right[1])["marginal_error_kl_nat"] is None
    assert "marginals" not in origins_told((0, [1.0]))  # of other measurements than it had
    monkeypatch.setattr(origins, "LARGEST_TABLE", 1)
    assert origins_told(*right)["marginal_error_linf"] is None

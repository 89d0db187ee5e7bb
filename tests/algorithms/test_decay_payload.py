"""Reports, requests for factors and answers, as bytes."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netsim.algorithms.decay_payload import (
    FactorRequest,
    VertexName,
    decode_answer,
    decode_report,
    decode_request,
    encode_answer,
    encode_report,
    encode_request,
    narrowed,
    rounding_m,
)
from netsim.errors import AlgorithmError
from netsim.kernels.event_association import PredictedEvent
from netsim.kernels.known_association import SensorReport
from netsim.kernels.scaled_product import Product

ids = st.integers(0, 65_535)
metres = st.floats(-1e4, 1e4)
WIDTHS = {"float64": 16, "float32": 8, "float16": 4}
names = st.builds(VertexName, st.booleans(), ids, ids)
TORN = (ValueError, struct.error)


@st.composite
def reports(draw, width):
    """At their positions as they are told."""
    places = st.tuples(metres, metres).map(lambda place: tuple(narrowed(np.array([place]), width)[0].tolist()))
    numbers = sorted(draw(st.sets(st.integers(0, 255), min_size=1, max_size=5)))
    events = [
        PredictedEvent(event, draw(ids), *draw(places)) for event in sorted(draw(st.sets(ids, min_size=1, max_size=4)))
    ]
    points_m = np.array([draw(places) for _ in numbers]).reshape(-1, 2)
    return SensorReport(draw(ids), tuple(numbers), points_m, tuple(events))


@settings(max_examples=60)
@given(st.data(), st.sampled_from(list(WIDTHS)))
def test_reports_come_back_as_they_went(data, width):
    report = data.draw(reports(width))
    sent = encode_report(report, width)
    found = decode_report(report.node, sent, width)
    assert (found.node, found.numbers, found.events) == (report.node, report.numbers, report.events)
    np.testing.assert_array_equal(found.measurements_m, report.measurements_m)
    assert len(sent) == 1 + len(report.events) * (4 + WIDTHS[width]) + len(report.numbers) * (1 + WIDTHS[width])


def test_a_report_of_nothing_has_no_bytes():
    empty = SensorReport(3, (), np.empty((0, 2)), ())
    assert encode_report(empty, "float64") == b""
    found = decode_report(3, b"", "float64")
    assert (found.numbers, found.events, found.measurements_m.shape) == ((), (), (0, 2))


@pytest.mark.parametrize("width", WIDTHS)
def test_torn_reports_are_refused(width):
    events = (PredictedEvent(1, 2, 3.0, 4.0), PredictedEvent(2, 2, 3.0, 4.0))
    sent = encode_report(SensorReport(1, (0, 1), np.ones((2, 2)), events), width)
    one = 1 + WIDTHS[width]
    for size in set(range(1, len(sent))) - {len(sent) - one, len(sent) - 2 * one}:
        with pytest.raises(TORN):
            decode_report(1, sent[:size], width)


@pytest.mark.parametrize("count", [1, 256])
def test_more_than_a_byte_can_count_is_refused(count):
    events = tuple(PredictedEvent(number, 1, 0.0, 0.0) for number in range(257 - count))
    report = SensorReport(7, tuple(range(1, count + 1)), np.zeros((count, 2)), events)
    with pytest.raises(AlgorithmError, match="node 7: more than 255 measurements or events in a report"):
        encode_report(report, "float64")


@given(st.tuples(metres, metres), st.sampled_from(list(WIDTHS)))
def test_rounding_moves_no_position_farther_than_said(place, width):
    told = narrowed(np.array([place]), width)[0]
    assert np.hypot(*(told - place)) <= rounding_m(tuple(told.tolist()), width)


@given(
    st.builds(
        FactorRequest,
        st.integers(0, 2**32 - 1),
        ids,
        st.lists(names, max_size=6).map(tuple),
        st.lists(names, min_size=1, max_size=6).map(tuple),
    )
)
def test_requests_come_back_as_they_went(request):
    sent = encode_request(request)
    assert decode_request(sent) == request
    assert len(sent) == 8 + 5 * (len(request.removed) + len(request.vertices))
    for size in set(range(len(sent))) - set(range(8 + 5 * len(request.removed) + 5, len(sent), 5)):
        with pytest.raises(TORN):
            decode_request(sent[:size])


@given(st.integers(0, 2**32 - 1), st.builds(Product, st.floats(0.5, 1.0, exclude_max=True), st.integers(-(2**31), 0)))
def test_answers_come_back_as_they_went(number, product):
    sent = encode_answer(number, product)
    assert decode_answer(sent) == (number, product)
    for size in range(len(sent)):
        with pytest.raises(TORN):
            decode_answer(sent[:size])


def test_an_answer_of_one_comes_back():
    assert decode_answer(encode_answer(7, Product())) == (7, Product())
    assert float(Product()) == 1.0


@pytest.mark.parametrize(
    "product",
    [
        Product(-0.5, 0),
        Product(0.0, 0),
        Product(0.25, 0),
        Product(0.6, 1),
        Product(0.5, 2),
        Product(np.nan, 0),
        Product(np.inf, 0),
    ],
)
def test_an_answer_that_is_no_product_of_probabilities_is_refused(product):
    with pytest.raises(ValueError, match="a product of probabilities of"):
        decode_answer(encode_answer(1, product))

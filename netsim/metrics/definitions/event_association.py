"""Measurement-to-event association: how far the stated probabilities are from the exact ones, and what is certified."""

from netsim.metrics.metric import grouped

_MADE_OF = "PairProbabilities, Problem; exact by dynamic programming over the events"
_OH_2010 = "Oh 2010"
_RECORD = "AlgorithmRecord of `correlation-decay`"

METRICS = grouped(
    "event association",
    (
        "gated_pairs",
        "1",
        "",
        "Pairs of a measurement and an event within its gate. The figures of this group belong to the problem "
        "`event-association` and are missing elsewhere.",
        "Problem",
    ),
    (
        "gated_pairs_told_share",
        "1",
        "higher",
        "Share of these pairs for which the measurement's owner stated a probability.",
        "PairProbabilities, Problem",
    ),
    (
        "matchings",
        "1",
        "",
        "Number of association events, that is of sets of gated pairs in which no measurement and no event occurs twice; "
        "null where exact sums are out of reach.",
        "Problem",
    ),
    (
        "pair_error_linf",
        "1",
        "lower",
        "Largest distance of a stated probability from the exact one, over the pairs told of; null when nobody told of any, "
        "or exact sums are out of reach.",
        f"{_MADE_OF}; {_OH_2010}, section 6",
    ),
    ("pair_error_mean", "1", "lower", "Mean of the distances of `pair_error_linf`.", _MADE_OF),
    (
        "pair_error_bp_linf",
        "1",
        "lower",
        "Largest distance from the exact probabilities of those that loopy belief propagation finds with all measurements "
        "at one place: what a centre could do at little cost.",
        "Problem; Williams and Lau 2014",
    ),
    (
        "interval_misses",
        "1",
        "lower",
        "Pairs whose exact probability is outside the stated interval by more than 1e-9: 0 unless something is wrong.",
        _MADE_OF,
    ),
    ("interval_width_max", "1", "lower", "Widest stated interval.", "PairProbabilities"),
    ("interval_width_mean", "1", "lower", "Mean width of the stated intervals.", "PairProbabilities"),
    (
        "decay_depth",
        "1",
        "",
        "Most levels of recursion that a node used, t.",
        f"PairProbabilities; {_OH_2010}, eq 13",
    ),
    ("decay_depth_mean", "1", "", "Mean of the levels used, over the measurements told of.", "PairProbabilities"),
    (
        "reports_passed_on",
        "1",
        "lower",
        "Reports of sensors in all bundles of the flood, each sensor's own included: on links without loss the sum over all "
        "sensors of how many are within one hop less than the flood goes. A bundle sent again because it was asked for does "
        "not count.",
        _RECORD,
    ),
    ("reports_heard_mean", "1", "", "Sensors whose report the flood brought a node, itself included, mean.", _RECORD),
    (
        "reports_asked_for",
        "1",
        "lower",
        "Sensors asked for their report after the flood, for a narrower interval, repetitions included.",
        _RECORD,
    ),
    (
        "flood_neighbours_given_up",
        "1",
        "lower",
        "How often a node gave up a neighbour that was silent for a whole round of the flood and stayed so.",
        _RECORD,
    ),
    (
        "factor_requests",
        "1",
        "lower",
        "Requests for factors, repetitions left out.",
        f"{_RECORD}; {_OH_2010}, Algorithm 4",
    ),
    (
        "factors_stood_in",
        "1",
        "lower",
        "Factors that a node computed in the place of an owner who gave no sign of life.",
        _RECORD,
    ),
    ("factor_requests_open", "1", "", "Most requests of others that were open at one node at once.", _RECORD),
    (
        "events_incomplete_share",
        "1",
        "lower",
        "Of the events of a node's own pairs those of which a measurement may exist that it was not told of, share over all "
        "nodes.",
        _RECORD,
    ),
)

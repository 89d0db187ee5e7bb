"""Target distribution: how wrong the numbers of targets in subregions are."""

from netsim.metrics.definitions.inference import CHEN_2006
from netsim.metrics.metric import grouped

_MADE_OF = f"Marginals, TruthCounts, Problem; {CHEN_2006}, eq 20"

METRICS = grouped(
    "target distribution",
    (
        "subregions",
        "1",
        "",
        "Subregions that some sensor covers. The figures of this group belong to the problem `target-distribution` and "
        "are missing elsewhere.",
        "Problem",
    ),
    (
        "count_error",
        "1",
        "lower",
        "Distance of the most probable number of targets after the last round from the true one, over the number of "
        "numbers held possible, mean over the subregions. Of equally probable numbers each is taken as often. A "
        "subregion nobody told of counts with its prior; null when nobody told of any.",
        _MADE_OF,
    ),
    (
        "count_error_wrong",
        "1",
        "lower",
        "Share of subregions whose most probable number of targets is not the true one; ties as in `count_error`.",
        _MADE_OF,
    ),
    (
        "count_distance",
        "1",
        "lower",
        "Distance of the most probable number of targets from the true one, in targets, mean over the subregions; ties as "
        "in `count_error`. Over 2 window + 1 it is the reading of eq 20 that gives every subregion as many states.",
        _MADE_OF,
    ),
    ("count_distance_prior", "1", "lower", "`count_distance` of the prior within its window.", "Problem, TruthCounts"),
    (
        "count_error_prior",
        "1",
        "lower",
        "`count_error` of the prior within its window, with no sensor read and no message sent.",
        f"Problem, TruthCounts; {CHEN_2006}, eq 20",
    ),
    (
        "count_error_prior_wrong",
        "1",
        "lower",
        "`count_error_wrong` of that prior.",
        "Problem, TruthCounts",
    ),
    (
        "count_error_exact",
        "1",
        "lower",
        "`count_error` of the exact marginals given all readings, by elimination; null where a table of more than "
        "2,000,000 entries would be needed.",
        "Problem, TruthCounts",
    ),
    (
        "count_marginal_error_linf",
        "1",
        "lower",
        "Largest absolute difference between a recorded and an exact marginal probability of a number of targets; null "
        "where the exact ones are out of reach, and for max-product.",
        "Marginals, Problem",
    ),
    (
        "count_error_by_round",
        "1",
        "",
        "List: `count_error` after each round in which any node told of a subregion.",
        _MADE_OF,
    ),
)

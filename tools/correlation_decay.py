"""What correlation decay costs in time beside exact sums, belief propagation and enumeration, and what its bounds say.

    python tools/correlation_decay.py
    python tools/correlation_decay.py --instances 5 --depth 10 --budget-s 60 --enumerate

Problems are drawn from a scenario with one sensor that sees everything, by default the six events and 24 measurements of Oh
2010, section VI. Three tables: solvers that have no depth; time, error and growth of Algorithms 1 and 2 level by level; and
the depths that the paper's Theorem 3 asks for, beside those that the certified interval and the error itself need. Times are
processor time, differ from machine to machine, and are means over the instances; a column ends where the next level would
take longer than the budget. Everything else is equal for equal seeds.
"""

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from netsim.errors import ScenarioError
from netsim.kernels.association_bp import propagate
from netsim.kernels.correlation_decay import DecayGraph, literal, normalised, two_factor, vertex_order
from netsim.kernels.decay_bounds import exact_depth, paper_bound, sharp_bound
from netsim.kernels.decay_interval import DecayInterval
from netsim.kernels.matchings import association_probabilities, count_matchings
from netsim.problems.event_association import build
from netsim.rng import Streams
from netsim.scenario.load import load

SCENARIO = Path(__file__).parent.parent / "scenarios" / "oh2010" / "six-events.yaml"
EPSILONS = (0.05, 0.005)
LEAST_S = 0.05
PLAIN_WIDTH = 125
PUBLISHED = {6: 0.007, 9: 0.26}
"""Running time of Algorithm 2 as a share of the enumeration's, by t."""


def factors_as_printed(weights, depth):
    """Algorithm 1 for every vertex, walking every path anew; how many calls it took."""
    graph, calls = DecayGraph(weights), 0

    def factor(vertex, levels, removed):
        nonlocal calls
        calls += 1
        if levels == 0:
            return 1.0
        rest = removed | {vertex}
        terms = (weight * factor(other, levels - 1, rest) for other, weight in graph.edges(vertex) if other not in rest)
        return 1.0 / (1.0 + sum(terms))

    for vertex in range(sum(weights.shape)):
        factor(vertex, depth, frozenset())
    return calls


def factors_kept(weights, depth):
    """The same factors, each kept that was computed once."""
    graph = DecayGraph(weights)
    for vertex in range(sum(weights.shape)):
        graph.factor(vertex, depth)


def literal_in(order):
    """Algorithm 2 with the vertices in an order."""

    def solve(weights, depth):
        graph = DecayGraph(weights)
        return literal(graph, depth, vertex_order(graph, order))

    return solve


def widest(weights, depth):
    """Widest certified interval of a depth."""
    interval = DecayInterval(DecayGraph(weights))
    bounds = [interval.pair(j, k, depth) for j, k in zip(*(each.tolist() for each in np.nonzero(weights)), strict=True)]
    return max((high - low for low, high in bounds), default=0.0)


def enumerate_all(weights):
    """Every association event in turn, event by event; the probabilities of the pairs."""
    choices = [[(j, float(column[j])) for j in np.flatnonzero(column).tolist()] for column in weights.T]
    found = np.zeros(weights.shape).tolist()

    def visit(event, taken, weight):
        if event == len(choices):
            return weight
        total = visit(event + 1, taken, weight)
        for j, factor in choices[event]:
            if not taken >> j & 1:
                below = visit(event + 1, taken | 1 << j, weight * factor)
                found[j][event] += below
                total += below
        return total

    total = visit(0, 0, 1.0)
    return np.array(found) / total


SOLVERS = {
    "Algorithm 1\nevery path": factors_as_printed,
    "Algorithm 1\nkept": factors_kept,
    "Algorithm 2\nmeasurements first": literal_in("measurements_first"),
    "Algorithm 2\nevents first": literal_in("events_first"),
    "two\nfactors": lambda weights, depth: two_factor(DecayGraph(weights), depth),
    "normalised": lambda weights, depth: normalised(DecayGraph(weights), depth),
    "certified\ninterval": widest,
}
"""What has a depth. All but the first keep factors that were computed once; Algorithm 1 stands for those of all vertices."""


@dataclass
class Column:
    """One solver's times and results, level by level.

    Attributes:
        times_s: Mean over the instances.
        errors: Largest errors over the pairs, mean over the instances; for the interval, its width; none for factors.
    """

    times_s: list = field(default_factory=list)
    errors: list = field(default_factory=list)

    def next_s(self):
        """What the next level will take, about: as much more as the last took than the one before, at least twice."""
        if len(self.times_s) < 2:
            return 0.0
        return self.times_s[-1] * max(2.0, self.times_s[-1] / self.times_s[-2])


def timed(work: Callable[[], object]):
    """Mean processor seconds of a call, repeated while it is short, and its result."""
    begun, times = time.process_time(), 0
    while True:
        result, times = work(), times + 1
        spent_s = time.process_time() - begun
        if spent_s >= LEAST_S:
            return spent_s / times, result


def instances(scenario, count):
    """Weights of drawn problems, seeds 1, 2, ..."""
    record = load(scenario, []).scenario
    (left, bottom), sides = record.field.origin_m, (record.field.width_m, record.field.height_m)
    box = (left, bottom, left + sides[0], bottom + sides[1])
    centre = {0: (left + sides[0] / 2, bottom + sides[1] / 2)}
    return [build(record.problem, centre, box, Streams(seed)).instance.weights for seed in range(1, count + 1)]


def measure(solver, problems, exact, depth):
    """Mean time and mean of the largest error or width."""
    found = [timed(lambda weights=weights: solver(weights, depth)) for weights in problems]
    results = [result for _, result in found]
    if isinstance(results[0], np.ndarray):
        results = [float(np.abs(each - truth).max()) for each, truth in zip(results, exact, strict=True)]
    is_number = isinstance(results[0], float)
    return float(np.mean([spent_s for spent_s, _ in found])), float(np.mean(results)) if is_number else math.nan


def level_by_level(problems, exact, depth, budget_s):
    """A column for each solver."""
    columns = {name: Column() for name in SOLVERS}
    for level in range(1, depth + 1):
        for name, column in columns.items():
            if len(column.times_s) == level - 1 and column.next_s() <= budget_s:
                spent_s, error = measure(SOLVERS[name], problems, exact, level)
                column.times_s.append(spent_s)
                column.errors.append(error)
    return columns


def text(seconds):
    """A time in its unit."""
    return f"{seconds:.1f} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def solver_table(problems, exact, with_enumeration):
    """Solvers without a depth; the exact and the enumerator's mean time."""
    table = Table("solver", "time", "L_inf error", title="Without a depth")
    exact_s = float(np.mean([timed(lambda w=w: association_probabilities(w))[0] for w in problems]))
    table.add_row("exact, sums over sets of events", text(exact_s), "0")
    rounds = [timed(lambda w=w: propagate(w)) for w in problems]
    error = np.mean([np.abs(found.probabilities - p).max() for (_, found), p in zip(rounds, exact, strict=True)])
    table.add_row("loopy belief propagation", text(float(np.mean([spent_s for spent_s, _ in rounds]))), f"{error:.2g}")
    enumeration_s = None
    if with_enumeration:
        found = [timed(lambda w=w: enumerate_all(w)) for w in problems]
        enumeration_s = float(np.mean([spent_s for spent_s, _ in found]))
        error = max(np.abs(each - p).max() for (_, each), p in zip(found, exact, strict=True))
        table.add_row("enumeration of association events", text(enumeration_s), f"{error:.0e}")
    return table, exact_s, enumeration_s


def level_tables(columns):
    """Time with growth, and error, by level."""
    times = Table("t", title="Time, and growth over the level before")
    errors = Table("t", title="L_inf error, and widest certified interval")
    for name, column in columns.items():
        times.add_column(name, justify="right")
        if not all(map(math.isnan, column.errors)):
            errors.add_column(name, justify="right")
    for level in range(max(len(column.times_s) for column in columns.values())):
        times.add_row(str(level + 1), *(_time_cell(column, level) for column in columns.values()))
        shown = [column for column in columns.values() if not all(map(math.isnan, column.errors))]
        errors.add_row(str(level + 1), *(f"{c.errors[level]:.2g}" if level < len(c.errors) else "" for c in shown))
    return times, errors


def _time_cell(column, level):
    if level >= len(column.times_s):
        return ""
    growth = f" x{column.times_s[level] / column.times_s[level - 1]:.1f}" if level else ""
    return text(column.times_s[level]) + growth


def depth_table(problems, exact):
    """Depths that bounds ask for, and that do; ranges over the instances."""
    table = Table("depth t for", *(f"{epsilon:g}" for epsilon in EPSILONS), title="Which depth is enough")
    rows = {
        "Theorem 3, |log ratio|": lambda w, _, e: paper_bound(w).depth_for(e),
        "without the spread of the weights": lambda w, _, e: sharp_bound(w).depth_for(e),
        "the same, estimates of two factors": lambda w, _, e: sharp_bound(w).depth_for(e, factors=2),
        "exact, whatever the weights": lambda w, _, __: exact_depth(w),
        "certified interval that narrow": lambda w, _, e: least(lambda t: widest(w, t), e),
        "normalised form that close": lambda w, p, e: least(
            lambda t: float(np.abs(normalised(DecayGraph(w), t) - p).max()), e
        ),
    }
    for name, depth in rows.items():
        found = [[depth(w, p, epsilon) for w, p in zip(problems, exact, strict=True)] for epsilon in EPSILONS]
        table.add_row(name, *(_range(each) for each in found))
    return table


def least(error, bound):
    """The first depth with an error within a bound."""
    depth = 1
    while error(depth) > bound:
        depth += 1
    return depth


def _range(numbers):
    low, high = min(numbers), max(numbers)
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def verdicts(columns, exact_s, enumeration_s):
    """Algorithm 2's time as a share of exact sums, beside the published share of an enumeration."""
    column = columns["Algorithm 2\nmeasurements first"]
    for level, share in PUBLISHED.items():
        if level <= len(column.times_s):
            spent_s = column.times_s[level - 1]
            line = f"Algorithm 2 at t = {level}: {text(spent_s)}, {spent_s / exact_s:,.0f} times the exact sums"
            line += f", {spent_s / enumeration_s:.0%} of the enumeration" if enumeration_s else ""
            yield f"{line} (published: {share:.1%} of an enumeration of 40,000 s)."


def from_one(text):
    """A whole number from 1 on."""
    if not text.isdecimal() or int(text) < 1:
        message = f"expected a whole number from 1 on, got {text}"
        raise argparse.ArgumentTypeError(message)
    return int(text)


def arguments():
    """What was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=from_one, default=2, help="how many problems (2)")
    parser.add_argument("--depth", type=from_one, default=8, help="highest t (8)")
    parser.add_argument("--budget-s", type=float, default=2.0, help="longest that one level may take, an instance (2)")
    parser.add_argument(
        "--enumerate", action="store_true", help="also visit every association event: seconds an instance"
    )
    parser.add_argument("--scenario", type=Path, default=SCENARIO, help="with an event-association problem")
    options = parser.parse_args()
    try:
        kind = load(options.scenario, []).scenario.problem.type
    except ScenarioError as error:
        parser.error(str(error))
    if kind != "event-association":
        parser.error(f"{options.scenario}: expected a problem of type event-association, got {kind}")
    return options


def main():
    """Print the tables."""
    options, console = arguments(), Console()
    if not console.is_terminal:
        console = Console(width=PLAIN_WIDTH)
    problems = instances(options.scenario, options.instances)
    exact = [association_probabilities(weights) for weights in problems]
    counts = ", ".join(f"{count_matchings(weights):,}" for weights in problems)
    console.print(f"{len(problems)} instances of {problems[0].shape[1]} events and {problems[0].shape[0]} measurements")
    console.print(f"association events: {counts} (the paper's: 8,517,625)\n")
    table, exact_s, enumeration_s = solver_table(problems, exact, options.enumerate)
    console.print(table)
    columns = level_by_level(problems, exact, options.depth, options.budget_s)
    for each in level_tables(columns):
        console.print(each)
    console.print(depth_table(problems, exact))
    for line in verdicts(columns, exact_s, enumeration_s):
        console.print(line)


if __name__ == "__main__":
    main()

"""Scores the adaptive tolerance against the best fixed one in hindsight: python tools/adaptive_tolerance.py --help.

Data association of Chen et al. 2006, section VI-A, at several densities, noise levels and frame-loss rates; drawn prior
means, variances as totals, `first_round: init`, 15 rounds. For each cell the hindsight tolerance is the largest whose mean
error is at most one standard error above max-product's, chosen on the problems of one seed; then it, max-product and the
adaptive rule run on the problems of another. Links are ideal but for losing each frame with the given probability; the
messages of one node to another in one round are one frame. The measurements are known where they are needed. A problem
that is refused for its size (two sensors that share very many targets) is left out, for all rules alike.
"""

import argparse
import csv
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.kernels.adaptive_tolerance import AdaptiveTolerance
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.central import run_synchronous
from netsim.kernels.communication import CommunicationRule
from netsim.kernels.semiring import Semiring
from netsim.kernels.sensor_vertex import SensorVertex
from netsim.kernels.vertex import Vertex
from netsim.problems.association import AssociationParameters, AssociationProblem, UniformTargets, build
from netsim.rng import Streams

SENSORS_M = np.array([(5.0 * column, 5.0 * row) for row in range(5) for column in range(5)])
TARGETS, NOISE, LOSS = (17, 33, 54), (0.05, 0.1, 0.2, 0.4), (0.0, 0.1, 0.2, 0.3)
TOLERANCES = (0.0, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)
ROUNDS = 15
WITHIN, MESSAGES = 1.0, 1.1  # standard errors of the error; times the messages of the hindsight tolerance

Cell = tuple[int, float, float]
Lost = Callable[[int, int, int], bool]
Scores = NDArray[np.float64]  # the last axis: error, messages per sensor


@dataclass(frozen=True)
class Verdict:
    """One cell: mean error and messages per sensor of max-product, of the hindsight tolerance and of the adaptive rule.

    Attributes:
        cell: Targets, noise, loss.
        tolerance: The one chosen in hindsight; None when none was within a standard error: max-product itself.
        problems: How many were scored.
        error: The three mean errors.
        standard_error: Of max-product's mean error.
        difference_se: Standard error of the paired difference adaptive less max-product.
        messages: The three mean counts.
    """

    cell: Cell
    tolerance: float | None
    problems: int
    error: tuple[float, float, float]
    standard_error: float
    difference_se: float
    messages: tuple[float, float, float]

    @property
    def excess(self) -> float:
        """Error above max-product's in its standard errors."""
        return (self.error[2] - self.error[0]) / self.standard_error

    @property
    def hindsight_excess(self) -> float:
        """The same of the hindsight tolerance, on the problems that it was not chosen on."""
        return (self.error[1] - self.error[0]) / self.standard_error

    @property
    def ratio(self) -> float:
        """Messages over those of the hindsight tolerance."""
        return self.messages[2] / self.messages[1]

    @property
    def passes(self) -> tuple[bool, bool]:
        """Whether the error and the messages are within bounds."""
        return self.excess <= WITHIN, self.ratio <= MESSAGES


def problem(targets: int, noise: float, streams: Streams) -> AssociationProblem:
    """One random problem of a cell."""
    parameters = AssociationParameters(
        targets=UniformTargets(count=targets), prior_mean="drawn", measurement_variance_ratio=noise, variance="total"
    )
    return build(parameters, SENSORS_M, range(len(SENSORS_M)), streams)


def scores(cell: Cell, rules: Sequence[CommunicationRule], seed: int, repetition: int) -> Scores | None:
    """Error and messages per sensor of each rule, shape (rules, 2); all meet the same problem and the same lost frames.

    None for a problem that is refused for its size.
    """
    targets, noise, loss = cell
    streams = Streams(seed, repetition)
    drawn = problem(targets, noise, streams)
    try:
        vertices = instance_vertices(drawn.instance)
    except ScenarioError:
        return None
    named = ((drawn.instance.target_vertex_id(t), host) for t, host in enumerate(drawn.instance.hosts))
    hosts = {v: v for v in range(len(SENSORS_M))} | {v: h for v, h in named if v is not None and h is not None}
    chances = streams.generator("loss").random((ROUNDS + 1, len(SENSORS_M), len(SENSORS_M)))
    lost = partial(_is_lost, chances, hosts, loss)
    return np.array([_score(drawn, vertices, rule, lost, loss == 0.0) for rule in rules])


def _score(
    drawn: AssociationProblem, vertices: Sequence[Vertex], rule: CommunicationRule, lost: Lost, may_stop: bool
) -> tuple[float, float]:
    """Error and messages per sensor of one run; standard message passing sends in all rounds."""
    stop = may_stop and not rule.sends_always
    result = run_synchronous(vertices, Semiring.MAX, ROUNDS, rule, stop_when_converged=stop, lost=lost)
    sensors = [vertex for vertex in vertices if isinstance(vertex, SensorVertex)]
    wrong = sum(int((each.decide(result.incoming[each.id]) != drawn.origins[each.id]).sum()) for each in sensors)
    return wrong / sum(map(len, drawn.origins)), result.messages_sent / len(SENSORS_M)


def _is_lost(chances: Scores, hosts: dict[int, int], loss: float, number: int, source: int, destination: int) -> bool:
    here, there = hosts[source], hosts[destination]
    return here != there and bool(chances[number, here, there] < loss)


class Trials:
    """Runs rules on the problems of one seed.

    Args:
        pool: Where.
        seed: Of the problems.
        repetitions: How many a cell.
    """

    def __init__(self, pool: ProcessPoolExecutor, seed: int, repetitions: int) -> None:
        self._pool, self._seed, self._repetitions = pool, seed, repetitions

    def run(self, cell: Cell, *rules: CommunicationRule) -> Scores:
        """Scores of the rules, shape (problems, rules, 2)."""
        trial = partial(scores, cell, rules, self._seed)
        return np.array([table for table in self._pool.map(trial, range(self._repetitions)) if table is not None])


def hindsight(trials: Trials, cell: Cell) -> float | None:
    """The largest of `TOLERANCES` with an error at most one standard error above max-product's, found by bisection."""
    standard = trials.run(cell, CommunicationRule())[:, 0, 0]
    bound = standard.mean() + WITHIN * _standard_error(standard)
    good, bad = -1, len(TOLERANCES)
    while bad - good > 1:
        middle = (good + bad) // 2
        error = trials.run(cell, CommunicationRule(tolerance=TOLERANCES[middle]))[:, 0, 0].mean()
        good, bad = (middle, bad) if error <= bound else (good, middle)
    return None if good < 0 else TOLERANCES[good]


def judge(trials: Trials, cell: Cell, tolerance: float | None) -> Verdict:
    """Max-product, hindsight tolerance and adaptive rule on fresh problems."""
    rules = CommunicationRule(), CommunicationRule(tolerance=tolerance), CommunicationRule(adaptive=AdaptiveTolerance())
    table = trials.run(cell, *rules)
    error, messages = table[:, :, 0], table[:, :, 1]
    return Verdict(
        cell,
        tolerance,
        len(table),
        tuple(error.mean(axis=0).tolist()),
        _standard_error(error[:, 0]),
        _standard_error(error[:, 2] - error[:, 0]),
        tuple(messages.mean(axis=0).tolist()),
    )


def _standard_error(values: Scores) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values)))


def table_of(verdicts: Sequence[Verdict]) -> list[list[str]]:
    """The verdicts as rows of text, the heading first."""
    heading = ["targets", "noise", "loss", "hindsight tolerance", "problems", "error max-product", "SE", "error hindsight",
               "error adaptive", "excess / SE", "messages max-product", "messages hindsight", "messages adaptive", "ratio",
               "error ok", "messages ok"]  # fmt: skip
    rows = [heading]
    for each in verdicts:
        targets, noise, loss = each.cell
        tolerance = "none" if each.tolerance is None else f"{each.tolerance:g}"
        marks = ["yes" if good else "NO" for good in each.passes]
        named = [str(targets), f"{noise:g}", f"{loss:g}", tolerance, str(each.problems)]
        standard, *errors = (f"{value:.3f}" for value in each.error)
        errors = [standard, f"{each.standard_error:.3f}", *errors, f"{each.excess:+.2f}"]
        counts = [f"{value:.1f}" for value in each.messages]
        rows.append([*named, *errors, *counts, f"{each.ratio:.2f}", *marks])
    return rows


def draw(verdicts: Sequence[Verdict], path: Path) -> None:
    """Error and messages against the bounds, a panel a density, a colour a noise level, loss along the axis."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    densities = sorted({each.cell[0] for each in verdicts})
    size = (1.5 + 3.2 * len(densities), 6.2)
    figure, axes = plt.subplots(
        2, len(densities), figsize=size, sharex=True, sharey="row", layout="constrained", squeeze=False
    )
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(NOISE)))
    for column, targets in enumerate(densities):
        for noise, colour in zip(NOISE, colours, strict=True):
            cells = [each for each in verdicts if each.cell[:2] == (targets, noise)]
            loss = [each.cell[2] for each in cells]
            style = {"color": colour, "marker": "o", "label": f"noise {noise:g}"}
            axes[0, column].plot(loss, [each.excess for each in cells], **style)
            axes[1, column].plot(loss, [each.ratio for each in cells], **style)
        axes[0, column].set_title(f"{targets} targets")
        axes[0, column].axhline(WITHIN, color="black", linestyle="--", linewidth=1)
        axes[1, column].axhline(MESSAGES, color="black", linestyle="--", linewidth=1)
        axes[1, column].set_xlabel("share of frames lost")
        axes[1, column].set_xticks(LOSS)
    axes[1, 0].set_ylim(bottom=0.0)
    axes[0, 0].set_ylabel("error above max-product's,\nin its standard errors")
    axes[1, 0].set_ylabel("messages over those of the\nhindsight tolerance")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(NOISE))
    figure.suptitle("Adaptive tolerance: at or below the dashed lines is within the bounds", fontsize=11)
    figure.savefig(path, dpi=130)


def main() -> None:
    """Run, print the table, write it and its picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--repetitions", type=int, default=50, help="problems a cell, for choosing and for scoring each"
    )
    parser.add_argument(
        "--choose-seed", type=int, default=101, help="of the problems the hindsight tolerance is chosen on"
    )
    parser.add_argument("--score-seed", type=int, default=202, help="of the problems that are scored")
    parser.add_argument("--targets", type=int, nargs="+", default=TARGETS, help="densities")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, default=Path("adaptive"), help="stem of the .csv and .png written")
    options = parser.parse_args()
    if options.choose_seed == options.score_seed:
        parser.error("--choose-seed and --score-seed must differ: a tolerance is not to be scored where it was chosen")
    verdicts = []
    with ProcessPoolExecutor(options.jobs) as pool:
        chosen_on, scored_on = (
            Trials(pool, seed, options.repetitions) for seed in (options.choose_seed, options.score_seed)
        )
        for cell in product(options.targets, NOISE, LOSS):
            verdicts.append(judge(scored_on, cell, hindsight(chosen_on, cell)))
            print(" | ".join(table_of(verdicts)[-1]), file=sys.stderr, flush=True)
    rows = table_of(verdicts)
    with options.out.with_suffix(".csv").open("w", newline="") as stream:
        csv.writer(stream).writerows(rows)
    draw(verdicts, options.out.with_suffix(".png"))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    both = sum(all(each.passes) for each in verdicts)
    print(f"both bounds kept in {both} of {len(verdicts)} cells", file=sys.stderr)


if __name__ == "__main__":
    main()

"""Measures how near identity matrices come to the exact posterior: python tools/identity_agreement.py --help.

Histories as tracking makes them: pairs of M targets meet one after another and come apart swapped or not, each with
probability 1/2; between meetings a classifier that is right with a known probability names the target of one track, its
mistakes spread evenly over the others. After every step the matrix is compared with the exact posterior's marginals. Beside
the update that keeps the row of the evidence (`matrix`) stands the one that scales all rows alike (`all scaled`).

Columns: mean absolute error of the entries, the largest, the share of tracks whose most probable target is the same
(within rounding), and the probability given to the true target, with the exact posterior's beside it.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from netsim.kernels.fitting import fitted
from netsim.kernels.identity import EVEN_PAIR, ExactIdentity, evidence, exact_start, mix, posterior, unmixed
from netsim.rng import Streams

Matrix = NDArray[np.float64]
TIE = 1e-6


@dataclass(frozen=True)
class Agreement:
    """Sums over compared matrices; divide by `compared`.

    Attributes:
        compared: How many.
        error: Of mean absolute errors.
        worst: The largest absolute error of an entry; no sum.
        same: Of the shares of tracks with the same most probable target.
        on_truth: Of the mean probabilities of the true targets.
    """

    compared: int = 0
    error: float = 0.0
    worst: float = 0.0
    same: float = 0.0
    on_truth: float = 0.0

    def with_one(self, found: Matrix, exact: Matrix, truth: NDArray[np.int64]) -> "Agreement":
        """With one more matrix."""
        off = np.abs(found - exact)
        tracks = np.arange(len(truth))
        same = exact[tracks, found.argmax(axis=1)] >= exact.max(axis=1) - TIE
        return Agreement(
            self.compared + 1,
            self.error + float(off.mean()),
            max(self.worst, float(off.max())),
            self.same + float(same.mean()),
            self.on_truth + float(found[tracks, truth].mean()),
        )


def all_scaled(identities: Matrix, row: int, likelihood: Matrix) -> Matrix:
    """Evidence by plain Sinkhorn scaling: the row takes part in it."""
    updated = identities.copy()
    updated[row] = posterior(identities[row], likelihood)
    found = fitted(updated, np.ones(len(updated)), np.ones(len(updated)))
    return updated if found is None else found


def follow(
    targets: int, steps: int, evidence_share: float, accuracy: float, rng: np.random.Generator, sums: list[Agreement]
) -> list[Agreement]:
    """One history; the sums of the matrix, of the one with all rows scaled and of the exact posterior with it."""
    truth = np.arange(targets)
    kept, scaled, exact = unmixed(targets), unmixed(targets), exact_start(targets)
    for _ in range(steps):
        if rng.random() < evidence_share:
            row = int(rng.integers(targets))
            likelihood = told(int(truth[row]), targets, accuracy, rng)
            kept, scaled = evidence(kept, row, likelihood), all_scaled(scaled, row, likelihood)
            exact: ExactIdentity = exact.evidence(row, likelihood)
        else:
            pair = [int(track) for track in rng.choice(targets, 2, replace=False)]
            if rng.random() < EVEN_PAIR:
                truth[pair] = truth[pair[::-1]]
            kept, scaled, exact = mix(kept, pair, EVEN_PAIR), mix(scaled, pair, EVEN_PAIR), exact.mix(pair, EVEN_PAIR)
        right = exact.marginals()
        sums = [one.with_one(found, right, truth) for one, found in zip(sums, (kept, scaled, right), strict=True)]
    return sums


def told(target: int, targets: int, accuracy: float, rng: np.random.Generator) -> Matrix:
    """The likelihood of what the classifier says of a target."""
    named = target if rng.random() < accuracy else int(rng.choice([t for t in range(targets) if t != target]))
    likelihood = np.full(targets, (1.0 - accuracy) / (targets - 1))
    likelihood[named] = accuracy
    return likelihood


def measure(targets: int, options: argparse.Namespace) -> list[Agreement]:
    """The sums for so many targets over all histories."""
    sums = [Agreement(), Agreement(), Agreement()]
    for repetition in range(options.histories):
        rng = Streams(options.seed, repetition).generator(f"histories/{targets}")
        sums = follow(targets, options.steps, options.evidence_share, options.accuracy, rng, sums)
    return sums


def options_of(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The command's options."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", type=int, nargs="+", default=[2, 3, 4, 5, 6], help="numbers of targets, to 8")
    parser.add_argument("--histories", type=int, default=200)
    parser.add_argument("--steps", type=int, default=30, help="meetings and pieces of evidence in a history")
    parser.add_argument("--evidence-share", type=float, default=0.5)
    parser.add_argument("--accuracy", type=float, default=0.94, help="of the classifier")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Prints the table."""
    options = options_of(arguments)
    print(
        f"{'M':>2}  {'update':10}  {'mean error':>10}  {'largest':>8}  {'same best':>9}  {'on truth':>8}  {'exact':>6}"
    )
    for targets in options.targets:
        *matrices, exact = measure(targets, options)
        for name, one in zip(("matrix", "all scaled"), matrices, strict=True):
            count = one.compared
            print(
                f"{targets:>2}  {name:10}  {one.error / count:10.4f}  {one.worst:8.3f}  {one.same / count:9.3f}"
                f"  {one.on_truth / count:8.3f}  {exact.on_truth / count:6.3f}"
            )


if __name__ == "__main__":
    main()

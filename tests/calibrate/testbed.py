"""A made-up testbed: nodes in a field, frames sent, what was received, written as a log."""

from pathlib import Path

import numpy as np

from netsim.models.reception import frame_success_probability

EXPONENT, LOSS_DB, SHADOWING_DB, ASYMMETRY_DB, NOISE_DBM = 2.8, 43.0, 5.0, 2.0, -96.0
FRAME_BYTE = 60


class Testbed:
    """Links of a field drawn with the parameters above.

    Args:
        seed: Of everything.
        nodes: How many.
        frames: Sent by each node to each other one.
        ceiling: What strong links receive.
    """

    __test__ = False

    def __init__(self, seed: int, nodes: int = 36, frames: int = 100, ceiling: float = 1.0, floor_dbm: float = -np.inf):
        generator = np.random.default_rng(seed)
        self.where = generator.uniform(0.0, 120.0, (nodes, 2))
        i, j = np.triu_indices(nodes, 1)
        distance = np.hypot(*(self.where[i] - self.where[j]).T)
        loss = LOSS_DB + 10.0 * EXPONENT * np.log10(distance) + generator.normal(0.0, SHADOWING_DB, len(i))
        half = 0.5 * generator.normal(0.0, ASYMMETRY_DB, len(i))
        self.source, self.destination = np.concatenate([i, j]), np.concatenate([j, i])
        self.distance_m = np.tile(distance, 2)
        self.power_dbm = np.concatenate([-loss - half, -loss + half])
        snr = 10.0 ** ((self.power_dbm - NOISE_DBM) / 10.0)
        self.sent = np.full(len(snr), frames)
        ratio = ceiling * np.asarray(frame_success_probability(snr, 8 * (FRAME_BYTE + 1)))
        self.received = generator.binomial(self.sent, ratio)
        self.reported_dbm = np.maximum(self.power_dbm, floor_dbm)

    def write_positions(self, path: Path) -> Path:
        """The file of positions."""
        rows = [f"{number},{x!r},{y!r}" for number, (x, y) in enumerate(self.where.tolist())]
        path.write_text("\n".join(["id,x_m,y_m", *rows]) + "\n", encoding="utf-8")
        return path

    def write_counts(self, path: Path, listed_only: bool = False, distances: bool = False) -> Path:
        """A row a link with counts; links that received nothing are listed with no power, or not at all."""
        lines = ["source,destination,rssi_dbm,sent,received" + (",distance_m" if distances else "")]
        for row in range(len(self.sent)):
            if listed_only and not self.received[row]:
                continue
            power = f"{self.reported_dbm[row]:.6f}" if self.received[row] else ""
            line = f"{self.source[row]},{self.destination[row]},{power},{self.sent[row]},{self.received[row]}"
            lines.append(line + (f",{self.distance_m[row]:.6f}" if distances else ""))
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    def write_frames(self, path: Path) -> Path:
        """A row a frame."""
        lines = ["source,destination,rssi_dbm,received"]
        for row in range(len(self.sent)):
            ends = f"{self.source[row]},{self.destination[row]}"
            lines += [f"{ends},{self.reported_dbm[row]:.6f},1"] * int(self.received[row])
            lines += [f"{ends},,0"] * int(self.sent[row] - self.received[row])
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

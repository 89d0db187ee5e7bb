"""Background noise at each receiver: constant, or changing in steps of equal length.

Asking changes nothing: the noise of a node in a step depends on the run's streams, the node and the step alone, and steps
may be asked for in any order.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from netsim.models.noise_file import read_noise
from netsim.parameters import Name, NonNegative, Positive, parameters
from netsim.rng import Streams
from netsim.units import s_to_ns

Floats = NDArray[np.float64]

BLOCK_STEPS = 256
"""Steps of Gaussian noise that are drawn at once."""
QUIET_SD = 3.0
"""Gaussian noise this many deviations below its mean is as quiet as links are laid out for."""
QUIET_SHARE = 0.001
"""Likewise the share of replayed readings that may be quieter."""


class Noise(Protocol):
    """Noise powers of all nodes, ascending by id.

    Attributes:
        step_ns: Length of a step of constant noise; None if it never changes.
        typical_mw: (N,) what link qualities are computed with: the median over time.
    """

    @property
    def step_ns(self) -> int | None:
        """Length of a step of constant noise; None if it never changes."""
        ...

    @property
    def typical_mw(self) -> Floats:
        """(N,) median over time, in mW: what link qualities are computed with."""
        ...

    def power_mw(self, step: int) -> Floats:
        """(N,) noise powers during [step * step_ns, (step + 1) * step_ns), in mW; step 0 where it never changes."""
        ...


@parameters
class ConstantNoiseParameters:
    """Noise that never changes."""

    type: Literal["constant"] = "constant"
    """Selects this kind of noise."""


@parameters
class GaussianNoiseParameters:
    """Noise that is normal in dB about each node's level, drawn anew every step, each node on its own."""

    type: Literal["gaussian"] = "gaussian"
    """Selects this kind of noise."""
    sd_db: NonNegative = 4.0
    """Standard deviation; 4 dB is the white noise of TOSSIM's topology generator."""
    step_s: Positive = 1e-3
    """How long a drawn value holds; a shorter step averages more values over a frame."""


@parameters
class ReplayedNoiseParameters:
    """Measured noise, replayed in a circle; each node begins at its own drawn place.

    Where TOSSIM learns a Markov-like model (closest-pattern matching) from such a file, the readings themselves are played
    back here: their bursts and their order are those that were measured.
    """

    type: Literal["replayed"] = "replayed"
    """Selects this kind of noise."""
    file: Name
    """Readings in dBm, one a line, relative to the scenario; such as TOSSIM's `meyer-heavy.txt`."""
    step_s: Positive = 1e-3
    """Time between two readings; TOSSIM takes one a millisecond from such files."""
    median_dbm: float | None = None
    """Shift all readings so that their median is this; by default they stay as recorded."""


NoiseParameters = ConstantNoiseParameters | GaussianNoiseParameters | ReplayedNoiseParameters


@dataclass(frozen=True, slots=True, eq=False)
class ConstantNoise:
    """Noise that never changes; receivers may differ.

    Attributes:
        typical_mw: (N,) noise powers.
    """

    typical_mw: Floats

    @property
    def step_ns(self) -> None:
        """See `Noise.step_ns`."""
        return

    def power_mw(self, step: int) -> Floats:
        """See `Noise.power_mw`."""
        return self.typical_mw


@dataclass(frozen=True, slots=True, eq=False)
class GaussianNoise:
    """Noise that is normal in dB and drawn anew every step; block b of a node comes from `node/<id>/noise/<b>`.

    Attributes:
        level_dbm: (N,) means, and medians, in dBm.
        sd_db: (N,) standard deviations.
        step_ns: Length of a step.
        ids: The nodes' ids, ascending.
        streams: The run's random streams.
    """

    level_dbm: Floats
    sd_db: Floats
    step_ns: int
    ids: tuple[int, ...]
    streams: Streams
    _blocks: dict[int, Floats] = field(default_factory=dict, init=False)

    @property
    def typical_mw(self) -> Floats:
        """See `Noise.typical_mw`."""
        return _to_mw(self.level_dbm)

    def power_mw(self, step: int) -> Floats:
        """See `Noise.power_mw`."""
        number, within = divmod(step, BLOCK_STEPS)
        block = self._blocks.get(number)
        if block is None:
            block = self._draw(number)
            while len(self._blocks) > 1:
                del self._blocks[next(iter(self._blocks))]
            self._blocks[number] = block
        powers: Floats = block[within]
        return powers

    def _draw(self, number: int) -> Floats:
        drawn = np.empty((BLOCK_STEPS, len(self.ids)))
        for index, node in enumerate(self.ids):
            drawn[:, index] = self.streams.generator(f"node/{node}/noise/{number}").standard_normal(BLOCK_STEPS)
        return _to_mw(self.level_dbm + self.sd_db * drawn)


@dataclass(frozen=True, slots=True, eq=False)
class ReplayedNoise:
    """Readings played back in a circle, from a place of each node's own.

    Attributes:
        readings_mw: (M,) noise powers, one a step.
        start: (N,) position of each node's first reading.
        factor: (N,) by which each node's readings are multiplied.
        step_ns: Length of a step.
    """

    readings_mw: Floats
    start: NDArray[np.int64]
    factor: Floats
    step_ns: int

    @property
    def typical_mw(self) -> Floats:
        """See `Noise.typical_mw`."""
        typical: Floats = np.median(self.readings_mw) * self.factor
        return typical

    def power_mw(self, step: int) -> Floats:
        """See `Noise.power_mw`."""
        powers: Floats = self.readings_mw[(self.start + step) % len(self.readings_mw)] * self.factor
        return powers


class Background(NamedTuple):
    """Noise, and what of it links are laid out for.

    Attributes:
        noise: The noise.
        typical_dbm: (N,) its median over time.
        quiet_dbm: (N,) as low as it commonly gets: what might be decoded, or disturb, in a quiet moment is a link.
    """

    noise: Noise
    typical_dbm: Floats
    quiet_dbm: Floats


def gaussian_background(
    level_dbm: Floats, sd_db: Floats, step_s: float, ids: Sequence[int], streams: Streams
) -> Background:
    """Gaussian noise about (N,) levels with (N,) deviations; constant where all deviations are 0.

    Args:
        level_dbm: Means.
        sd_db: Standard deviations.
        step_s: Length of a step.
        ids: Ids of the nodes, ascending.
        streams: The run's random streams.
    """
    if not np.any(sd_db):
        return Background(ConstantNoise(_to_mw(level_dbm)), level_dbm, level_dbm)
    noise = GaussianNoise(level_dbm, sd_db, max(1, s_to_ns(step_s)), tuple(ids), streams)
    return Background(noise, level_dbm, level_dbm - QUIET_SD * sd_db)


def background(
    parameters: NoiseParameters,
    noise_dbm: float,
    offset_db: Floats,
    ids: Sequence[int],
    streams: Streams,
    folder: Path,
) -> Background:
    """The noise that a scenario asks for.

    Args:
        parameters: Its kind.
        noise_dbm: Its level, where it is not replayed.
        offset_db: (N,) how far each node's receiver lies above that.
        ids: Ids of the nodes, ascending.
        streams: The run's random streams; a replay's place comes from `node/<id>/noise`.
        folder: What a file is relative to.

    Raises:
        ScenarioError: For a file of readings that is missing or wrong.
    """
    level_dbm = noise_dbm + offset_db
    if isinstance(parameters, ReplayedNoiseParameters):
        return _replayed(parameters, offset_db, ids, streams, folder)
    sd_db = parameters.sd_db if isinstance(parameters, GaussianNoiseParameters) else 0.0
    step_s = parameters.step_s if isinstance(parameters, GaussianNoiseParameters) else 1.0
    return gaussian_background(level_dbm, np.full(len(ids), sd_db), step_s, ids, streams)


def _replayed(
    parameters: ReplayedNoiseParameters, offset_db: Floats, ids: Sequence[int], streams: Streams, folder: Path
) -> Background:
    readings_dbm = read_noise(folder / parameters.file)
    if parameters.median_dbm is not None:
        readings_dbm = readings_dbm + (parameters.median_dbm - np.median(readings_dbm))
    begin = [int(streams.generator(f"node/{node}/noise").integers(len(readings_dbm))) for node in ids]
    start = np.array(begin, np.int64)
    noise = ReplayedNoise(_to_mw(readings_dbm), start, _to_mw(offset_db), max(1, s_to_ns(parameters.step_s)))
    typical_dbm = np.median(readings_dbm) + offset_db
    return Background(noise, typical_dbm, np.quantile(readings_dbm, QUIET_SHARE) + offset_db)


def _to_mw(power_dbm: Floats) -> Floats:
    power_mw: Floats = 10.0 ** (power_dbm / 10.0)
    return power_mw

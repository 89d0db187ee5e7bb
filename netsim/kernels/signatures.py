"""Sound signatures of vehicles, and telling their classes by them (Wu, Siegel and Khosla 1999; Liu et al. 2004, section 6).

An engine's sound is lines at the multiples of its firing rate, with powers that are its class's own. A microphone finds its
power spectrum by averaging periodograms, with noise and with whatever else is near. The classifier takes logarithms of the
spectrum relative to its total, so that distance matters little, projects them on their principal components, and compares
normal densities there. A sound that is like none of the classes, such as two at once, is evidence for none of them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from netsim.kernels.operations import FUNCTION_OPERATIONS
from netsim.kernels.semiring import FloatArray, log_normalise

LabelArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class VehicleSound:
    """The sound of a class of vehicles.

    Attributes:
        base_hz: Firing rate of the engine.
        harmonics: Share of the power at once, twice, ... the rate; they sum to one.
        spread: Standard deviation of a vehicle's rate from `base_hz`, as a share of it.
        unevenness: Standard deviation of the logarithm of each line's power, which goes up and down with the load.
    """

    base_hz: float
    harmonics: tuple[float, ...]
    spread: float = 0.03
    unevenness: float = 0.4

    def drawn(self, rng: np.random.Generator) -> "VehicleSound":
        """One vehicle of the class at one time: what it sounds like exactly."""
        base_hz = self.base_hz * (1.0 + self.spread * rng.standard_normal())
        powers = np.asarray(self.harmonics) * np.exp(self.unevenness * rng.standard_normal(len(self.harmonics)))
        return VehicleSound(base_hz, tuple((powers / powers.sum()).tolist()), 0.0, 0.0)


VEHICLES: Final[Mapping[str, VehicleSound]] = MappingProxyType(
    {
        "car": VehicleSound(62.0, (0.5, 0.3, 0.15, 0.05)),
        "truck": VehicleSound(38.0, (0.2, 0.4, 0.1, 0.2, 0.05, 0.05)),
        "tank": VehicleSound(25.0, (0.1, 0.1, 0.3, 0.1, 0.2, 0.1, 0.05, 0.05)),
    }
)
"""Made-up classes of the kinds that the paper names, with firing rates of idling to middle speed."""


FLOOR: Final = 0.5
"""Share of a spectrum's mean power that is added to each bin, so that the noise between the lines counts for little."""


@dataclass(frozen=True, slots=True)
class SpectrumModel:
    """What a microphone makes of the sounds around it.

    Attributes:
        bins: How many frequencies.
        bin_hz: Their distance; the first is at this frequency.
        line_width_hz: Standard deviation of a line's shape.
        noise_power: Of the noise, over all bins together.
        windows: How many periodograms are averaged (Welch 1967): the relative deviation of a bin is 1 / sqrt(windows).
    """

    bins: int = 64
    bin_hz: float = 5.0
    line_width_hz: float = 4.0
    noise_power: float = 1.0
    windows: int = 8

    @property
    def frequencies_hz(self) -> FloatArray:
        """Of the bins, shape (bins,)."""
        return np.asarray(self.bin_hz * np.arange(1, self.bins + 1), dtype=float)

    def mean(self, sound: VehicleSound) -> FloatArray:
        """Power of a sound in each bin, at a received power of one, shape (bins,)."""
        lines_hz = sound.base_hz * np.arange(1, len(sound.harmonics) + 1)
        away = (self.frequencies_hz[:, None] - lines_hz) / self.line_width_hz
        shape = np.exp(-0.5 * away**2) * (self.bin_hz / (self.line_width_hz * math.sqrt(2.0 * math.pi)))
        return np.asarray(shape @ np.asarray(sound.harmonics))

    def spectrum(self, sources: Sequence[tuple[VehicleSound, float]], rng: np.random.Generator) -> FloatArray:
        """A measured power spectrum of some sounds at once, shape (bins,).

        Args:
            sources: The sounds and the power at which each is received, in the unit of `noise_power`.
            rng: Random numbers: the vehicles' rates and lines, and the noise.
        """
        expected: FloatArray = np.full(self.bins, self.noise_power / self.bins)
        for sound, power in sources:
            expected = expected + power * self.mean(sound.drawn(rng))
        return np.asarray(expected * rng.gamma(self.windows, 1.0 / self.windows, self.bins))

    def examples(
        self,
        sounds: Sequence[VehicleSound],
        count: int,
        powers: tuple[float, float],
        rng: np.random.Generator,
    ) -> tuple[FloatArray, LabelArray]:
        """Single sounds to train a classifier on.

        Args:
            sounds: The classes.
            count: How many examples; each class has as many as the others, or one more.
            powers: Least and greatest received power, above 0; its logarithm is uniform between them.
            rng: Random numbers.

        Returns:
            Their spectra, shape (count, bins), and classes, shape (count,).
        """
        labels = np.arange(count) % len(sounds)
        received = np.exp(rng.uniform(math.log(powers[0]), math.log(powers[1]), count))
        pairs = zip(labels.tolist(), received.tolist(), strict=True)
        spectra = [self.spectrum([(sounds[label], power)], rng) for label, power in pairs]
        return np.stack(spectra), labels


@dataclass(frozen=True, eq=False)
class Classifier:
    """Normal densities of classes over principal components, with one covariance for all.

    Attributes:
        mean: Of the features, shape (F,).
        axes: Principal components, orthonormal rows, shape (components, F).
        centres: Of the classes along them, shape (classes, components).
        whitening: Lower triangle W with W W^T the inverse of the classes' covariance, shape (components, components).
        wide: The same of all examples together, around `mean`: where sounds of none of the classes are expected.
        unknown: Probability beforehand that a sound is of none of the classes, or of several at once.
    """

    mean: FloatArray
    axes: FloatArray
    centres: FloatArray
    whitening: FloatArray
    wide: FloatArray
    unknown: float

    @staticmethod
    def trained(spectra: FloatArray, labels: ArrayLike, components: int, unknown: float = 0.1) -> "Classifier":
        """The classifier that some examples give.

        Args:
            spectra: Power spectra of single sounds, above 0, shape (N, F).
            labels: Their classes, 0 to C - 1, each with two examples or more, shape (N,).
            components: How many principal components; at most F, and less than N - C.
            unknown: As the attribute.

        Raises:
            ValueError: Too few examples of a class or for so many components, or a spectrum with a power that is not
                positive.
        """
        classes = np.asarray(labels, dtype=np.int64)
        count = _checked_count(spectra, classes, components)
        features = log_shape(spectra)
        mean = features.mean(axis=0)
        axes = np.linalg.svd(features - mean, full_matrices=False)[2][:components]
        points = (features - mean) @ axes.T
        centres = np.stack([points[classes == label].mean(axis=0) for label in range(count)])
        off = points - centres[classes]
        within = off.T @ off / (len(points) - count)
        wide = points.T @ points / len(points)
        return Classifier(mean, axes, centres, _whitening(within), _whitening(wide), unknown)

    def probabilities(self, spectrum: FloatArray) -> FloatArray:
        """Of each class for a sound, all classes alike beforehand: shape (classes,), sums to one.

        A sound like none of them leaves them nearly equal.
        """
        point = self.axes @ (log_shape(spectrum) - self.mean)
        count = len(self.centres)
        known = _log_density(point - self.centres, self.whitening) + math.log((1.0 - self.unknown) / count)
        other = _log_density(point[None], self.wide)[0] + (math.log(self.unknown) if self.unknown > 0.0 else -math.inf)
        logs = np.append(known, other)
        shares = np.exp(log_normalise(logs))
        return np.asarray(shares[:-1] + shares[-1] / count)

    def operations(self) -> int:
        """Elementary floating-point operations of `probabilities`."""
        components, bins = (int(size) for size in self.axes.shape)
        classes = len(self.centres)
        return (
            bins * (FUNCTION_OPERATIONS + 3)
            + 2 * components * bins
            + (classes + 1) * (components * (2 * components + 3) + FUNCTION_OPERATIONS + 3)
        )


def _checked_count(spectra: FloatArray, labels: LabelArray, components: int) -> int:
    """How many classes there are."""
    examples = np.bincount(labels)
    if len(examples) < 2 or examples.min() < 2:
        message = f"{examples.tolist()} examples of the classes: expected two classes or more, with two each"
        raise ValueError(message)
    most = min(spectra.shape[1], len(spectra) - len(examples) - 1)
    if not 1 <= components <= most:
        message = (
            f"{components} components: expected 1 to {most} with {len(spectra)} examples of {spectra.shape[1]} bins"
        )
        raise ValueError(message)
    if not (spectra > 0.0).all():
        message = "a power spectrum with a bin that is not above 0: expected positive powers"
        raise ValueError(message)
    return len(examples)


def log_shape(spectra: FloatArray) -> FloatArray:
    """The features: logarithms of power spectra relative to their total, above a floor; shape (..., F)."""
    shares = spectra / spectra.sum(axis=-1, keepdims=True)
    return np.asarray(np.log(shares + FLOOR / spectra.shape[-1]))


def _whitening(covariance: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.cholesky(np.linalg.inv(covariance)))


def _log_density(offsets: FloatArray, whitening: FloatArray) -> FloatArray:
    """Of a normal density at offsets from its mean, shape (n, d), up to a constant that depends on d alone."""
    return np.asarray(np.log(np.diag(whitening)).sum() - 0.5 * ((offsets @ whitening) ** 2).sum(axis=1))


def confident(probabilities: FloatArray, threshold: float = 0.8) -> int | None:
    """The class that a sound is of if its probability exceeds a threshold (section 6), otherwise None."""
    best = int(np.argmax(probabilities))
    return best if probabilities[best] > threshold else None


def identity_likelihood(probabilities: FloatArray, class_of: Sequence[int], mistaken: float = 0.0) -> FloatArray:
    """What a sound tells of who a track is, for `identity.evidence`: for each target the probability of its class.

    Args:
        probabilities: Of the classes, all alike beforehand.
        class_of: Class of each target, shape (M,).
        mistaken: Share of the sounds that are some other vehicle's, of any class alike; above 0 no single sound makes a
            track certain for good.
    """
    blurred = (1.0 - mistaken) * probabilities + mistaken / len(probabilities)
    return np.asarray(blurred[list(class_of)])

"""What sensors tell of the classes of vehicles besides their energy: a spectrum of the sound, or a label."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np
from annotated_types import Gt, Le

from netsim.kernels.energy_sensing import EnergyModel
from netsim.kernels.semiring import FloatArray
from netsim.kernels.signatures import VEHICLES, Classifier, SpectrumModel
from netsim.kernels.vehicle_labels import VehicleLabels, classes_of, label_probabilities
from netsim.parameters import NonNegative, PointM, Positive, parameters
from netsim.rng import Streams

Vehicle = Literal["car", "truck", "tank"]

EXAMPLES: Final = 600
COMPONENTS: Final = 10
MISTAKEN: Final = 0.01
"""Share of the sounds that a track's leader takes for its own target's and that are another's."""
_SPAN_HZ: Final = 320.0


@parameters
class LabelParameters:
    """Sensors that now and then tell the class of the nearest target, such as cameras; not always rightly."""

    accuracy: Annotated[float, Gt(0), Le(1)] = 0.94
    """Probability that a label is right; a wrong one is any other class alike."""
    rate_per_s: NonNegative = 0.2
    """How often a sensor with a target in range gives a label."""
    range_m: Positive = 60.0
    """Greatest distance of a target that is labelled."""


@dataclass(frozen=True, eq=False)
class VehicleSense:
    """What sensors give besides the energy.

    Attributes:
        vehicles: Name of each target's class.
        energy: What a target contributes, in which unit the noise is `noise_sd`.
        spectrum: Of the microphones; None where labels are given.
        labels: How labels come about.
        labels_per_reading: Probability of one at a reading.
        streams: The run's random streams.
    """

    vehicles: tuple[str, ...]
    energy: EnergyModel
    spectrum: SpectrumModel | None
    labels: LabelParameters | None
    labels_per_reading: float
    streams: Streams

    @property
    def knowledge(self) -> VehicleLabels:
        """How a node understands it: the classifier was trained before, on single vehicles of these classes."""
        classes, class_of = classes_of(self.vehicles)
        if self.spectrum is None:
            return VehicleLabels(class_of)
        powers = self.energy.amplitude / np.array([9.0, 1.0]) / self.energy.saturation_m**2
        rng = self.streams.generator("problem/signatures")
        spectra, labels = self.spectrum.examples([VEHICLES[name] for name in classes], EXAMPLES, tuple(powers), rng)
        classifier = Classifier.trained(spectra, labels, min(COMPONENTS, self.spectrum.bins))
        return VehicleLabels(class_of, classifier, MISTAKEN)

    def features(self, place_m: PointM, there: Sequence[tuple[int, PointM]], node: int, reading: int) -> FloatArray:
        """What a sensor reads, shape (bins,) or (classes,); zeros where there is no label.

        Args:
            place_m: Where it is.
            there: Targets that are there, by number, with their places.
            node: Its node.
            reading: Number of the reading: each has noise of its own, the same whoever asks.
        """
        if self.spectrum is not None:
            rng = self.streams.generator(f"node/{node}/spectrum/{reading}")
            sensor = np.array([place_m])
            powers = [float(self.energy.mean(sensor, np.array([at]))[0]) for _, at in there]
            sources = [(VEHICLES[self.vehicles[number]], p) for (number, _), p in zip(there, powers, strict=True)]
            return self.spectrum.spectrum(sources, rng)
        return self._label(place_m, there, self.streams.generator(f"node/{node}/label/{reading}"))

    def _label(self, place_m: PointM, there: Sequence[tuple[int, PointM]], rng: np.random.Generator) -> FloatArray:
        classes, class_of = classes_of(self.vehicles)
        labels = self.labels
        chance, truth, other = rng.random(3)
        near = min(there, key=lambda each: math.dist(place_m, each[1]), default=None)
        if labels is None or near is None or math.dist(place_m, near[1]) > labels.range_m:
            return np.zeros(len(classes))
        if chance >= self.labels_per_reading:
            return np.zeros(len(classes))
        right = class_of[near[0]]
        wrong = [number for number in range(len(classes)) if number != right]
        label = right if truth < labels.accuracy or not wrong else wrong[int(other * len(wrong))]
        return label_probabilities(label, len(classes), labels.accuracy)


def spectrum_of(bins: int, noise_sd: float) -> SpectrumModel:
    """A microphone's spectrum over so many bins, together up to the lines of every class."""
    return SpectrumModel(bins=bins, bin_hz=_SPAN_HZ / bins, noise_power=noise_sd)

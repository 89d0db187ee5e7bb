"""What a sensor's reading tells of a vehicle's class, and so of who a track is (Liu et al. 2004, section 6)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from netsim.kernels.semiring import FloatArray
from netsim.kernels.signatures import Classifier, confident, identity_likelihood


@dataclass(frozen=True, eq=False)
class VehicleLabels:
    """How readings are to be understood; two targets of one class cannot be told apart.

    Attributes:
        class_of: Class of each target, shape (M,).
        classifier: For sensors that give a power spectrum; None where they give the classes' probabilities themselves.
        mistaken: Share of the sounds that are some other vehicle's (see `signatures.identity_likelihood`).
    """

    class_of: tuple[int, ...]
    classifier: Classifier | None = None
    mistaken: float = 0.0

    def likelihood(self, features: FloatArray, threshold: float) -> FloatArray | None:
        """Of each target's being what was read, shape (M,); None where the reading does not tell, or not surely enough.

        Args:
            features: What the sensor gave besides the energy.
            threshold: The confidence from which on a class counts.
        """
        if not features.any():
            return None
        chances = features if self.classifier is None else self.classifier.probabilities(features)
        if confident(chances, threshold) is None:
            return None
        return identity_likelihood(chances, self.class_of, self.mistaken)

    def operations(self) -> int:
        """Elementary floating-point operations of `likelihood`."""
        count = len(self.class_of)
        return 3 * count + (0 if self.classifier is None else self.classifier.operations())


def label_probabilities(label: int, classes: int, accuracy: float) -> FloatArray:
    """Of each class, all alike beforehand, after a label that is right with this probability: shape (classes,)."""
    chances = np.full(classes, (1.0 - accuracy) / max(classes - 1, 1))
    chances[label] = accuracy
    return chances


def classes_of(names: Sequence[str]) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Classes that occur, in alphabetical order, and the number of each target's among them."""
    found = tuple(sorted(set(names)))
    return found, tuple(found.index(name) for name in names)

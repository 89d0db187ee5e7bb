"""Random streams by key: the numbers a stream yields depend on the seed, the repetition and its name, on nothing else.

Adding a node, a log line or another stream moves no other stream, and variants of one scenario meet the same targets,
noise and shadowing (common random numbers).
"""

from dataclasses import dataclass
from hashlib import blake2b

import numpy as np


def _words(name: str) -> tuple[int, ...]:
    digest = blake2b(name.encode(), digest_size=16).digest()
    return tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4))


@dataclass(frozen=True, slots=True)
class Streams:
    """The random streams of one run.

    Attributes:
        seed: The scenario's seed.
        repetition: Which repetition of a study; 0 for a single run.
    """

    seed: int
    repetition: int = 0

    def generator(self, name: str) -> np.random.Generator:
        """A new generator at the start of the stream called `name`, such as `"node/7/backoff"`."""
        sequence = np.random.SeedSequence(self.seed, spawn_key=(self.repetition, *_words(name)))
        return np.random.Generator(np.random.PCG64(sequence))

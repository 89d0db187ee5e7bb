"""What acoustic sensors read of the targets that are there (Liu, Reich, Zhao 2002, eqs 5 and 7)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from netsim.kernels.acoustics import SensorSpec, bearing_rad, wrapped_rad
from netsim.kernels.beamformer import square_m
from netsim.kernels.semiring import FloatArray
from netsim.models.sound import MicrophoneArray, heard, source_spectrum
from netsim.models.tracks import Track
from netsim.rng import Streams


@dataclass(frozen=True, slots=True)
class _Heard:
    """A target at a time, as a sensor has it: number, amplitude at 1 m and at the sensor, offset from the sensor."""

    target: int
    level: float
    amplitude: float
    offset_m: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class AcousticReadings:
    """Sensors and the sources around them.

    Attributes:
        sensors: By node.
        sources: Way of each target, and its rms amplitude at 1 m.
        least_range_m: Ranges below this count as this.
        amplitude_noise_sd: Standard deviation of the noise of amplitudes.
        bearing_noise_sd_rad: Standard deviation of the error of bearings that are drawn.
        microphones: Array of the direction-of-arrival sensors; None if their bearings are drawn.
        reading_ns: A sensor that is read twice within an interval of this length has the same noise.
        streams: Where noise comes from: a reading of node k in interval i from `node/<k>/sensing/<i>`, and where sound
            comes from: that of target n from `world/target/<n>/sound/<i>`.
    """

    sensors: Mapping[int, SensorSpec]
    sources: tuple[tuple[Track, float], ...]
    least_range_m: float
    amplitude_noise_sd: float
    bearing_noise_sd_rad: float
    microphones: MicrophoneArray | None
    reading_ns: int
    streams: Streams

    def of(self, node: int, time_ns: int) -> FloatArray:
        """An amplitude or a bearing in radians from north clockwise, shape (1,), or samples of microphones, shape (4, L).

        Incoherent sources add up in power; a bearing is that of the loudest source at the sensor, and anywhere without one.
        Microphones hear the sum of all sources, as spherical waves from where those are at the time of the reading.
        """
        spec, interval = self.sensors[node], time_ns // self.reading_ns
        rng = self.streams.generator(f"node/{node}/sensing/{interval}")
        if not spec.measures_bearing:
            return np.array([self.loudness(node, time_ns) + self.amplitude_noise_sd * float(rng.standard_normal())])
        if self.microphones is None:
            return np.array([self._bearing(spec, time_ns, rng)])
        return self._samples(spec, time_ns, interval, rng)

    def loudness(self, node: int, time_ns: int) -> float:
        """True rms amplitude at a sensor."""
        return math.hypot(*(source.amplitude for source in self._heard(self.sensors[node], time_ns)))

    def _bearing(self, spec: SensorSpec, time_ns: int, rng: np.random.Generator) -> float:
        error = self.bearing_noise_sd_rad * float(rng.standard_normal())
        anywhere = math.pi * (2.0 * float(rng.random()) - 1.0)
        loudest = max(self._heard(spec, time_ns), key=lambda source: source.amplitude, default=None)
        return float(wrapped_rad(anywhere if loudest is None else float(bearing_rad(loudest.offset_m)) + error))

    def _samples(self, spec: SensorSpec, time_ns: int, interval: int, rng: np.random.Generator) -> FloatArray:
        array = self.microphones or MicrophoneArray()
        places_m = np.asarray(square_m(array.side_m))
        samples = array.noise_sd * rng.standard_normal((len(places_m), array.samples))
        for source in self._heard(spec, time_ns):
            spectrum = source_spectrum(array, self.streams.generator(f"world/target/{source.target}/sound/{interval}"))
            range_m = np.hypot(*(source.offset_m - places_m).T)
            gains = source.level / np.maximum(range_m, self.least_range_m)
            samples += heard(spectrum, array, range_m / array.sound_m_per_s, gains)
        return samples

    def _heard(self, spec: SensorSpec, time_ns: int) -> list[_Heard]:
        """Every target that is there."""
        found = []
        for number, (track, level) in enumerate(self.sources):
            place_m = track.at(time_ns)
            if place_m is not None:
                offset_m = np.subtract(place_m, spec.position_m)
                range_m = max(math.hypot(*offset_m), self.least_range_m)
                found.append(_Heard(number, level, level / range_m, offset_m))
        return found

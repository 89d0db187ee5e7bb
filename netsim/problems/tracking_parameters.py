"""Settings of a tracking problem: what moves, what sensors measure of it, what trackers assume (Liu, Reich, Zhao 2002)."""

from typing import Annotated, Literal

from annotated_types import Ge, MinLen

from netsim.models.sound import MicrophoneArray
from netsim.models.tracks import TrackParameters
from netsim.parameters import NonNegative, NonNegativeInt, Positive, Probability, parameters


@parameters
class AcousticTarget:
    """A sound source that moves."""

    track: TrackParameters
    """Its way."""
    amplitude: Positive = 40.0
    """Rms amplitude at 1 m."""


@parameters
class AssumedAmplitude:
    """What trackers assume of amplitude sensors (eq 6)."""

    low: NonNegative = 0.0
    """Least amplitude of a source at 1 m."""
    high: Positive = 80.0
    """Greatest."""
    noise_sd: Positive = 0.1
    """Standard deviation of the noise; the paper takes twice the true one, for outliers."""
    least_range_m: Positive = 0.5
    """Ranges below this count as this."""


@parameters
class AssumedBearing:
    """What trackers assume of direction-of-arrival sensors (eq 11, Fig. 6)."""

    noise_sd_deg: Annotated[float, Ge(0.1)] = 10.0
    """Standard deviation between the near and the far range."""
    near_m: Positive = 20.0
    """Below this range it grows linearly as the range shrinks."""
    far_m: Positive = 100.0
    """Above this range it grows linearly."""
    noise_sd_at_zero_deg: Annotated[float, Ge(0.1)] = 45.0
    """At range 0; the paper shows no number."""
    growth_deg_per_m: NonNegative = 0.5
    """Beyond the far range; the paper shows no number."""

    def __post_init__(self) -> None:
        """Ranges in order."""
        if self.near_m > self.far_m:
            message = "near_m at most far_m"
            raise ValueError(message)


@parameters
class TrackingParameters:
    """Tracking: nodes with acoustic sensors follow moving sound sources."""

    type: Literal["tracking"] = "tracking"
    """Kind of problem."""
    targets: Annotated[tuple[AcousticTarget, ...], MinLen(1)]
    """What moves."""
    bearing_share: Probability = 0.3
    """Share of the sensors that measure the direction of arrival; the others measure the amplitude."""
    amplitude_noise_sd: NonNegative = 0.05
    """Standard deviation of the true noise of amplitudes."""
    bearings: Literal["drawn", "sampled"] = "drawn"
    """`drawn`: a bearing is the true one with a normal error. `sampled`: the sensor gives the samples of four microphones,
    out of which the node makes a bearing by the beamformer of eqs 7 to 10."""
    bearing_noise_sd_deg: NonNegative = 3.0
    """Standard deviation of the true noise of bearings that are drawn."""
    microphones: MicrophoneArray = MicrophoneArray()
    """Array of a sensor whose bearings are sampled."""
    reading_s: Positive = 0.5
    """Time between two readings; a sensor that is read twice within it has the same noise."""
    amplitude: AssumedAmplitude = AssumedAmplitude()
    """Model of the amplitude sensors."""
    bearing: AssumedBearing = AssumedBearing()
    """Model of the direction-of-arrival sensors."""
    max_speed_m_per_s: Positive = 15.0
    """Greatest speed of a target that trackers assume."""
    cell_m: Positive = 5.0
    """Side of the belief's cells, which cover the field; at most `max_speed_m_per_s` times `reading_s`, since a belief
    moves by whole cells from one reading to the next."""
    neighbourhood_m: Positive = 40.0
    """Range within which nodes hand over to each other."""
    least_neighbours: NonNegativeInt = 2
    """The nearest so many are neighbours whatever their distance."""
    first_leader: Literal["loudest", "none"] = "loudest"
    """`loudest`: the amplitude sensor with the highest reading at time 0 is told that it leads (of all nodes, the one
    at the loudest place, where there is no amplitude sensor); `none`: the network finds out by itself."""
    watchdogs: Literal["none", "border", "all"] = "none"
    """Nodes that watch for targets while nobody tracks: those within `border_m` of the field's edge, or all."""
    border_m: Positive = 25.0
    """Width of the watched border."""
    cut_off_m: Positive = 50.0
    """From this distance on a track does not follow a target, for the metrics."""

    def __post_init__(self) -> None:
        """Amplitudes in order, and beliefs that can move."""
        if self.amplitude.low >= self.amplitude.high:
            message = "amplitude.low below amplitude.high"
            raise ValueError(message)
        reach_m = self.max_speed_m_per_s * self.reading_s
        if self.cell_m > reach_m * (1.0 + 1e-9):
            message = f"cell_m at most max_speed_m_per_s times reading_s, here {reach_m:g} m, or no belief ever moves"
            raise ValueError(message)

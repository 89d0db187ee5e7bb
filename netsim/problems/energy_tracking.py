"""Several targets near each other, tracked by the acoustic energy that all of them together make (Liu et al. 2004)."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, MinLen

from netsim.errors import ScenarioError
from netsim.kernels.energy_sensing import EnergyModel, amplitude_for
from netsim.kernels.energy_tracking import EnergyTrackingKnowledge, TrackStart
from netsim.kernels.semiring import FloatArray
from netsim.kernels.vehicle_labels import VehicleLabels
from netsim.models.tracks import Track, TrackParameters
from netsim.parameters import NonNegative, NonNegativeInt, PointM, Positive, parameters
from netsim.problems.problem import placement
from netsim.problems.target_truth import Box, later_targets, targets_at, ways_of
from netsim.problems.vehicle_sounds import LabelParameters, Vehicle, VehicleSense, spectrum_of
from netsim.rng import Streams
from netsim.trace.events import Event, VariablePlacement
from netsim.units import s_to_ns

_LEAST_BINS = 16
"""With fewer the lines of engines run into each other."""


@parameters
class EnergyTarget:
    """A sound source that moves."""

    track: TrackParameters
    """Its way."""
    vehicle: Vehicle | None = None
    """Class of what moves, by which its sound is known (see `spectrum_bins`) or which labels tell; by default one of its
    own, that only labels can tell."""


@parameters
class EnergyTrackingParameters:
    """Tracking by energy: a sensor reads the sum of what all targets contribute, falling with the square of the distance."""

    type: Literal["energy-tracking"] = "energy-tracking"
    """Kind of problem."""
    targets: Annotated[tuple[EnergyTarget, ...], MinLen(1)]
    """What moves. All are equally loud."""
    noise_sd: Positive = 1.0
    """Standard deviation of the true noise of readings."""
    sensing_range_m: Positive = 120.0
    """Range at which a target contributes three times `noise_sd`."""
    saturation_m: Positive = 30.0
    """Within this range a target contributes no more than at it."""
    reading_s: Positive = 1.0
    """Time between two readings; a sensor that is read twice within it has the same noise."""
    assumed_noise: Positive = 2.0
    """What trackers assume of the noise, as a multiple of the true one."""
    max_speed_m_per_s: Positive = 45.0
    """Greatest speed of a target that trackers assume; the paper takes three times the true one."""
    start_spread_m: NonNegative = 30.0
    """How far from the place that the first leader is told the target may be."""
    spectrum_bins: NonNegativeInt = 0
    """Frequencies of the power spectrum that sensors read besides the energy, up to 320 Hz; 0 for none. Sounds of near
    targets mix. All targets need a `vehicle`."""
    labels: LabelParameters | None = None
    """Sensors that tell classes of targets, with a stated accuracy, instead of a spectrum."""
    first_leader: Literal["nearest", "one"] = "nearest"
    """Who is told where a target enters: the sensor nearest to that place, or one for all, the nearest to their mean place,
    as for a tracker that is joint from the start."""
    cut_off_m: Annotated[float, Ge(1)] = 100.0
    """From this distance on a track does not follow a target, for the metrics."""

    def __post_init__(self) -> None:
        """Refuse what sensors cannot tell.

        Raises:
            ValueError: A spectrum and labels, or a spectrum without two classes of vehicles at least.
        """
        vehicles = {target.vehicle for target in self.targets}
        if self.spectrum_bins and self.labels is not None:
            message = "either spectrum_bins or labels"
            raise ValueError(message)
        if self.spectrum_bins and (None in vehicles or len(vehicles) < 2):
            message = "a vehicle for every target, of two classes or more, with spectrum_bins"
            raise ValueError(message)
        if 0 < self.spectrum_bins < _LEAST_BINS:
            message = f"spectrum_bins of 0, or {_LEAST_BINS} or more"
            raise ValueError(message)

    @property
    def contribution(self) -> float:
        """C of Liu et al. 2004, eq 3: of a target at 1 m, were there no saturation."""
        return amplitude_for(self.sensing_range_m, self.noise_sd)


@dataclass(frozen=True, eq=False)
class EnergyTrackingProblem:
    """A problem with its truth.

    Attributes:
        parameters: As in the scenario.
        sensors_m: Where the sensors are, by node, ascending.
        tracks: Ways of the targets.
        starts: Tracks that nodes are told to begin, by node.
        streams: The run's random streams; a reading's noise is from `node/<id>/sensing/<number of the reading>`.
    """

    parameters: EnergyTrackingParameters
    sensors_m: Mapping[int, PointM]
    tracks: tuple[Track, ...]
    starts: Mapping[int, tuple[TrackStart, ...]]
    streams: Streams

    @property
    def kind(self) -> str:
        """`energy-tracking`."""
        return "energy-tracking"

    def instance_json(self) -> str:
        """Sensors, without targets."""
        content = {
            "sensors": [{"node": node, "x_m": x_m, "y_m": y_m} for node, (x_m, y_m) in self.sensors_m.items()],
            "targets": len(self.tracks),
            "sensing_range_m": self.parameters.sensing_range_m,
            "reading_s": self.parameters.reading_s,
            "cut_off_m": self.parameters.cut_off_m,
        }
        return json.dumps(content)

    def truth_events(self) -> Sequence[Event]:
        """Where the targets are at time 0."""
        return [targets_at(self.tracks, 0)]

    def later_truth(self, end_ns: int) -> Iterable[tuple[int, Event]]:
        """Where the targets are at every reading, and when one enters or leaves."""
        return later_targets(self.tracks, self.parameters.reading_s, end_ns)

    def placement_event(self) -> VariablePlacement:
        """No graphical model."""
        return placement({}, {}, ())

    def knowledge(self, node: int) -> EnergyTrackingKnowledge:
        """What a node knows at the start."""
        parameters = self.parameters
        return EnergyTrackingKnowledge(
            has_sensor=node in self.sensors_m,
            sensors_m=self.sensors_m,
            model=EnergyModel(
                amplitude=parameters.contribution,
                noise_sd=parameters.assumed_noise * parameters.noise_sd,
                saturation_m=parameters.saturation_m,
            ),
            sensing_range_m=parameters.sensing_range_m,
            reading_s=parameters.reading_s,
            max_speed_m_per_s=parameters.max_speed_m_per_s,
            targets=len(self.tracks),
            starts=self.starts.get(node, ()),
            labels=self._labels,
        )

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """The energy that a sensor reads (eq 3), and after it what it tells of classes: shape (1,) or (1 + features,).

        Raises:
            ScenarioError: When the node has no sensor.
        """
        if node not in self.sensors_m:
            text = f"node {node} has no sensor to observe with"
            raise ScenarioError(text)
        reading = time_ns // s_to_ns(self.parameters.reading_s)
        noise = self.streams.generator(f"node/{node}/sensing/{reading}").standard_normal()
        found = [(number, place) for number, t in enumerate(self.tracks) if (place := t.at(time_ns)) is not None]
        there_m = np.array([place for _, place in found]).reshape(-1, 2)
        energy = self._true_model.mean(np.array([self.sensors_m[node]]), there_m) + self.parameters.noise_sd * noise
        if self._sense is None:
            return energy
        return np.concatenate([energy, self._sense.features(self.sensors_m[node], found, node, reading)])

    @cached_property
    def _sense(self) -> VehicleSense | None:
        parameters = self.parameters
        if not parameters.spectrum_bins and parameters.labels is None:
            return None
        rate_per_s = 0.0 if parameters.labels is None else parameters.labels.rate_per_s
        bins = parameters.spectrum_bins
        return VehicleSense(
            vehicles=tuple(each.vehicle or f"target {number:03d}" for number, each in enumerate(parameters.targets)),
            energy=self._true_model,
            spectrum=spectrum_of(bins, parameters.noise_sd) if bins else None,
            labels=parameters.labels,
            labels_per_reading=min(1.0, rate_per_s * parameters.reading_s),
            streams=self.streams,
        )

    @cached_property
    def _labels(self) -> VehicleLabels | None:
        return None if self._sense is None else self._sense.knowledge

    @cached_property
    def _true_model(self) -> EnergyModel:
        parameters = self.parameters
        return EnergyModel(parameters.contribution, parameters.noise_sd, parameters.saturation_m)


def build(
    parameters: EnergyTrackingParameters,
    positions_m: Mapping[int, PointM],
    field_m: Box,
    streams: Streams,
    folder: Path,
) -> EnergyTrackingProblem:
    """Draw a problem.

    Args:
        parameters: What to draw.
        positions_m: Positions of the nodes that have a sensor, by node.
        field_m: The field: low x, low y, high x, high y.
        streams: The run's random streams.
        folder: What files are relative to.

    Raises:
        ScenarioError: Without sensors, or for a track that is wrong (see `netsim.models.tracks.track_of`).
    """
    if not positions_m:
        text = "no node has a sensor, so there is nobody to track"
        raise ScenarioError(text)
    sensors_m = {node: positions_m[node] for node in sorted(positions_m)}
    tracks = ways_of([target.track for target in parameters.targets], field_m, streams, folder)
    return EnergyTrackingProblem(parameters, sensors_m, tracks, _starts(parameters, sensors_m, tracks), streams)


def _starts(
    parameters: EnergyTrackingParameters, sensors_m: Mapping[int, PointM], tracks: Sequence[Track]
) -> dict[int, tuple[TrackStart, ...]]:
    """Who is told of which target: at the first reading when it is there."""
    step_ns = s_to_ns(parameters.reading_s)
    found: dict[int, tuple[TrackStart, ...]] = {}
    mean_m = tuple(np.mean([track.points_m[0] for track in tracks], axis=0).tolist())
    for number, track in enumerate(tracks):
        step = -(-track.times_ns[0] // step_ns)
        place_m = track.at(step * step_ns) or track.points_m[0]
        near_m = mean_m if parameters.first_leader == "one" else place_m
        leader = min(sensors_m, key=lambda node: (math.dist(sensors_m[node], near_m), node))
        start = TrackStart(number, place_m, parameters.start_spread_m, step)
        found[leader] = (*found.get(leader, ()), start)
    return found

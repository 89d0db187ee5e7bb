"""Tracking of sound sources by acoustic sensors (Liu, Reich, Zhao 2002, sections 2 to 5)."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from netsim.errors import ScenarioError
from netsim.kernels.acoustics import AmplitudeModel, BearingModel, SensorSpec
from netsim.kernels.beamformer import ArrayProcessing, square_m
from netsim.kernels.grid_belief import Grid, grid_over
from netsim.kernels.semiring import FloatArray
from netsim.kernels.tracking_model import TrackingKnowledge
from netsim.models.tracks import Track
from netsim.problems.acoustic_readings import AcousticReadings
from netsim.problems.problem import placement
from netsim.problems.target_truth import Box, later_targets, targets_at, ways_of
from netsim.problems.tracking_parameters import TrackingParameters
from netsim.rng import Streams
from netsim.trace.events import Event, VariablePlacement
from netsim.units import s_to_ns


@dataclass(frozen=True, eq=False)
class TrackingProblem:
    """A problem with its truth.

    Attributes:
        parameters: As in the scenario.
        sensors: Every sensor by node, ascending.
        grid: Cells of the belief.
        tracks: Ways of the targets.
        first_leader: Node that is told that it leads; None for none.
        watchdogs: Nodes that watch.
        streams: The run's random streams.
    """

    parameters: TrackingParameters
    sensors: Mapping[int, SensorSpec]
    grid: Grid
    tracks: tuple[Track, ...]
    first_leader: int | None
    watchdogs: frozenset[int]
    streams: Streams

    @property
    def kind(self) -> str:
        """`tracking`."""
        return "tracking"

    def instance_json(self) -> str:
        """Sensors and grid, without targets."""
        sensors = [
            {"node": node, "x_m": spec.position_m[0], "y_m": spec.position_m[1], "measures": _measures(spec)}
            for node, spec in self.sensors.items()
        ]
        parameters, grid = self.parameters, self.grid
        content = {
            "sensors": sensors,
            "grid": {"origin_m": grid.origin_m, "cell_m": grid.cell_m, "columns": grid.columns, "rows": grid.rows},
            "reading_s": parameters.reading_s,
            "neighbourhood_m": parameters.neighbourhood_m,
            "least_neighbours": parameters.least_neighbours,
            "cut_off_m": parameters.cut_off_m,
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

    def knowledge(self, node: int) -> TrackingKnowledge:
        """What a node knows at the start."""
        parameters, own = self.parameters, self.sensors.get(node)
        others = {other: spec for other, spec in self.sensors.items() if other != node}
        if own is not None:
            others = self._near(own, others)
        return TrackingKnowledge(
            sensor=own,
            others=others,
            neighbourhood_m=parameters.neighbourhood_m,
            least_neighbours=parameters.least_neighbours,
            grid=self.grid,
            reading_s=parameters.reading_s,
            max_speed_m_per_s=parameters.max_speed_m_per_s,
            leads_first=node == self.first_leader,
            is_watchdog=node in self.watchdogs,
            processing=_processing(parameters) if own is not None and own.measures_bearing else None,
        )

    def observe(self, node: int, time_ns: int) -> FloatArray:
        """What a sensor reads (see `netsim.problems.acoustic_readings.AcousticReadings.of`).

        Raises:
            ScenarioError: When the node has no sensor.
        """
        if node not in self.sensors:
            text = f"node {node} has no sensor to observe with"
            raise ScenarioError(text)
        return self._readings.of(node, time_ns)

    def loudness(self, node: int, time_ns: int) -> float:
        """True rms amplitude at a sensor."""
        return self._readings.loudness(node, time_ns)

    @cached_property
    def _readings(self) -> AcousticReadings:
        parameters = self.parameters
        amplitudes = (target.amplitude for target in parameters.targets)
        return AcousticReadings(
            sensors=self.sensors,
            sources=tuple(zip(self.tracks, amplitudes, strict=True)),
            least_range_m=parameters.amplitude.least_range_m,
            amplitude_noise_sd=parameters.amplitude_noise_sd,
            bearing_noise_sd_rad=math.radians(parameters.bearing_noise_sd_deg),
            microphones=parameters.microphones if parameters.bearings == "sampled" else None,
            reading_ns=s_to_ns(parameters.reading_s),
            streams=self.streams,
        )

    def _near(self, own: SensorSpec, others: Mapping[int, SensorSpec]) -> dict[int, SensorSpec]:
        parameters = self.parameters
        distance_m = {node: math.dist(own.position_m, spec.position_m) for node, spec in others.items()}
        order = sorted(others, key=lambda node: (distance_m[node], node))
        least = parameters.least_neighbours + 1
        count = max(least, sum(distance <= parameters.neighbourhood_m for distance in distance_m.values()))
        return {node: others[node] for node in order[:count]}


def _measures(spec: SensorSpec) -> str:
    return "bearing" if spec.measures_bearing else "amplitude"


def build(
    parameters: TrackingParameters,
    positions_m: Mapping[int, tuple[float, float]],
    field_m: Box,
    streams: Streams,
    folder: Path,
) -> TrackingProblem:
    """Draw a problem.

    Args:
        parameters: What to draw.
        positions_m: Positions of the nodes that have a sensor, by node.
        field_m: The field: low x, low y, high x, high y.
        streams: The run's random streams; which sensors measure bearings follows from `node/<id>/modality`.
        folder: What files are relative to.

    Raises:
        ScenarioError: Without sensors, or for a track that is wrong (see `netsim.models.tracks.track_of`).
    """
    if not positions_m:
        text = "no node has a sensor, so there is nobody to track"
        raise ScenarioError(text)
    nodes = sorted(positions_m)
    draws = {node: float(streams.generator(f"node/{node}/modality").random()) for node in nodes}
    bearing = set(sorted(nodes, key=draws.__getitem__)[: round(parameters.bearing_share * len(nodes))])
    amplitude_model, bearing_model = _models(parameters)
    sensors = {
        node: SensorSpec(positions_m[node], bearing_model if node in bearing else amplitude_model) for node in nodes
    }
    tracks = ways_of([target.track for target in parameters.targets], field_m, streams, folder)
    watchdogs = frozenset(node for node in nodes if _watches(parameters, positions_m[node], field_m))
    grid = grid_over(field_m, parameters.cell_m)
    problem = TrackingProblem(parameters, sensors, grid, tracks, None, watchdogs, streams)
    if parameters.first_leader == "none":
        return problem
    return TrackingProblem(parameters, sensors, grid, tracks, _loudest(problem), watchdogs, streams)


def _models(parameters: TrackingParameters) -> tuple[AmplitudeModel, BearingModel]:
    amplitude, bearing = parameters.amplitude, parameters.bearing
    return AmplitudeModel(amplitude.low, amplitude.high, amplitude.noise_sd, amplitude.least_range_m), BearingModel(
        math.radians(bearing.noise_sd_deg),
        bearing.near_m,
        bearing.far_m,
        math.radians(bearing.noise_sd_at_zero_deg),
        math.radians(bearing.growth_deg_per_m),
    )


def _processing(parameters: TrackingParameters) -> ArrayProcessing | None:
    if parameters.bearings == "drawn":
        return None
    array, places_m = parameters.microphones, square_m(parameters.microphones.side_m)
    return ArrayProcessing(places_m, array.samples, array.sampling_hz, array.sound_m_per_s, array.window)


def _watches(parameters: TrackingParameters, place_m: tuple[float, float], field_m: Box) -> bool:
    if parameters.watchdogs != "border":
        return parameters.watchdogs == "all"
    low_x, low_y, high_x, high_y = field_m
    inside_m = min(place_m[0] - low_x, high_x - place_m[0], place_m[1] - low_y, high_y - place_m[1])
    return inside_m <= parameters.border_m


def _loudest(problem: TrackingProblem) -> int:
    """The amplitude sensor with the highest reading at time 0; of all nodes the loudest place where there is none."""
    listening = [node for node, spec in problem.sensors.items() if not spec.measures_bearing]
    if listening:
        return max(listening, key=lambda node: float(problem.observe(node, 0)[0]))
    return max(problem.sensors, key=lambda node: problem.loudness(node, 0))

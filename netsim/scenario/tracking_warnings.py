"""Targets that nobody can track, and microphones that listen longer than their sensor is on, in words."""

from collections.abc import Iterator

from netsim.errors import ScenarioError
from netsim.models.tracks import Track, track_of
from netsim.problems.tracking_parameters import TrackingParameters
from netsim.rng import Streams
from netsim.scenario.load import LoadedScenario
from netsim.scenario.schema import Scenario
from netsim.units import NS_PER_S, s_to_ns


def tracking_warnings(loaded: LoadedScenario) -> Iterator[str]:
    """What a tracking problem asks that cannot be, each once; files that cannot be read are left to building."""
    scenario, problem = loaded.scenario, loaded.scenario.problem
    if not isinstance(problem, TrackingParameters):
        return
    if problem.reading_s > scenario.duration_s:
        yield (
            f"problem.reading_s is {problem.reading_s:g} s, but the run ends at {scenario.duration_s:g} s: there is no "
            "reading after time 0"
        )
    for number in range(len(problem.targets)):
        try:
            track = _track(loaded, problem, number)
        except ScenarioError:
            continue
        yield from _track_warnings(scenario, problem, track, f"problem.targets[{number}]")
    if problem.bearings == "sampled" and problem.bearing_share > 0.0:
        yield from _listening(scenario, problem)


def _field_m(scenario: Scenario) -> tuple[float, float, float, float]:
    (low_x, low_y), field = scenario.field.origin_m, scenario.field
    return low_x, low_y, low_x + field.width_m, low_y + field.height_m


def _track(loaded: LoadedScenario, problem: TrackingParameters, number: int) -> Track:
    scenario = loaded.scenario
    streams = Streams(scenario.seed, scenario.repetition)
    return track_of(problem.targets[number].track, number, _field_m(scenario), streams, loaded.folder)


def _track_warnings(scenario: Scenario, problem: TrackingParameters, track: Track, name: str) -> Iterator[str]:
    begins_s, end_s = track.times_ns[0] / NS_PER_S, scenario.duration_s
    if begins_s > end_s:
        yield f"{name}: enters at {begins_s:g} s, but the run ends at {end_s:g} s: nobody meets it"
    elif not _visits(scenario, problem, track):
        yield f"{name}: is at no reading inside the field, where the sensors and the cells of the belief are"
    if track.top_speed_m_per_s > problem.max_speed_m_per_s * (1.0 + 1e-9):
        yield (
            f"{name}: goes at up to {track.top_speed_m_per_s:.3g} m/s, but problem.max_speed_m_per_s is "
            f"{problem.max_speed_m_per_s:g} m/s: beliefs do not follow it"
        )


def _visits(scenario: Scenario, problem: TrackingParameters, track: Track) -> bool:
    low_x, low_y, high_x, high_y = _field_m(scenario)
    step_ns = s_to_ns(problem.reading_s)
    places = (track.at(time_ns) for time_ns in range(0, s_to_ns(scenario.duration_s) + 1, step_ns))
    return any(place and low_x <= place[0] <= high_x and low_y <= place[1] <= high_y for place in places)


def _listening(scenario: Scenario, problem: TrackingParameters) -> Iterator[str]:
    """Of sensors that are on for a shorter time than the samples take, so that less energy is booked than is used."""
    samples_s = problem.microphones.samples / problem.microphones.sampling_hz
    for group in scenario.nodes:
        if (
            group.role == "sensor"
            and group.sensor is not None
            and group.sensor.sample_time_s < samples_s * (1.0 - 1e-9)
        ):
            yield (
                f"group {group.name}: sensor.sample_time_s is {group.sensor.sample_time_s:g} s, but "
                f"{problem.microphones.samples} samples of a microphone take {samples_s:.3g} s: give it that time"
            )

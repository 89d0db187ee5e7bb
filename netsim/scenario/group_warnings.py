"""Tracking by groups of sensors: targets that nobody reads, and settings that leave no time for a step, in words."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.errors import ScenarioError
from netsim.kernels.energy_sensing import likelihood_operations
from netsim.kernels.particles import condition_operations, predict_operations, resample_operations
from netsim.models.tracks import Track, track_of
from netsim.problems.energy_tracking import EnergyTrackingParameters
from netsim.rng import Streams
from netsim.scenario.load import LoadedScenario
from netsim.scenario.places import Place, places
from netsim.scenario.tracking_checks import algorithms
from netsim.units import NS_PER_S, s_to_ns


def group_warnings(loaded: LoadedScenario) -> Iterator[str]:
    """What tracking by energy asks that cannot be, each once; files that cannot be read are left to building."""
    problem = loaded.scenario.problem
    if not isinstance(problem, EnergyTrackingParameters):
        return
    duration_s = loaded.scenario.duration_s
    if problem.reading_s > duration_s:
        yield (
            f"problem.reading_s is {problem.reading_s:g} s, but the run ends at {duration_s:g} s: there is no reading "
            "after time 0"
        )
    try:
        sensors = [
            node
            for node in places(loaded, Streams(loaded.scenario.seed, loaded.scenario.repetition))
            if node.sensor is not None
        ]
        tracks = [_track(loaded, problem, number) for number in range(len(problem.targets))]
    except ScenarioError:
        return  # told when the scenario is built
    if not sensors:
        return
    for number, track in enumerate(tracks):
        yield from _of_target(loaded, problem, (track, sensors), f"problem.targets[{number}]")
    for path, record in algorithms(loaded.scenario):
        if isinstance(record, JointTrackingParameters):
            name = "algorithm" if len(path) == 1 else f"nodes[{path[1]}].algorithm"
            yield from _of_settings(problem, record, name)
            yield from _of_computing(problem, record, sensors, name)


def _track(loaded: LoadedScenario, problem: EnergyTrackingParameters, number: int) -> Track:
    scenario, field = loaded.scenario, loaded.scenario.field
    (low_x, low_y), streams = field.origin_m, Streams(scenario.seed, scenario.repetition)
    box_m = low_x, low_y, low_x + field.width_m, low_y + field.height_m
    return track_of(problem.targets[number].track, number, box_m, streams, loaded.folder)


def _of_target(
    loaded: LoadedScenario, problem: EnergyTrackingParameters, met: tuple[Track, list[Place]], name: str
) -> Iterator[str]:
    (track, sensors), end_s = met, loaded.scenario.duration_s
    begins_s = track.times_ns[0] / NS_PER_S
    if begins_s > end_s:
        yield f"{name}: enters at {begins_s:g} s, but the run ends at {end_s:g} s: nobody meets it"
    elif not _is_read(track, sensors, problem, s_to_ns(end_s)):
        yield f"{name}: at no reading is it within problem.sensing_range_m, {problem.sensing_range_m:g} m, of a sensor"
    if track.top_speed_m_per_s > problem.max_speed_m_per_s * (1.0 + 1e-9):
        yield (
            f"{name}: goes at up to {track.top_speed_m_per_s:.3g} m/s, but problem.max_speed_m_per_s is "
            f"{problem.max_speed_m_per_s:g} m/s: particles do not follow it"
        )


def _is_read(track: Track, sensors: list[Place], problem: EnergyTrackingParameters, end_ns: int) -> bool:
    steps = range(0, end_ns + 1, s_to_ns(problem.reading_s))
    met = [place for place in map(track.at, steps) if place is not None]
    if not met:
        return False
    tree = cKDTree([(node.x_m, node.y_m) for node in sensors])
    return float(tree.query(met)[0].min()) <= problem.sensing_range_m


def _of_settings(problem: EnergyTrackingParameters, record: JointTrackingParameters, name: str) -> Iterator[str]:
    reach_m = 2.0 * problem.sensing_range_m
    if record.switch == "distance" and len(problem.targets) > 1 and record.separate_m > reach_m:
        yield (
            f"{name}.separate_m is {record.separate_m:g} m, but groups collide at most twice problem.sensing_range_m "
            f"apart, {reach_m:g} m: with switch `distance` that decides"
        )
    if record.give_s >= problem.reading_s:
        yield (
            f"{name}.give_s is {record.give_s:g} s, but there is a reading every {problem.reading_s:g} s "
            "(problem.reading_s): a belief that gets lost is given again after the next one"
        )


def _of_computing(
    problem: EnergyTrackingParameters, record: JointTrackingParameters, sensors: list[Place], name: str
) -> Iterator[str]:
    """Beliefs that a leader cannot compute between the end of collecting and the next reading."""
    readings = _usual_group(sensors, problem.sensing_range_m)
    left_s = problem.reading_s * (1.0 - record.collect_share)
    slowest = min(node.cpu.operations_per_s for node in sensors)
    beliefs = [("particles", record.particles, 1)]
    if record.switch != "never" and len(problem.targets) > 1:
        beliefs.append(("joint_particles", record.joint_particles, 2))
    for field, particles, targets in beliefs:
        step_s = _step_operations(readings, particles, targets) / slowest
        if step_s > left_s:
            yield (
                f"{name}.{field} is {particles:,}: of {readings} readings the belief takes some {step_s:.2g} s to compute, "
                f"but {left_s:.2g} s are left of a step when readings are collected (collect_share, problem.reading_s)"
            )


def _usual_group(sensors: list[Place], range_m: float) -> int:
    """Sensors within the sensing range of a sensor, median."""
    places_m = np.array([(node.x_m, node.y_m) for node in sensors])
    return int(np.median(cKDTree(places_m).query_ball_point(places_m, range_m, return_length=True)))


def _step_operations(readings: int, particles: int, targets: int) -> int:
    """What a leader computes of a step, as it is charged for it."""
    return (
        predict_operations(particles, targets)
        + likelihood_operations(readings, particles, targets)
        + condition_operations(particles)
        + resample_operations(particles, particles)
    )

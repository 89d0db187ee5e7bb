"""Settings of the IDSQ tracker that rarely do what was meant, in words."""

from collections.abc import Iterator

import numpy as np

from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.errors import ScenarioError
from netsim.kernels.semiring import FloatArray
from netsim.problems.tracking_parameters import TrackingParameters
from netsim.rng import Streams
from netsim.scenario.load import LoadedScenario
from netsim.scenario.places import places
from netsim.scenario.tracking_checks import algorithms
from netsim.sim.mac.lpl_timing import LplParameters
from netsim.sim.mac.tdma import TdmaParameters


def tracker_warnings(loaded: LoadedScenario) -> Iterator[str]:
    """What a tracker is told that is without effect or at odds with the rest, each once."""
    problem = loaded.scenario.problem
    if not isinstance(problem, TrackingParameters):
        return
    trackers = [
        ("algorithm" if len(path) == 1 else f"nodes[{path[1]}].algorithm", record)
        for path, record in algorithms(loaded.scenario)
        if isinstance(record, IdsqParameters)
    ]
    if trackers and problem.first_leader == "none" and problem.watchdogs == "none":
        yield "problem: first_leader and watchdogs are both none, so nobody ever begins a track"
    for name, record in trackers:
        yield from _sleeping(loaded, problem, record, name)
        yield from _threads(loaded, problem, record, name)


def _sleeping(loaded: LoadedScenario, problem: TrackingParameters, record: IdsqParameters, name: str) -> Iterator[str]:
    mac, sleep = loaded.scenario.mac, record.sleep
    if sleep is None:
        return
    if isinstance(mac, LplParameters | TdmaParameters):
        yield f"{name}.sleep with mac {mac.type}: both switch the radio, by schedules of their own; leave one of them out"
    awake_s = sleep.window_s + 2.0 * sleep.guard_s
    if awake_s >= problem.reading_s:
        yield (
            f"{name}.sleep: a window with its guard times is {awake_s:g} s, and there is one every {problem.reading_s:g} s "
            "(problem.reading_s): radios never sleep"
        )


def _threads(loaded: LoadedScenario, problem: TrackingParameters, record: IdsqParameters, name: str) -> Iterator[str]:
    """More than a first leader can give away."""
    if record.threads == 1:
        return
    try:
        nodes = places(loaded, Streams(loaded.scenario.seed, loaded.scenario.repetition))
    except ScenarioError:
        return  # told when the scenario is built
    places_m = np.array([(node.x_m, node.y_m) for node in nodes if node.sensor is not None])
    most = _most_neighbours(places_m, problem)
    if record.threads - 1 > most:
        yield (
            f"{name}.threads is {record.threads}, but whoever begins a track gives each thread but its own to another "
            f"neighbour, and no node has more than {most}: the rest never begins"
        )


def _most_neighbours(places_m: FloatArray, problem: TrackingParameters) -> int:
    """Neighbours that the node with most of them knows of; node by node, so that large networks take little memory."""
    within = (int(np.count_nonzero(np.hypot(*(places_m - place).T) <= problem.neighbourhood_m)) for place in places_m)
    least = min(problem.least_neighbours + 1, max(0, len(places_m) - 1))
    return max(least, max(within, default=1) - 1)

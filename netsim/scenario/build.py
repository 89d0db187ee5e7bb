"""The composition root: from a checked scenario to a simulation that is ready to run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from netsim.api import Algorithm
from netsim.errors import InvariantError, ScenarioError
from netsim.kernels.association_reach import require_reach
from netsim.problems import association, energy_tracking, event_association, graph, target_distribution, tracking
from netsim.problems.association import AssociationParameters
from netsim.problems.energy_tracking import EnergyTrackingParameters
from netsim.problems.event_association import EventAssociationParameters
from netsim.problems.graph import GraphFile, GraphParameters
from netsim.problems.none import NoProblem
from netsim.problems.problem import Problem
from netsim.problems.target_distribution import DistributionParameters
from netsim.problems.tracking_parameters import TrackingParameters
from netsim.protocols.time_sync import flooding_time_sync
from netsim.rng import Streams
from netsim.scenario.links import Air, air_between
from netsim.scenario.load import LoadedScenario
from netsim.scenario.make_faults import FaultMaker
from netsim.scenario.make_mac import MacMaker
from netsim.scenario.make_medium import make_medium
from netsim.scenario.make_motion import movers, require_moving_air, require_still_sensors
from netsim.scenario.make_network import NetworkMaker
from netsim.scenario.make_node import Shared, make_parts
from netsim.scenario.places import Place, places, positions_m
from netsim.scenario.route_costs import PlannedRoutes
from netsim.sim.clock import Clock
from netsim.sim.faults.roles import RoleHolders
from netsim.sim.handle import Handle
from netsim.sim.mobility import Mobility
from netsim.sim.node import Identity, Node, Service
from netsim.sim.simulation import Member, Simulation
from netsim.sim.tasks import place_of
from netsim.sim.truth import Truth
from netsim.trace.events import Event, FieldInfo, NodeTable
from netsim.trace.events import Problem as ProblemEvent
from netsim.trace.recorder import Observer, Recorder
from netsim.units import s_to_ns


@dataclass(slots=True)
class Built:
    """A simulation and the problem it is about.

    Attributes:
        simulation: Ready to run.
        problem: Truth and instance.
    """

    simulation: Simulation
    problem: Problem


def build(loaded: LoadedScenario, observers: Sequence[Observer] = (), clock: Clock | None = None) -> Built:
    """Put a run together.

    Args:
        loaded: The scenario.
        observers: Who follows the run's events.
        clock: Simulated time, if not a plain new clock.

    Raises:
        ScenarioError: For what only shows when the parts meet: missing files, ids used twice, impossible placements.
    """
    return _Builder(loaded, observers, clock or Clock()).build()


def _problem(nodes: Sequence[Place], streams: Streams, loaded: LoadedScenario, air: Air) -> Problem:
    """Draw the scenario's problem; what does not fit is a finding at its place in the file."""
    try:
        return _draw_problem(nodes, streams, loaded, air)
    except ScenarioError as error:
        if error.findings:
            raise
        finding = loaded.document.finding(("problem",), str(error), "")
        raise ScenarioError([finding]) from error


def _draw_problem(nodes: Sequence[Place], streams: Streams, loaded: LoadedScenario, air: Air) -> Problem:
    """Draw the scenario's problem: truth, observations, knowledge."""
    parameters, routes = loaded.scenario.problem, PlannedRoutes(loaded.scenario, nodes, air)
    if isinstance(parameters, AssociationParameters):
        sensing = [place for place in nodes if place.sensor is not None]
        ids = [place.id for place in sensing]
        drawn = association.build(parameters, positions_m(sensing), ids, streams, routes)
        require_reach(drawn.instance)
        return drawn
    if isinstance(parameters, DistributionParameters):
        sensing = [place for place in nodes if place.sensor is not None]
        ids, box_m = [place.id for place in sensing], _box_m(loaded)
        return target_distribution.build(parameters, positions_m(sensing), ids, box_m, streams, routes)
    if isinstance(parameters, EnergyTrackingParameters):
        places_m = {place.id: (place.x_m, place.y_m) for place in nodes if place.sensor is not None}
        return energy_tracking.build(parameters, places_m, _box_m(loaded), streams, loaded.folder)
    if isinstance(parameters, EventAssociationParameters):
        places_m = {place.id: (place.x_m, place.y_m) for place in nodes if place.sensor is not None}
        return event_association.build(parameters, places_m, _box_m(loaded), streams)
    if isinstance(parameters, TrackingParameters):
        require_still_sensors(loaded)
        places_m = {place.id: (place.x_m, place.y_m) for place in nodes if place.sensor is not None}
        return tracking.build(parameters, places_m, _box_m(loaded), streams, loaded.folder)
    if isinstance(parameters, GraphParameters):
        return graph.build(parameters, [place.id for place in nodes], streams, _model_text(parameters, loaded))
    return NoProblem()


def _box_m(loaded: LoadedScenario) -> tuple[float, float, float, float]:
    """The field: low x, low y, high x, high y."""
    field = loaded.scenario.field
    left_m, low_m = field.origin_m
    return left_m, low_m, left_m + field.width_m, low_m + field.height_m


def _model_text(parameters: GraphParameters, loaded: LoadedScenario) -> str | None:
    """The content of the model's file, if it comes from one."""
    if not isinstance(parameters.graph, GraphFile):
        return None
    path = loaded.folder / parameters.graph.path
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a text file"
        finding = loaded.document.finding(
            ("problem", "graph", "path"),
            "a readable .uai or .fg file",
            f"{path}: {reason}",
            "paths are relative to the scenario",
        )
        raise ScenarioError([finding]) from error


class _Builder:
    """Holds what all nodes of one run share while they are built."""

    def __init__(self, loaded: LoadedScenario, observers: Sequence[Observer], clock: Clock) -> None:
        self._loaded = loaded
        self._scenario = loaded.scenario
        self._clock = clock
        holders = RoleHolders()
        self._recorder = Recorder(lambda: clock.now_ns, [*observers, holders])
        self._streams = Streams(self._scenario.seed, self._scenario.repetition)
        self._places = places(loaded, self._streams)
        self._faults = FaultMaker(loaded, clock, self._recorder, self._streams, self._places, holders)
        self._air = air_between(self._places, loaded, self._streams)
        self._problem = _problem(self._places, self._streams, loaded, self._air)
        scenario, streams, recorder = self._scenario, self._streams, self._recorder
        self._medium = make_medium(scenario, clock, recorder, streams, self._air)
        make_mac = MacMaker(loaded, clock, streams, self._medium, self._air, self._places)
        make_network = NetworkMaker(scenario, clock, recorder, streams, self._air, self._places)
        self._shared = Shared(scenario, clock, recorder, streams, self._medium, make_mac, make_network)
        self._ids = frozenset(place.id for place in self._places)

    def build(self) -> Built:
        scenario = self._scenario
        simulation = Simulation(
            self._clock,
            self._recorder,
            s_to_ns(scenario.duration_s),
            self._opening(),
            s_to_ns(scenario.trace.energy_interval_s),
            lambda: self._medium.is_quiet,
        )
        for place in self._places:
            simulation.add(self._member(place, simulation.node_ended))
        self._set_in_motion(simulation)
        Truth(self._clock, self._recorder, self._problem.later_truth(simulation.horizon_ns))
        self._faults.install(simulation, self._medium)
        return Built(simulation, self._problem)

    def _set_in_motion(self, simulation: Simulation) -> None:
        """Let the nodes move that are to."""
        moving = movers(self._loaded, self._places)
        if moving:
            require_moving_air(self._loaded, self._air)
            nodes, replace_links = simulation.nodes, self._medium.replace_links
            Mobility(self._clock, self._recorder, moving, nodes, self._air, replace_links)

    def _opening(self) -> list[Event]:
        field = self._scenario.field
        nodes = self._places
        table = NodeTable(
            node=[place.id for place in nodes],
            name=[place.name for place in nodes],
            group=[place.group.name for place in nodes],
            role=[place.group.role for place in nodes],
            x_m=[place.x_m for place in nodes],
            y_m=[place.y_m for place in nodes],
            radio=[place.radio.name for place in nodes],
            cpu=[place.cpu.name for place in nodes],
            battery_j=[place.battery.energy_j for place in nodes],
        )
        problem = self._problem
        return [
            FieldInfo(field.width_m, field.height_m, *field.origin_m),
            table,
            self._air.table,
            ProblemEvent(problem.kind, problem.instance_json()),
            problem.placement_event(),
            *problem.truth_events(),
        ]

    def _member(self, place: Place, on_end: Callable[[Node], None]) -> Member:
        """A node, its handle and its algorithm; the closures tie the layers to the node that is made last."""
        nodes: list[Node] = []

        def node() -> Node:
            if not nodes:
                message = f"node {place.id} was used before it was built"
                raise InvariantError(message)
            return nodes[0]

        parts = make_parts(place, self._shared, lambda: node().die(), lambda message: node().deliver(message))
        nodes.append(Node(self._clock, self._identity(place), parts, self._recorder, on_end, self._services()))
        handle = Handle(self._clock, node(), self._streams, self._recorder, self._ids)
        record: Any = self._scenario.algorithm if place.group.algorithm is None else place.group.algorithm
        return Member(node(), handle, self._algorithm(place, record))

    def _services(self) -> list[Service]:
        """What runs beside the algorithms."""
        sync = self._scenario.time_sync
        if sync is None:
            return []
        root = min(self._ids) if sync.root is None else sync.root
        if root not in self._ids:
            path = ("time_sync", "root")
            raise ScenarioError([self._loaded.document.finding(path, "the id of a node", f"{root}, which none has")])
        return [lambda node: flooding_time_sync(node, sync, root)]

    def _algorithm(self, place: Place, record: Any) -> Algorithm:
        """Make the algorithm of one node; a constructor of the user's that raises is a finding."""
        try:
            return self._loaded.registry.entry_of(record).make(record)
        except Exception as error:
            own = place.group.algorithm is not None
            path = ("nodes", place.group_index, "algorithm") if own else ("algorithm",)
            where = f" ({place_of(error)})" if place_of(error) else ""
            text = f"the algorithm {record.type} cannot be made: {error!r}{where}"
            raise ScenarioError([self._loaded.document.finding(path, text, "")]) from error

    def _identity(self, place: Place) -> Identity:
        problem = self._problem
        observe = lambda: np.asarray(problem.observe(place.id, self._clock.now_ns), dtype=float)  # noqa: E731
        return Identity(
            id=place.id,
            name=place.name,
            group=place.group.name,
            role=place.group.role,
            position_m=(place.x_m, place.y_m),
            neighbours=self._air.neighbours[place.id],
            knowledge=problem.knowledge(place.id),
            observe=self._faults.observe(place.id, observe),
        )

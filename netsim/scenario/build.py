"""The composition root: from a checked scenario to a simulation that is ready to run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from netsim.api import Algorithm, Message
from netsim.errors import InvariantError, ScenarioError
from netsim.models.path_loss import IdealMediumParameters
from netsim.problems import association, graph
from netsim.problems.association import AssociationParameters
from netsim.problems.graph import GraphFile, GraphParameters
from netsim.problems.none import NoProblem
from netsim.problems.problem import Problem
from netsim.rng import Streams
from netsim.scenario.links import Air, air_between
from netsim.scenario.load import LoadedScenario
from netsim.scenario.places import Place, places, positions_m
from netsim.sim.air import FrameLog, Uniforms
from netsim.sim.clock import Clock
from netsim.sim.devices import Cpu, SensorPort
from netsim.sim.energy import Account, Battery, Meter
from netsim.sim.frames import MAC_OVERHEAD_BYTE
from netsim.sim.handle import Handle
from netsim.sim.ideal_medium import IdealMedium
from netsim.sim.inbox import Inbox
from netsim.sim.mac.csma import CsmaMac, CsmaParameters
from netsim.sim.mac.ideal import IdealMac
from netsim.sim.mac.link import Mac
from netsim.sim.medium import SinrMedium
from netsim.sim.net.network import MessageBook, Network
from netsim.sim.net.routes import OneHop, Routes, ShortestPathParameters, ShortestPaths
from netsim.sim.node import Identity, Node, Parts
from netsim.sim.radio import Radio
from netsim.sim.simulation import Member, Simulation
from netsim.sim.tasks import place_of
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


def _problem(nodes: Sequence[Place], streams: Streams, loaded: LoadedScenario) -> Problem:
    """Draw the scenario's problem; what does not fit is a finding at its place in the file."""
    try:
        return _draw_problem(nodes, streams, loaded)
    except ScenarioError as error:
        if error.findings:
            raise
        finding = loaded.document.finding(("problem",), str(error), "")
        raise ScenarioError([finding]) from error


def _draw_problem(nodes: Sequence[Place], streams: Streams, loaded: LoadedScenario) -> Problem:
    """Draw the scenario's problem: truth, observations, knowledge."""
    parameters = loaded.scenario.problem
    if isinstance(parameters, AssociationParameters):
        sensing = [place for place in nodes if place.sensor is not None]
        return association.build(parameters, positions_m(sensing), [place.id for place in sensing], streams)
    if isinstance(parameters, GraphParameters):
        return graph.build(parameters, [place.id for place in nodes], streams, _model_text(parameters, loaded))
    return NoProblem()


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
        self._recorder = Recorder(lambda: clock.now_ns, observers)
        self._streams = Streams(self._scenario.seed, self._scenario.repetition)
        self._places = places(loaded, self._streams)
        self._problem = _problem(self._places, self._streams, loaded)
        self._air = air_between(self._places, self._scenario.medium, self._streams)
        self._medium = self._make_medium(self._air)
        self._routes = self._make_routes(self._air)
        self._book = MessageBook()
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
        return Built(simulation, self._problem)

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

    def _make_medium(self, air: Air) -> SinrMedium | IdealMedium:
        parameters = self._scenario.medium
        log = FrameLog(self._recorder, self._scenario.trace.detail != "summary")
        if isinstance(parameters, IdealMediumParameters):
            delay_ns = s_to_ns(parameters.delay_s)
            return IdealMedium(self._clock, air.paths, delay_ns, parameters.loss_probability, log)
        return SinrMedium(self._clock, air.paths, air.noise_mw, log)

    def _make_routes(self, air: Air) -> Routes:
        parameters = self._scenario.network
        if isinstance(parameters, ShortestPathParameters):
            return ShortestPaths(air.neighbours, parameters)
        return OneHop()

    def _member(self, place: Place, on_end: Callable[[Node], None]) -> Member:
        """A node, its handle and its algorithm; the closures tie the layers to the node that is made last."""
        nodes: list[Node] = []

        def node() -> Node:
            if not nodes:
                message = f"node {place.id} was used before it was built"
                raise InvariantError(message)
            return nodes[0]

        parts = self._parts(place, lambda: node().die(), lambda message: node().deliver(message))
        nodes.append(Node(self._clock, self._identity(place), parts, self._recorder, on_end))
        handle = Handle(self._clock, node(), self._streams, self._recorder, self._ids)
        record: Any = self._scenario.algorithm if place.group.algorithm is None else place.group.algorithm
        return Member(node(), handle, self._algorithm(place, record))

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
        return Identity(
            id=place.id,
            name=place.name,
            group=place.group.name,
            role=place.group.role,
            position_m=(place.x_m, place.y_m),
            neighbours=self._air.neighbours[place.id],
            knowledge=problem.knowledge(place.id),
            observe=lambda: np.asarray(problem.observe(place.id), dtype=float),
        )

    def _parts(self, place: Place, on_empty: Callable[[], None], deliver: Callable[[Message], None]) -> Parts:
        clock = self._clock
        account = Account()
        battery = Battery(clock, place.battery.energy_j, on_empty)
        meters = tuple(Meter(clock, battery, account, device) for device in ("radio", "cpu", "sensor"))
        radio = Radio(
            clock,
            place.id,
            place.radio,
            place.group.tx_power_dbm,
            meters[0],
            self._medium,
            self._recorder,
            self._scenario.trace.detail == "full",
        )
        self._medium.join(radio, self._streams.generator(f"node/{place.id}/reception"))
        packet_byte = place.radio.max_psdu_byte - MAC_OVERHEAD_BYTE
        network = Network(clock, place.id, self._routes, self._book, self._recorder, packet_byte, deliver)
        mac = self._make_mac(place, radio, network.on_packet)
        network.attach(mac)
        sensor = place.sensor
        port = None if sensor is None else SensorPort(clock, sensor.power_mw, sensor.sample_time_ns, meters[2])
        cpu = Cpu(clock, place.cpu, meters[1])
        return Parts(account, battery, radio, cpu, port, mac, network, Inbox(clock), meters)

    def _make_mac(self, place: Place, radio: Radio, deliver: Callable[[bytes, int], None]) -> Mac:
        parameters = self._scenario.mac
        if isinstance(parameters, CsmaParameters):
            uniforms = Uniforms(self._streams.generator(f"node/{place.id}/backoff"))
            medium = self._medium
            busy = lambda: medium.is_busy(place.id)  # noqa: E731
            return CsmaMac(self._clock, radio, busy, uniforms.next, parameters, deliver)
        return IdealMac(radio, deliver)

"""From the fault rules of a scenario to what strikes a run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain, product

import numpy as np

from netsim.errors import Finding, ScenarioError
from netsim.models.media import IdealMediumParameters, TraceMediumParameters
from netsim.models.path_loss import path_loss_db
from netsim.reading import Path as ValuePath
from netsim.reading.remedies import nearest
from netsim.rng import Streams
from netsim.scenario.fault_parts import FaultParts, span_of
from netsim.scenario.load import LoadedScenario
from netsim.scenario.make_medium import AnyMedium
from netsim.scenario.places import Place, positions_m
from netsim.sim.clock import Clock
from netsim.sim.faults.announce import named
from netsim.sim.faults.frames import FrameFaults
from netsim.sim.faults.packets import PacketFaults
from netsim.sim.faults.roles import RoleCrash, RoleHolders, RoleStrike
from netsim.sim.faults.rules import CrashRule, FaultRule, JammerRule, NodeRef, PartitionRule, RoleCrashRule
from netsim.sim.faults.schedule import Crashes, CrashSchedule, JammerSchedule
from netsim.sim.faults.sensors import Reading, faulty
from netsim.sim.medium import SinrMedium
from netsim.sim.net.network import Network
from netsim.sim.simulation import Simulation
from netsim.trace.recorder import Recorder
from netsim.units import NS_PER_S, dbm_to_mw, s_to_ns

NOTABLE_MW = 1e-12
"""Jamming below -120 dBm is left out: it is far below the noise of any receiver."""
NS_PER_H = 3600 * NS_PER_S


class NodeNames:
    """Finds nodes by id, name or group."""

    def __init__(self, places: Sequence[Place]) -> None:
        self._ids = {place.id for place in places}
        self._named: dict[str, set[int]] = {}
        for place in places:
            self._named.setdefault(place.name, set()).add(place.id)
        for group in {place.group.name for place in places}:  # a group's name comes before a node's
            self._named[group] = {place.id for place in places if place.group.name == group}

    def of(self, reference: NodeRef) -> set[int]:
        """The nodes of one reference; none if there is nothing of that name."""
        if isinstance(reference, str):
            return self._named.get(reference, set())
        return {reference} & self._ids

    def all_of(self, references: Sequence[NodeRef] | None) -> set[int]:
        """The nodes of several; all nodes if they are not named."""
        return set(self._ids) if references is None else set().union(*map(self.of, references))

    def pairs(self, links: Sequence[tuple[NodeRef, NodeRef]]) -> set[tuple[int, int]]:
        """Directed links between different nodes."""
        found = chain.from_iterable(product(self.of(source), self.of(listener)) for source, listener in links)
        return {(source, listener) for source, listener in found if source != listener}

    def remedy(self, reference: NodeRef) -> str:
        """What may have been meant."""
        guess = nearest(reference, list(self._named)) if isinstance(reference, str) else None
        known = f"ids are {min(self._ids)} to {max(self._ids)}"
        return f"did you mean `{guess}`?" if guess else known


class FaultMaker:
    """Puts the rules of one scenario to work.

    Args:
        loaded: The scenario.
        clock: Simulated time.
        recorder: Where faults are told.
        streams: Random streams of the run.
        places: The nodes.
        holders: Who holds which role.

    Raises:
        ScenarioError: For nodes that do not exist, or whom a rule does not fit.
    """

    def __init__(
        self,
        loaded: LoadedScenario,
        clock: Clock,
        recorder: Recorder,
        streams: Streams,
        places: Sequence[Place],
        holders: RoleHolders,
    ) -> None:
        self._loaded = loaded
        self._clock = clock
        self._holders = holders
        self._streams = streams
        self._places = places
        self._names = NodeNames(places)
        self._rules: Sequence[FaultRule] = loaded.scenario.faults
        findings = list(self._findings())
        if findings:
            raise ScenarioError(findings)
        self._parts = [
            FaultParts(index, rule, clock, recorder, streams, self._names.all_of, self._names.pairs)
            for index, rule in enumerate(self._rules)
        ]

    def observe(self, node: int, observe: Callable[[], Reading]) -> Callable[[], Reading]:
        """A node's view of the world through its sensor, as it is under the rules."""
        rules = [fault for parts in self._parts for fault in parts.sensor(node)]
        return faulty(node, observe, rules, lambda: self._clock.now_ns)

    def install(self, simulation: Simulation, medium: AnyMedium) -> None:
        """Let the rules strike a simulation that is about to run."""
        frames = [fault for parts in self._parts for fault in parts.frames()]
        if frames:
            medium.faults = FrameFaults(frames)
        for node in simulation.nodes.values():
            self._filter(node.identity.id, node.parts.network)
        for parts, rule in zip(self._parts, self._rules, strict=True):
            if isinstance(rule, CrashRule):
                self._crash(parts, rule, simulation)
            elif isinstance(rule, RoleCrashRule):
                self._crash_role(parts, rule, simulation)
            elif isinstance(rule, JammerRule):
                self._jam(parts, rule, medium)
            else:
                parts.announce()

    def _filter(self, node: int, network: object) -> None:
        rules = [fault for parts in self._parts for fault in parts.packets(node)]
        if rules and isinstance(network, Network):
            network.filter = PacketFaults(node, rules, lambda: self._clock.now_ns)

    def _crash(self, parts: FaultParts, rule: CrashRule, simulation: Simulation) -> None:
        crashes = Crashes(
            nodes=sorted(self._names.all_of(rule.nodes)),
            at_ns=None if rule.at_s is None else s_to_ns(rule.at_s),
            mean_ns=0.0 if rule.rate_per_h is None else NS_PER_H / rule.rate_per_h,
            down_ns=None if rule.reboot_after_s is None else s_to_ns(rule.reboot_after_s),
            is_random=rule.reboot == "exponential",
        )
        stream = lambda node: self._streams.generator(f"{parts.name}/node/{node}")  # noqa: E731
        CrashSchedule(self._clock, crashes, simulation.crash, parts.announcer, stream)

    def _crash_role(self, parts: FaultParts, rule: RoleCrashRule, simulation: Simulation) -> None:
        share = float(self._streams.generator(f"{parts.name}/instant").random())
        at_ns = s_to_ns(rule.at_s + share * rule.spread_s)
        down_ns = None if rule.reboot_after_s is None else s_to_ns(rule.reboot_after_s)
        RoleCrash(
            self._clock,
            self._holders,
            RoleStrike(rule.role, at_ns, down_ns, rule.most),
            simulation.crash,
            parts.announcer,
        )

    def _jam(self, parts: FaultParts, rule: JammerRule, medium: AnyMedium) -> None:
        if not isinstance(medium, SinrMedium):
            text = "a medium on which signals interfere, for a jammer to disturb"
            got = "a medium without interference"
            raise ScenarioError(
                [self._loaded.document.finding(("faults", parts.index), text, got, self._interfering())]
            )
        period_ns = None if rule.on_s is None or rule.off_s is None else (s_to_ns(rule.on_s), s_to_ns(rule.off_s))
        powers_mw = self._powers_mw(parts, rule)
        JammerSchedule(self._clock, medium, parts.announcer, rule.position_m, powers_mw, span_of(rule), period_ns)

    def _interfering(self) -> str:
        """How to come by a medium on which signals interfere."""
        scenario = self._loaded.scenario
        if isinstance(scenario.medium, IdealMediumParameters):
            return "set `medium: {type: log-distance}` or another with `reception: sinr`"
        if scenario.fidelity is not None:
            return f"set `fidelity: sinr` or a higher rung: `{scenario.fidelity}` takes interference away"
        return f"set `reception: sinr` in `medium`: `{scenario.medium.reception}` takes interference away"

    def _powers_mw(self, parts: FaultParts, rule: JammerRule) -> Mapping[int, float]:
        """What a jammer's signal is worth at every node it reaches."""
        law = self._loaded.scenario.medium
        if isinstance(law, IdealMediumParameters | TraceMediumParameters):
            text, got = "a medium whose power falls with distance, for a jammer's to be known", law.type
            remedy = "set `medium: {type: log-distance}`, or leave the jammer out: a file has links of nodes only"
            raise ScenarioError([self._loaded.document.finding(("faults", parts.index), text, got, remedy)])
        offset_m = positions_m(self._places) - np.array(rule.position_m)
        gains_db = -path_loss_db(np.hypot(offset_m[:, 0], offset_m[:, 1]), law)
        powers = zip(self._places, (rule.power_dbm + gains_db).tolist(), strict=True)
        return {place.id: dbm_to_mw(dbm) for place, dbm in powers if dbm_to_mw(dbm) > NOTABLE_MW}

    def _findings(self) -> Iterator[Finding]:
        for index, rule in enumerate(self._rules):
            for path, reference in _references(rule):
                if not self._names.of(reference):
                    yield self._finding(
                        (index, *path),
                        "a node's id or name, or a group's name",
                        repr(reference),
                        self._names.remedy(reference),
                    )
            yield from self._misfits(index, rule)

    def _misfits(self, index: int, rule: FaultRule) -> Iterator[Finding]:
        if isinstance(rule, PartitionRule):
            yield from self._overlaps(index, rule)
        elif rule.type.startswith("sensor-"):
            senses = {place.id for place in self._places if place.sensor is not None}
            without = sorted(self._names.all_of(getattr(rule, "nodes", None)) - senses)
            if without:
                yield self._finding((index, "nodes"), "nodes that have a sensor", f"{named(without)} without one")

    def _overlaps(self, index: int, rule: PartitionRule) -> Iterator[Finding]:
        seen: set[int] = set()
        for number, group in enumerate(rule.groups):
            nodes = self._names.all_of(group)
            if nodes & seen:
                where = named(sorted(nodes & seen))
                yield self._finding((index, "groups", number), "nodes that are in no other part", f"{where} in two")
            seen |= nodes

    def _finding(self, path: ValuePath, expected: str, got: str, remedy: str = "") -> Finding:
        return self._loaded.document.finding(("faults", *path), expected, got, remedy)


def _references(rule: FaultRule) -> Iterator[tuple[ValuePath, NodeRef]]:
    """Every mention of a node in a rule, with its place in it."""
    for number, reference in enumerate(getattr(rule, "nodes", None) or ()):
        yield ("nodes", number), reference
    for number, pair in enumerate(getattr(rule, "links", None) or ()):
        yield from ((("links", number, end), reference) for end, reference in enumerate(pair))
    if isinstance(rule, PartitionRule):
        for number, group in enumerate(rule.groups):
            yield from ((("groups", number, place), reference) for place, reference in enumerate(group))

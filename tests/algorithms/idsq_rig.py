"""Runs of the IDSQ tracker on small worlds."""

import math
from collections import defaultdict
from itertools import pairwise

from netsim.algorithms.idsq_payload import BeliefCoder
from netsim.kernels.idsq import Choice, Filter, table_1
from netsim.metrics.collect import metrics_of
from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.trace.events import EVENT_TYPES, AlgorithmRecord, Estimate, NodeLife, Role, TruthTargets

S = 1_000_000_000
SAMPLE_NS = 10_000_000
WORLD = """
kind: scenario
schema_version: 1
name: world
seed: {seed}
duration_s: {duration_s}
field: {{width_m: 120, height_m: 120}}
nodes:
  - name: sensors
    placement: {{type: jittered-grid, rows: {rows}, columns: {rows}, jitter_sd_m: 3}}
    radio: cc2420
    cpu: {cpu}
    {node}
medium: {medium}
mac: {mac}
problem:
  type: tracking
  targets:
    - track: {{type: straight, from_m: [60, {from_m}], to_m: [60, 120], speed_m_per_s: 7, enters_s: {enters_s}}}
    {targets}
  neighbourhood_m: 40
  {problem}
algorithm: {{type: idsq, {algorithm}}}
{more}
"""
IDEAL = "{type: ideal}"
RADIO = "{type: log-distance, shadowing_sd_db: 2}"


def world(folder, algorithm="", *, medium=IDEAL, mac=IDEAL, **more):
    """A scenario on a field of 120 m x 120 m: a target drives north through the middle."""
    words = {
        "seed": 1,
        "duration_s": 16,
        "rows": 6,
        "from_m": 0,
        "enters_s": 0,
        "targets": "",
        "problem": "",
        "more": "",
        "node": "",
        "cpu": "sh4_7751",
    }
    path = folder / "world.yaml"
    path.write_text(WORLD.format(algorithm=algorithm, medium=medium, mac=mac, **(words | more)))
    return load(path)


class Run:
    """What happened in a run."""

    def __init__(self, loaded):
        self.events = []
        self.built = build(loaded, [self])
        self.built.simulation.run()
        self.built.simulation.conclude()
        self.problem = self.built.problem

    def handlers(self):
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.events.append((time_ns, event)))

    def of(self, event_type):
        return [(time_ns, event) for time_ns, event in self.events if isinstance(event, event_type)]

    def figures(self):
        return metrics_of(self.events)

    def records(self, kind):
        return [(time_ns, event) for time_ns, event in self.of(AlgorithmRecord) if event.kind == kind]

    def crashes(self):
        return [(time_ns, event.node) for time_ns, event in self.of(NodeLife) if event.event == "crashed"]

    def led(self, role="leader"):
        """How long how many nodes held a role: ns by number."""
        times = defaultdict(int)
        count, since = 0, 0
        for time_ns, event in self.of(Role):
            if event.role == role:
                times[count] += time_ns - since
                since = time_ns
                count += 1 if event.holds else -1
        times[count] += self.built.simulation.now_ns - since
        return dict(times)

    def longest(self, least):
        """The longest time in a row, in ns, with so many leaders or more."""
        longest, count, since = 0, 0, None
        for time_ns, event in [*self.of(Role), (self.built.simulation.now_ns, None)]:
            if event is None or event.role == "leader":
                was = count
                count += 0 if event is None else 1 if event.holds else -1
                if was < least <= count:
                    since = time_ns
                if was >= least and since is not None:
                    longest = max(longest, time_ns - since)
        return longest

    def estimate_gap_s(self, from_s=0.0, to_s=math.inf):
        """The longest time without an estimate while there is a target."""
        alive = [time_ns / S for time_ns, event in self.of(TruthTargets) if event.target]
        end = min(to_s, max(alive))
        times = [from_s, *(t / S for t, _ in self.of(Estimate) if from_s <= t / S <= end), end]
        return max(b - a for a, b in pairwise(times))

    def errors_m(self, from_s=0.0, to_s=math.inf, target=0):
        """Distance of each estimate from a target while it is there."""
        way = self.problem.tracks[target]
        places = [(event, way.at(time_ns)) for time_ns, event in self.of(Estimate) if from_s <= time_ns / S < to_s]
        return [math.dist((event.x_m, event.y_m), place) for event, place in places if place is not None]


def reference(run, steps, **choice):
    """What Table 1 makes of the same world."""
    problem = run.problem
    knowledge = {node: problem.knowledge(node) for node in problem.sensors}
    step_ns = round(problem.parameters.reading_s * S)
    first = problem.first_leader
    radius_m = problem.parameters.max_speed_m_per_s * problem.parameters.reading_s
    reading = lambda node, step: float(problem.observe(node, step * step_ns + SAMPLE_NS)[0])  # noqa: E731
    generators = {node: problem.streams.generator(f"node/{node}/algorithm/selection") for node in problem.sensors}
    coder = BeliefCoder(problem.grid, "float64")
    received = lambda belief: coder.decode(coder.encode(belief).data)  # noqa: E731
    rules = Filter(radius_m, 2e-5), Choice(**choice)
    return table_1(knowledge, reading, first, steps, *rules, generators.__getitem__, received)

"""Runs of joint tracking on the shipped crossing, and what they tell."""

import json
from collections import defaultdict

from netsim.metrics.collect import metrics_of
from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.trace.events import EVENT_TYPES, AlgorithmRecord, Estimate, Log, NodeLife, Role
from netsim.units import NS_PER_S


class JointRun:
    """What happened in a run of a scenario with some settings changed, as `path=value`."""

    def __init__(self, path, *settings):
        self.events = []
        built = build(load(path, settings), [self])
        built.simulation.run()
        built.simulation.conclude()
        self.problem, self.end_ns = built.problem, built.simulation.now_ns

    def handlers(self):
        return dict.fromkeys(EVENT_TYPES, lambda event, time_ns: self.events.append((time_ns, event)))

    def of(self, event_type):
        return [(time_ns, event) for time_ns, event in self.events if isinstance(event, event_type)]

    def figures(self):
        return metrics_of(self.events)

    def changes(self):
        """Merges and splits in order."""
        return [event.kind for _, event in self.of(AlgorithmRecord) if event.kind in ("merge", "split")]

    def parts(self):
        records = [event for _, event in self.of(AlgorithmRecord) if event.kind in ("merge", "split")]
        return [json.loads(event.fields_json)["parts"] for event in records]

    def crashes(self):
        return [event for _, event in self.of(NodeLife) if event.event == "crashed"]

    def logs(self, words):
        return [(time_ns / NS_PER_S, event.message) for time_ns, event in self.of(Log) if words in event.message]

    def leaders(self):
        """For each track when how many nodes lead it: (from s, nodes) in order; a node that goes down leads no more."""
        holders, found = defaultdict(set), defaultdict(list)
        for time_ns, event in self.events:
            if isinstance(event, Role) and event.role.startswith("leader "):
                track = int(event.role.split()[1])
                (holders[track].add if event.holds else holders[track].discard)(event.node)
                found[track].append((time_ns / NS_PER_S, frozenset(holders[track])))
            elif isinstance(event, NodeLife) and event.event not in ("started", "rebooted"):
                for track in [track for track, nodes in holders.items() if event.node in nodes]:
                    holders[track].discard(event.node)
                    found[track].append((time_ns / NS_PER_S, frozenset(holders[track])))
        return found

    def longest_s(self, track, least):
        """The longest time in a row with so many leaders or more."""
        longest, since = 0.0, None
        for time_s, nodes in [*self.leaders()[track], (self.end_ns / NS_PER_S, frozenset())]:
            if len(nodes) >= least and since is None:
                since = time_s
            elif len(nodes) < least and since is not None:
                longest, since = max(longest, time_s - since), None
        return longest

    def leader_at(self, time_s, track):
        """Who leads a track at a time, the lowest of several."""
        nodes = next(nodes for at_s, nodes in reversed(self.leaders()[track]) if at_s <= time_s)
        return min(nodes)

    def estimated(self, track):
        """The readings' numbers with an estimate of a track."""
        return [time_ns // NS_PER_S for time_ns, event in self.of(Estimate) if event.target == track]

'''Test doubles for authors of algorithms: some nodes, a perfect or a scripted medium, no physics.

Nodes, handles, inboxes, CPUs and batteries are those of a simulation, so an algorithm sees no difference; only what lies
below a message is replaced. A run takes milliseconds and is the same every time.

    >>> from netsim.trace.events import Log
    >>> class Roll:
    ...     """Tell everybody one's number and log the numbers of the others."""
    ...
    ...     def run(self, node):
    ...         node.broadcast("number", bytes([node.id]))
    ...         for _ in node.neighbours:
    ...             message = yield from node.receive(kinds={"number"}, timeout_ns=10_000_000)
    ...             node.log("missing" if message is None else f"heard {message.payload[0]}")
    >>> run = run_algorithm(Roll(), nodes=3).require_success()
    >>> [message.source for message in run.delivered[0]]
    [1, 2]

What goes wrong on the way is a rule outside the code under test:

    >>> lossy = ScriptedMedium([rule(DROP, kind="number", source=1, destination=0)])
    >>> run = run_algorithm(Roll(), nodes=3, medium=lossy)
    >>> [event.message for _, event in run.of(Log) if event.name == "node 0"]
    ['heard 2', 'missing']

The devices are made for mental arithmetic: an operation of the CPU takes 1 us and 1 nJ, a reading of the sensor 1 ms and
1 uJ; the radio draws nothing, wakes at once, and queues nothing.
'''

from netsim.testing.bench import TestRun, run_algorithm
from netsim.testing.media import (
    DROP,
    PASS,
    MessageMedium,
    Passage,
    PerfectMedium,
    Rule,
    ScriptedMedium,
    Verdict,
    delay,
    duplicate,
    rule,
)

__all__ = [
    "DROP",
    "PASS",
    "MessageMedium",
    "Passage",
    "PerfectMedium",
    "Rule",
    "ScriptedMedium",
    "TestRun",
    "Verdict",
    "delay",
    "duplicate",
    "rule",
    "run_algorithm",
]

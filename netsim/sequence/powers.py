"""What a node's radio draws while it sends: from the ledger at the end of a trace."""

from collections import defaultdict
from pathlib import Path

from netsim.trace.events import EnergyLedger
from netsim.trace.reader import last_time_ns, read_trace

PowerKey = tuple[int, str, str]
"""Node, what its radio does, kind of the message that it does it for."""

_STATES = {"data": "transmit", "retry": "retransmit", "ack": "ack_transmit", "strobe": "strobe_transmit"}


def power_key(node: int, role: str, kind: str) -> PowerKey:
    """Where the power of a frame's sender is found."""
    return node, _STATES[role], kind


def radio_powers_w(trace: Path) -> dict[PowerKey, float]:
    """Power of each node's radio in each state and for each kind of message, over the run.

    Where a node always sends at one power, this times the airtime is what a frame cost its sender. Empty if the trace was
    cut short: the ledger is written at its end.
    """
    energy_j: defaultdict[PowerKey, float] = defaultdict(float)
    time_s: defaultdict[PowerKey, float] = defaultdict(float)
    for _, event in read_trace(trace, {EnergyLedger.topic}, start_ns=last_time_ns(trace)):
        if not isinstance(event, EnergyLedger):
            continue
        columns = (event.node, event.device, event.state, event.kind, event.energy_j, event.time_s)
        for node, device, state, kind, joules, seconds in zip(*columns, strict=True):
            if device == "radio":
                energy_j[int(node), state, kind] += float(joules)
                time_s[int(node), state, kind] += float(seconds)
    return {key: joules / time_s[key] for key, joules in energy_j.items() if time_s[key] > 0.0}

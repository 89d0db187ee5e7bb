"""Energy: an exchange by hand, the closure of the ledger, a day of listening."""

from collections import defaultdict
from typing import Any

import numpy as np

from netsim.sim.frames import MAC_OVERHEAD_BYTE
from netsim.sim.net.packet import HEADER_BYTE
from netsim.trace.events import RADIO_STATES, EnergyLedger, NodeEnergy, RadioState
from validation import page
from validation.run import Log, run

RX_NJ_PER_US, TX_NJ_PER_US = 56.4, 52.2
PAYLOAD_BYTE = 30
TWO = """
kind: scenario
schema_version: 1
name: exchange
duration_s: 0.2
field: {{width_m: 40, height_m: 40}}
nodes:
  - name: all
    placement: {{type: grid, rows: 1, columns: {nodes}, spacing_m: 10}}
    battery: {{type: capacity, energy_j: {battery_j}}}
    sensor: null
medium: {{type: log-distance, shadowing_sd_db: 0}}
mac: {{type: csma, min_be: 0}}
network: {{type: one-hop}}
algorithm: {algorithm}
trace: {{detail: full, energy_interval_s: {interval_s}}}
"""
LISTENING = TWO.replace("duration_s: 0.2", "duration_s: 86400").replace("{{detail: full", "{{detail: summary")


def section() -> str:
    """The part of the page on energy."""
    return "\n".join(["## Energy\n", _exchange(), _day(), _closure()])


def _ledger(log: Log) -> dict[tuple[int, str, str], tuple[float, float]]:
    """Energy (uJ) and time (us) by node, device and state."""
    ((_, ledger),) = log.of(EnergyLedger)
    found: dict[tuple[int, str, str], tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))
    rows = zip(ledger.node, ledger.device, ledger.state, ledger.energy_j, ledger.time_s, strict=True)
    for node, device, state, energy_j, time_s in rows:
        energy, time = found[int(node), device, state]
        found[int(node), device, state] = (energy + 1e6 * energy_j, time + 1e6 * time_s)
    return found


def _exchange() -> str:
    log = Log()
    algorithm = f'{{type: "validation.algorithms:Pairs", gaps_us: [0], payload_byte: {PAYLOAD_BYTE}}}'
    run(TWO.format(nodes=2, battery_j=100, algorithm=algorithm, interval_s=0.01), [log])
    data_us = (6 + MAC_OVERHEAD_BYTE + HEADER_BYTE + PAYLOAD_BYTE) * 32
    ack_us = (6 + 5) * 32
    ledger = _ledger(log)
    end_us = sum(time for (node, device, _), (_, time) in ledger.items() if (node, device) == (1, "radio"))
    hand = {
        (1, "transmit"): (data_us, TX_NJ_PER_US),
        (1, "ack_receive"): (ack_us, RX_NJ_PER_US),
        (1, "switch"): (2 * 192, RX_NJ_PER_US),
        (1, "listen"): (end_us - data_us - ack_us - 384, RX_NJ_PER_US),
        (0, "receive"): (data_us, RX_NJ_PER_US),
        (0, "ack_transmit"): (ack_us, TX_NJ_PER_US),
        (0, "switch"): (2 * 192, RX_NJ_PER_US),
        (0, "listen"): (end_us - data_us - ack_us - 384, RX_NJ_PER_US),
    }
    rows, worst = [], 0.0
    for (node, state), (time_us, nj) in hand.items():
        energy, time = ledger[node, "radio", state]
        worst = max(worst, abs(energy / (time_us * nj / 1e3) - 1.0), abs(time / time_us - 1.0))
        name = "sender" if node == 1 else "receiver"
        rows.append(
            (f"{name}, {state}", f"{time_us:,.0f}", f"{time:,.0f}", f"{time_us * nj / 1e3:.4f}", f"{energy:.4f}")
        )
    header = ["device and state", "time by hand (us)", "simulated (us)", "energy by hand (uJ)", "simulated (uJ)"]
    return f"""\
### An acknowledged frame by hand

CC2420 at 3.0 V: 18.8 mA or 56.4 mW listening, receiving and switching, 17.4 mA or 52.2 mW sending at 0 dBm. The sender
assesses the channel for 128 us (no back-off here), turns round in 192, sends {data_us // 32} bytes at 32 us each, turns
round, and hears the acknowledgement of 11 bytes, which the receiver sends after a turnaround of its own.

{page.table(header, rows)}
Largest relative difference: {worst:.0e}. A test holds a longer exchange, of five frames with two losses, to every instant
and microjoule.

{_timeline(log)}"""


def _timeline(log: Log) -> str:
    states = log.of(RadioState)
    power_mw = {"transmit": 52.2, "listen": 56.4, "receive": 56.4, "switch": 56.4}
    colours = {"transmit": page.RED, "listen": page.GREY, "receive": page.BLUE, "switch": page.ORANGE}
    figure, axis = page.axes(height=2.6)
    first_ms = next(time_ns for time_ns, event in states if RADIO_STATES[event.state] == "switch") / 1e6 - 0.4
    for node in (0, 1):
        own = [(time_ns / 1e6, RADIO_STATES[event.state]) for time_ns, event in states if event.node == node]
        for place, (begin, state) in enumerate(own):
            end = own[place + 1][0] if place + 1 < len(own) else first_ms + 5
            axis.broken_barh([(begin - first_ms, end - begin)], (node - 0.35, 0.7), color=colours[state])
    for state, colour in colours.items():
        axis.plot([], [], "s", color=colour, label=f"{state}, {power_mw[state]} mW")
    axis.set(xlabel="time (ms)", yticks=[0, 1], xlim=(0, 4.2), ylim=(-0.6, 2.1))
    axis.set_yticklabels(["receiver", "sender"])
    axis.set_title("Radio states of an acknowledged frame")
    axis.legend(ncol=2, loc="upper right", fontsize=8)
    axis.grid(visible=False)
    return page.save(figure, "exchange", "Radio states of sender and receiver during an acknowledged frame")


def _day() -> str:
    log = Log()
    run(LISTENING.format(nodes=1, battery_j=10_000, algorithm='{type: "validation.algorithms:Listener"}', interval_s=43_200),
        [log])  # fmt: skip
    energy, time = _ledger(log)[0, "radio", "listen"]
    by_hand = 18.8e-3 * 3.0 * 86_400
    return f"""\
### A day of listening

A CC2420 that listens for a day costs 18.8 mA x 3.0 V x 86,400 s = {by_hand:.2f} J by the data sheet; the ledger has
{energy / 1e6:.2f} J for {time / 1e6:,.0f} s. (Two AA cells of 18,720 J last {18_720 / by_hand:.1f} days so.) Listening is
priced as receiving, because the receiver is on.
"""


def _closure() -> str:
    """The two independent sums of a shipped scenario."""
    log = Log()
    scenario = (page.ROOT / "scenarios" / "quickstart.yaml").read_text(encoding="utf-8")
    run(scenario, [log])
    ((_, ledger),) = log.of(EnergyLedger)
    _, last = log.of(NodeEnergy)[-1]
    booked: dict[int, float] = defaultdict(float)
    time: dict[int, float] = defaultdict(float)
    rows = zip(ledger.node, ledger.device, ledger.energy_j, ledger.time_s, strict=True)
    for node, device, energy_j, time_s in rows:
        booked[int(node)] += energy_j
        time[int(node)] += time_s if device == "radio" else 0.0
    pairs: list[tuple[Any, Any]] = [(booked[int(n)], c) for n, c in zip(last.node, last.consumed_j, strict=True)]
    apart = max(abs(a / b - 1.0) for a, b in pairs)
    spans = np.array(list(time.values()))
    return f"""\
### Closure

Two sums of the same draw are kept in whole yoctojoules: the battery integrates the node's power, the ledger books every
device, state and message. `scenarios/quickstart.yaml`, {len(pairs)} nodes: they differ by {apart:.0e}, relative (printed as
floats; the run itself refuses a difference above 1e-9), and the radio's states add up to the run's
{spans.max():.9f} s on every node (largest difference {np.ptp(spans):.0e} s).
"""

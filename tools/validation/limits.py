"""What the radio does not model."""

from validation import page

RUNGS = ("ideal", "prr", "sinr", "csma", "lpl")
YES, NO = "yes", "no"
ROWS = [
    ("path loss, static shadowing, asymmetric links", ["links of a PRR of a half or more", YES, YES, YES, YES]),
    ("noise (constant, varying, replayed), bit errors", [NO, "as each link's PRR", YES, YES, YES]),
    ("fading from frame to frame, if the medium has it", [NO, "in the PRR's mean", YES, YES, YES]),
    ("interference, summed over every overlapping segment", [NO, NO, YES, YES, YES]),
    ("a radio is deaf while it sends; a receiver takes one frame at a time", [NO, NO, YES, YES, YES]),
    ("capture of a later, stronger frame, if the radio's table has it", [NO, NO, YES, YES, YES]),
    ("airtime, turnaround, radio states and their energy", [YES, YES, YES, YES, YES]),
    ("carrier sensing, back-off, acknowledgement, retries", [NO, NO, NO, YES, YES]),
    ("receivers that are off between checks", [NO, NO, NO, NO, YES]),
]
NOT_MODELLED = [
    ("propagation delay", "a frame reaches all listeners at once", "300 m are 1 us, a sixteenth of a symbol"),
    ("adjacent channels", "one channel; nothing leaks from the next", "optimistic for dense networks on several channels"),
    ("frequency-selective fading", "one gain a frame, flat over the band; none across channels", "channel hopping gains"
     " nothing here but what a K7 recording holds"),
    ("how long a fade lasts", "frames fade independently", "losses come singly where reality has bursts; use the burst"
     " fault or a recording"),
    ("antenna patterns, polarisation, height", "all antennas alike in all directions", "shadowing and asymmetry stand in"),
    ("shadowing that neighbours share", "each pair draws its own", "obstacles that cut many links at once do not occur"),
    ("shadowing that changes as nodes move", "it belongs to the pair, not to the place", "a moving node's link keeps it"),
    ("synchronisation in detail", "a preamble is caught above a fixed SINR, at its start", "no false or late lock; capture"
     " has no time window but the frame's own"),
    ("modulated interference", "another 802.15.4 frame counts as white noise", "two equally strong frames: one survives"
     " in 94 of 100 cases (50 bytes); measured radios need 1 to 3 dB"),
    ("other networks on the band", "only as noise, a jammer or a recording", "WLAN's losses at strong links, seen in"
     " Grenoble, must be put in"),
    ("receiver saturation, non-linearity", "none; a scenario in which a node would receive more than 0 dBm is refused",
     "nodes closer than about a metre are optimistic"),
    ("readings of received power", "exact in the trace", "real radios report steps of 1 to 3 dB and nothing below a floor"),
    ("temperature, supply voltage", "currents, sensitivity and clocks are constant", "the energy of a failing battery is"
     " the energy of a fresh one"),
    ("clock drift inside the MAC", "symbols, back-offs and the wake interval of low-power listening are exact; TDMA's slots"
     " and duty cycles follow the node's own clock", "at 40 ppm a back-off is off by under a microsecond"),
    ("several spreading factors on one medium", "all LoRa radios of a medium have the same settings", "a gateway that hears"
     " several at once cannot be simulated"),
    ("adapting to the network at run time", "TDMA's slots are those of the links at the start", "nodes that move keep their"
     " slots"),
    ("self-discharge, voltage drop, ageing", "only in `netsim lifetime`, as a percentage", "long runs of weeks are"
     " optimistic"),
    ("a jammer's shadowing", "the medium's path loss alone, to the nodes' places at the start", "the jammed area is rounder"
     " than a real one"),
    ("averaging in a clear channel assessment", "every signal that touches the eight symbols counts in full", "two frames"
     " at -87 dBm, one after the other, read -84 dBm: slightly more often busy"),
    ("processing time of the radio driver", "none; turnaround and start-up only", "SPI transfers of real nodes cost about a"
     " millisecond and some energy"),
]  # fmt: skip


def section() -> str:
    """The part of the page on limits."""
    rungs = page.table(["on the rung", *RUNGS], [(name, *there) for name, there in ROWS])
    missing = "\n".join(["| effect | instead | what it means |", "| --- | --- | --- |"]
                        + [f"| {' | '.join(row)} |" for row in NOT_MODELLED])  # fmt: skip
    return f"""\
## What the radio models, and what it does not

By rung of `fidelity:`

{rungs}
On no rung:

{missing}
"""

"""The vocabulary of what can happen in a run: one frozen record a kind of event, each with its topic in the trace.

Every event is recorded at the simulated instant it happened, so the log times of a trace never decrease. The wire
types (`U32`, `F64Array`, ...) are what the trace writer lays out (`netsim.trace.cdr`); the units are in the names. Node
ids are `uint32`, `BROADCAST` (2^32 - 1) stands for "all in range". The vocabulary is closed, but for `AlgorithmRecord`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

BROADCAST = 0xFFFFFFFF

I64 = Annotated[int, "int64"]
U32 = Annotated[int, "uint32"]
U8 = Annotated[int, "uint8"]
F64 = Annotated[float, "float64"]
Text = Annotated[str, "string"]
U32Array = Annotated[Sequence[int] | NDArray[np.uint32], "uint32[]"]
U8Array = Annotated[Sequence[int] | NDArray[np.uint8], "uint8[]"]
I32Array = Annotated[Sequence[int] | NDArray[np.int32], "int32[]"]
F32Array = Annotated[Sequence[float] | NDArray[np.float32], "float32[]"]
F64Array = Annotated[Sequence[float] | NDArray[np.float64], "float64[]"]
TextArray = Annotated[Sequence[str], "string[]"]

# What became of a frame at one listener. The position in the tuple is the code in `Frame.rx_outcome`.
OUTCOMES = (
    "received",  # decoded, and addressed to this node or broadcast
    "overheard",  # decoded, but addressed to another node
    "collided",  # lost, and without the interference it would have had more than an even chance
    "weak",  # lost to noise
    "half_duplex",  # the listener was transmitting
    "busy",  # the listener was locked on another frame
    "asleep",  # the listener's radio was asleep or switching
    "dead",  # the listener, or the sender half-way, ran out of energy or crashed
    "lost",  # dropped by a link's loss probability on a medium without interference, or by a fault rule's
    "captured",  # the listener left it for a stronger frame that began later
    "jammed",  # lost, and without the jammer it would have had more than an even chance
    "outage",  # a fault rule cut the link
    "corrupted",  # a fault rule flipped bits, and the checksum told
)
OUTCOME_CODE = {name: code for code, name in enumerate(OUTCOMES)}

# Radio states; the position is the code in `RadioState.state`.
RADIO_STATES = (
    "off",  # the node has crashed
    "sleep",  # powered down, deaf
    "listen",  # the receiver is open
    "receive",  # locked on a frame
    "transmit",  # a frame is on the air
    "switch",  # turning around between listening and sending, or starting up
    "dead",  # the battery is empty
    "idle",  # the receiver is off, the oscillator runs
)
RADIO_STATE_CODE = {name: code for code, name in enumerate(RADIO_STATES)}


@dataclass(frozen=True, slots=True)
class NodeTable:
    """Who takes part: one row a node, written at time 0."""

    topic: ClassVar[str] = "/nodes/info"
    node: U32Array
    name: TextArray
    group: TextArray
    role: TextArray
    """`sensor` or `sink`."""
    x_m: F64Array
    y_m: F64Array
    radio: TextArray
    cpu: TextArray
    battery_j: F64Array
    """Usable energy at the start; infinity for mains power."""


@dataclass(frozen=True, slots=True)
class LinkTable:
    """The radio neighbourhood, one row an ordered pair that can hear each other, written at time 0."""

    topic: ClassVar[str] = "/links/info"
    source: U32Array
    destination: U32Array
    gain_db: F32Array
    """Received over transmitted power, at the node's transmit power; 0 on the ideal medium."""
    prr: F32Array
    """Packet reception ratio of a full-size frame without interference."""


@dataclass(frozen=True, slots=True)
class FieldInfo:
    """The field, written at time 0."""

    topic: ClassVar[str] = "/world/field"
    width_m: F64
    height_m: F64
    x_m: F64
    """Lower left corner."""
    y_m: F64
    """Lower left corner."""


@dataclass(frozen=True, slots=True)
class RadioState:
    """A node's radio entered a state. At detail `frames` only sleep, off (crash), listen after them, dead; at `full` all."""

    topic: ClassVar[str] = "/nodes/radio"
    node: U32
    state: U8
    """Code: position in `RADIO_STATES`."""


@dataclass(frozen=True, slots=True)
class NodeLife:
    """A node's algorithm started or ended, or the node died, crashed or came up again."""

    topic: ClassVar[str] = "/nodes/life"
    node: U32
    event: Text
    """`started`, `finished`, `failed`, `died`, `crashed`, `rebooted`."""
    reason: Text
    """Name of the algorithm (`started`, `rebooted`), what it raised (`failed`), or what brought the node down."""


@dataclass(frozen=True, slots=True)
class NodePositions:
    """Nodes that moved, with where they are now."""

    topic: ClassVar[str] = "/nodes/position"
    node: U32Array
    x_m: F64Array
    y_m: F64Array


@dataclass(frozen=True, slots=True)
class NodeClocks:
    """How far each node's clock is ahead of true time; sampled at the scenario's energy interval where clocks drift."""

    topic: ClassVar[str] = "/nodes/clock"
    node: U32Array
    ahead_s: F64Array
    """The clock that the algorithm sees, synchronisation included, less true time."""


@dataclass(frozen=True, slots=True)
class EnergyBudget:
    """A node's energy allowance ran short, was replenished, or something was refused for want of it."""

    topic: ClassVar[str] = "/nodes/budget"
    node: U32
    event: Text
    """`short`, `replenished`, `refused`; `ended` for a task that has ended."""
    task: Text
    """What the allowance is for; empty for the node's own."""
    spent_j: F64
    allowance_j: F64
    action: Text
    """What was refused, or what the policy does: `send`, `sense`, `compute`, `sleep`, `warn`."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault rule of the scenario begins, ends or strikes."""

    topic: ClassVar[str] = "/faults"
    rule: U32
    """Position of the rule in the scenario's list."""
    kind: Text
    """Type of the rule, such as `crash`, `outage`, `jammer`."""
    event: Text
    """`begins`, `ends`, `strikes`."""
    node: U32Array
    """Nodes it concerns."""
    detail: Text


@dataclass(frozen=True, slots=True)
class RouteChange:
    """A node chose another next hop towards a destination."""

    topic: ClassVar[str] = "/nodes/route"
    node: U32
    destination: U32
    next_hop: U32
    """`BROADCAST` where it has none any more."""
    cost: F64
    """Of the whole way, in the metric of the routing (hops, or expected transmissions)."""


@dataclass(frozen=True, slots=True)
class NodeEnergy:
    """Energy of every node, sampled at the scenario's interval and at the end."""

    topic: ClassVar[str] = "/nodes/energy"
    node: U32Array
    consumed_j: F64Array
    left_j: F64Array
    """Infinity for mains power."""


@dataclass(frozen=True, slots=True)
class EnergyLedger:
    """Where every joule went: one row a node, device, state and message kind; written at the end."""

    topic: ClassVar[str] = "/energy/ledger"
    node: U32Array
    device: TextArray
    """`radio`, `cpu`, `sensor`."""
    state: TextArray
    """What the device did: `listen`, `receive`, `overhear`, `transmit`, `retransmit`, `ack_transmit`, `active`, ..."""
    kind: TextArray
    """Kind of the message served; empty where none was."""
    energy_j: F64Array
    time_s: F64Array


@dataclass(frozen=True, slots=True)
class EnergyHarvest:
    """What the harvesters brought, one row a node that has one; written at the end."""

    topic: ClassVar[str] = "/energy/harvest"
    node: U32Array
    offered_j: F64Array
    """What arrived at the battery."""
    spilled_j: F64Array
    """Of that, what found it full."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One transmission on the air and what became of it at each listener; recorded at its end."""

    topic: ClassVar[str] = "/frames"
    frame_id: U32
    t_start_ns: I64
    t_end_ns: I64
    source: U32
    destination: U32
    """Next hop, or `BROADCAST`."""
    kind: Text
    """Kind of the message it carries (of the message acknowledged, for an acknowledgement)."""
    is_ack: U8
    size_byte: U32
    """Physical-layer payload (PSDU), MAC header and checksum included."""
    attempt: U8
    """0 for the first transmission, 1 for the first retry, ..."""
    message_id: U32
    tx_power_dbm: F64
    rx_node: U32Array
    rx_outcome: U8Array
    """Code: position in `OUTCOMES`."""
    rx_rssi_dbm: F32Array
    rx_sinr_db: F32Array
    """Lowest over the frame; infinity on the ideal medium."""
    is_strobe: U8 = 0
    """1 for a wake-up frame of low-power listening: it announces the message but carries nothing of it."""


@dataclass(frozen=True, slots=True)
class MessageSent:
    """An algorithm handed a message to its network layer."""

    topic: ClassVar[str] = "/messages/sent"
    message_id: U32
    source: U32
    destination: U32
    kind: Text
    size_byte: U32
    """Application payload."""
    fragments: U32
    causes: U32Array
    """Messages whose reception led to this one."""


@dataclass(frozen=True, slots=True)
class MessageDelivered:
    """A message reached an inbox, whole."""

    topic: ClassVar[str] = "/messages/delivered"
    message_id: U32
    source: U32
    node: U32
    kind: Text
    size_byte: U32
    hops: U8
    latency_ns: I64


@dataclass(frozen=True, slots=True)
class MessageDropped:
    """A message, or a fragment of it, was given up at a node."""

    topic: ClassVar[str] = "/messages/dropped"
    message_id: U32
    """0 for what belongs to no message: control traffic, and bytes that make no sense (then `source` is the neighbour)."""
    source: U32
    destination: U32
    node: U32
    """Where it was given up."""
    kind: Text
    reason: Text
    """`no_ack`, `channel_busy`, `queue_full`, `no_route`, `hop_limit`, `reassembly_timeout`, `no_energy`,
    `reassembly_full` (too many incomplete messages), `malformed` (bytes that are no packet, or contradict it),
    `no_sequence` (65,536 messages in less than the network's `memory_s`), `died`, `crashed`. After `no_ack` the message may
    have arrived all the same. `died` and `crashed` are said of what waited to be sent (at the MAC, in the network layer, or
    for an energy allowance), was being sent, or had come in parts, when the node went down."""


@dataclass(frozen=True, slots=True)
class Problem:
    """The problem instance, enough to recompute its exact answer (see `netsim.problems`)."""

    topic: ClassVar[str] = "/problem"
    kind: Text
    """`association`, `event-association`, `factor-graph`, `target-distribution`, `tracking`, `energy-tracking`, `none`."""
    content_json: Text


@dataclass(frozen=True, slots=True)
class TruthTargets:
    """True target positions."""

    topic: ClassVar[str] = "/truth/targets"
    target: U32Array
    x_m: F64Array
    y_m: F64Array


@dataclass(frozen=True, slots=True)
class TruthOrigins:
    """Which target each measurement of a sensor came from."""

    topic: ClassVar[str] = "/truth/origins"
    node: U32
    x_m: F64Array
    """Measured positions (NaN where the sensor does not measure a position)."""
    y_m: F64Array
    target: I32Array
    """Target of each measurement; -1 for a false alarm."""


@dataclass(frozen=True, slots=True)
class TruthCounts:
    """True number of targets in each subregion."""

    topic: ClassVar[str] = "/truth/counts"
    variable: U32Array
    """The variable that stands for the number."""
    count: U32Array


@dataclass(frozen=True, slots=True)
class VariablePlacement:
    """Which node hosts which variable of the graphical model, and the model's edges; written at time 0."""

    topic: ClassVar[str] = "/model/placement"
    variable: U32Array
    name: TextArray
    host: U32Array
    edge_a: U32Array
    """Variable at one end of each edge."""
    edge_b: U32Array
    """The other ends."""


@dataclass(frozen=True, slots=True)
class GraphMessages:
    """Graph messages one node's variables sent in one round: the unit in which papers count communication."""

    topic: ClassVar[str] = "/model/messages"
    node: U32
    round: U32
    source: U32Array
    """Sending variable of each message sent."""
    destination: U32Array
    """Variable it was sent to."""
    remote: U8Array
    """1 if the destination variable lives on another node (so the message went over the air)."""
    computed: U32
    """How many messages were computed this round, sent or not; 0 where those sent are none of the inference itself: trees
    that grow, votes, verdicts."""
    largest_change: F64
    """Largest divergence between a computed message and the one it is compared with."""
    is_synchronous: U8
    """1 where `round` is the same instant on all nodes; 0 where it counts the node's own steps."""
    late_ns: I64
    """How much later than scheduled the node came to this round: its CPU was still busy with an earlier one."""


@dataclass(frozen=True, slots=True)
class Association:
    """A sensor's decision: which target each of its measurements came from."""

    topic: ClassVar[str] = "/associations"
    node: U32
    target: I32Array
    """Target of each measurement; -1 for a false alarm."""
    round: U32


@dataclass(frozen=True, slots=True)
class Marginals:
    """A host's (max-)marginal of one variable of a graphical model."""

    topic: ClassVar[str] = "/marginals"
    node: U32
    variable: U32
    probability: F64Array
    """Sums to one; a max-marginal is scaled so that it does. Of a sensor's association: measurement after measurement, the
    probability that it came from each covered target, ascending, and of a false alarm, over the number of measurements."""
    round: U32
    is_max: U8
    """1 for a max-marginal, 0 for a marginal."""


@dataclass(frozen=True, slots=True)
class PairProbabilities:
    """How probable it is that a measurement is of each event, by its owner, and what is certain about it."""

    topic: ClassVar[str] = "/pairs"
    node: U32
    variable: U32
    """The measurement's number among all."""
    event: U32Array
    """The events it may be of; of others it is not."""
    probability: F64Array
    low: F64Array
    """The exact probabilities are not below this, whatever the node was not told."""
    high: F64Array
    """The exact probabilities are not above this."""
    depth: U32
    """Levels of recursion used, t."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A position estimate of a target."""

    topic: ClassVar[str] = "/estimates"
    node: U32
    target: U32
    """Number of the track, one for the whole network; which target it follows is for the metrics to find out."""
    x_m: F64
    y_m: F64
    covariance_m2: F64Array
    """xx, xy, yy; empty when unknown."""
    thread: U8 = 0
    """Which of the track's redundant threads."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Which target a node believes that a track follows."""

    topic: ClassVar[str] = "/identities"
    node: U32
    track: U32
    """Number of the track, as in `Estimate.target`."""
    probability: F64Array
    """Of each target, at the place of its number; sums to one."""


@dataclass(frozen=True, slots=True)
class Belief:
    """A node's belief of where a track's target is, on a grid of square cells."""

    topic: ClassVar[str] = "/beliefs"
    node: U32
    target: U32
    """Number of the track, as in `Estimate.target`."""
    step: U32
    """Number of the track's measurement instant."""
    origin_x_m: F64
    """Lower left corner of the grid's first cell."""
    origin_y_m: F64
    """Lower left corner of the grid's first cell."""
    cell_m: F64
    columns: U32
    cell: U32Array
    """Cells of nonzero probability, row by row: row * columns + column."""
    probability: F64Array
    thread: U8 = 0
    """Which of the track's redundant threads."""


@dataclass(frozen=True, slots=True)
class Particles:
    """A leader's belief of where the target of a track is, or jointly those of several tracks, after a measurement.

    The particles are where they were drawn before the measurement, and their weights are what it made of them.
    """

    topic: ClassVar[str] = "/particles"
    node: U32
    step: U32
    """Number of the tracks' measurement instant."""
    target: U32Array
    """Numbers of the tracks, as in `Estimate.target`."""
    count: U32
    """How many particles the belief has; those told may be an even choice of them."""
    weight: F32Array
    """Of each particle told."""
    x_m: F32Array
    """Places by track, for each track those of all particles told."""
    y_m: F32Array


@dataclass(frozen=True, slots=True)
class Group:
    """Who took part in a measurement of a group of sensors around the targets of some tracks."""

    topic: ClassVar[str] = "/groups"
    node: U32
    """Its leader."""
    step: U32
    """Number of the tracks' measurement instant."""
    target: U32Array
    """Numbers of the tracks, as in `Estimate.target`; several in a joint group."""
    member: U32Array
    """Whose readings the leader used, its own among them if it took one."""


@dataclass(frozen=True, slots=True)
class Handoff:
    """A leader chose the next leader of a track and begins to hand the belief over."""

    topic: ClassVar[str] = "/handoffs"
    node: U32
    target: U32
    """Number of the track."""
    step: U32
    destination: U32
    candidate: U32Array
    """Among whom it chose."""
    utility: F64Array
    """What spoke for each of them; the greatest was chosen (mutual information: bits)."""
    form: Text
    """How the belief was laid out: `grid`, `gaussian`, `mixture`."""
    payload_byte: U32
    divergence_bit: F64
    """What the layout lost: Kullback-Leibler divergence of the belief from what the receiver decodes."""
    thread: U8 = 0
    """Which of the track's redundant threads."""


@dataclass(frozen=True, slots=True)
class Role:
    """A node took or left a role, such as `leader`."""

    topic: ClassVar[str] = "/roles"
    node: U32
    role: Text
    holds: U8


@dataclass(frozen=True, slots=True)
class AlgorithmRecord:
    """Whatever an algorithm wishes to note: the one open kind. `fields_json` is a JSON object, units in its keys."""

    topic: ClassVar[str] = "/algorithm"
    node: U32
    kind: Text
    fields_json: Text


@dataclass(frozen=True, slots=True)
class Log:
    """A line for people, laid out as the Foxglove log message so that its viewers show it."""

    topic: ClassVar[str] = "/log"
    sec: Annotated[int, "int32"]
    nanosec: U32
    level: U8
    """1 debug, 2 info, 3 warning, 4 error."""
    message: Text
    name: Text
    file: Text
    line: U32


Event = (
    NodeTable
    | LinkTable
    | FieldInfo
    | RadioState
    | NodeLife
    | NodePositions
    | NodeClocks
    | EnergyBudget
    | Fault
    | RouteChange
    | NodeEnergy
    | EnergyLedger
    | EnergyHarvest
    | Frame
    | MessageSent
    | MessageDelivered
    | MessageDropped
    | Problem
    | TruthTargets
    | TruthOrigins
    | TruthCounts
    | VariablePlacement
    | GraphMessages
    | PairProbabilities
    | Association
    | Marginals
    | Estimate
    | Identity
    | Belief
    | Particles
    | Group
    | Handoff
    | Role
    | AlgorithmRecord
    | Log
)
EVENT_TYPES: tuple[type[Event], ...] = Event.__args__

"""The tables of an export, in the order in which they are documented."""

from typing import Any

import numpy as np

from netsim.export.sheets import Sheet, computed, each, eaches, one, ones, place_of
from netsim.trace import events as e

_DECIDED = "Number of the target it came from; -1 for a false alarm"
_LEVELS = ("", "debug", "info", "warning", "error")


def _covariance(place: int) -> Any:
    def value(event: e.Estimate) -> float | None:
        return float(event.covariance_m2[place]) if len(event.covariance_m2) else None

    return value


def _particle_of(event: e.Particles) -> Any:
    return np.tile(np.arange(len(event.weight)), len(event.target))


def _track_of(event: e.Particles) -> Any:
    return np.repeat(np.asarray(event.target), len(event.weight))


def _weight_of(event: e.Particles) -> Any:
    return np.tile(np.asarray(event.weight), len(event.target))


_SCENE = (
    Sheet("nodes", "Who takes part", e.NodeTable, (
        *eaches(e.NodeTable, "node", "name", "group", "role", "x_m", "y_m", "radio", "cpu", "battery_j"),
    )),
    Sheet("links", "An ordered pair of nodes that can hear each other, at the start", e.LinkTable, (
        *eaches(e.LinkTable, "source"),
        each(e.LinkTable, "destination", meaning="Node id of the listener"),
        *eaches(e.LinkTable, "gain_db", "prr"),
    )),
    Sheet("field", "The field", e.FieldInfo, (
        *ones(e.FieldInfo, "width_m", "height_m"),
        one(e.FieldInfo, "x_m", meaning="West end in metres"),
        one(e.FieldInfo, "y_m", meaning="South end in metres"),
    )),
    Sheet("node_positions", "Where a node that moves is", e.NodePositions, (
        *eaches(e.NodePositions, "node", "x_m", "y_m"),
    ), "row"),
)  # fmt: skip

_TRAFFIC = (
    Sheet("frames", "A transmission on the air, recorded at its end", e.Frame, (
        *ones(e.Frame, "frame_id", "t_start_ns", "t_end_ns", "source"),
        one(e.Frame, "destination", meaning=f"Node id of the next hop; {e.BROADCAST} stands for all in reach"),
        one(e.Frame, "kind"),
        one(e.Frame, "is_ack", is_flag=True, meaning="Whether it is an acknowledgement"),
        *ones(e.Frame, "size_byte", "attempt", "message_id", "tx_power_dbm"),
        one(e.Frame, "is_strobe", is_flag=True, meaning="Whether it is a wake-up frame: it carries nothing of the message"),
    ), "frame"),
    Sheet("receptions", "What became of a frame at a node that could hear it", e.Frame, (
        *ones(e.Frame, "frame_id"),
        each(e.Frame, "rx_node", "node"),
        each(e.Frame, "rx_outcome", "outcome", "What became of it: " + ", ".join(e.OUTCOMES), codes=e.OUTCOMES),
        each(e.Frame, "rx_rssi_dbm", "rssi_dbm", "Received power in dBm"),
        each(e.Frame, "rx_sinr_db", "sinr_db", "Lowest signal to interference and noise ratio over the frame, in dB"),
    ), "frame"),
    Sheet("messages_sent", "A message that an algorithm handed to its network layer", e.MessageSent, (
        *ones(e.MessageSent, "message_id", "source", "destination", "kind", "size_byte"),
        one(e.MessageSent, "fragments", meaning="Packets it was cut into"),
    ), "message"),
    Sheet("message_causes", "A message whose reception led to another", e.MessageSent, (
        *ones(e.MessageSent, "message_id"),
        each(e.MessageSent, "causes", "cause", "Number of the message that led to it"),
    ), "message"),
    Sheet("messages_delivered", "A message that reached an inbox, whole", e.MessageDelivered, (
        *ones(e.MessageDelivered, "message_id", "source"),
        one(e.MessageDelivered, "node", meaning="Node id of the receiver"),
        *ones(e.MessageDelivered, "kind", "size_byte", "hops", "latency_ns"),
    ), "message"),
    Sheet("messages_dropped", "A message, or a fragment of one, that was given up", e.MessageDropped, (
        one(e.MessageDropped, "message_id", meaning="Number of the message; 0 for what belongs to none, such as beacons"),
        *ones(e.MessageDropped, "source", "destination"),
        one(e.MessageDropped, "node", meaning="Node id of the node that gave it up"),
        *ones(e.MessageDropped, "kind", "reason"),
    ), "message"),
    Sheet("route_changes", "A node's choice of another next hop", e.RouteChange, (
        one(e.RouteChange, "node"),
        one(e.RouteChange, "destination", meaning="Node id of the end of the way"),
        one(e.RouteChange, "next_hop", meaning=f"Node id of the next hop; {e.BROADCAST} where there is none any more"),
        one(e.RouteChange, "cost"),
    ), "node"),
)  # fmt: skip

_DEVICES = (
    Sheet("radio_states", "A radio that entered a state", e.RadioState, (
        one(e.RadioState, "node"),
        one(e.RadioState, "state", meaning="The state: " + ", ".join(e.RADIO_STATES), codes=e.RADIO_STATES),
    ), "node"),
    Sheet("node_lives", "An algorithm or a node that started or ended", e.NodeLife, (
        *ones(e.NodeLife, "node", "event", "reason"),
    ), "node"),
    Sheet("node_energy", "Energy of a node at an instant", e.NodeEnergy, (
        *eaches(e.NodeEnergy, "node", "consumed_j"),
        each(e.NodeEnergy, "left_j", meaning="Energy left, in joules; infinity for mains power"),
    ), "row"),
    Sheet("energy_ledger", "Where a node's joules went, told at the end", e.EnergyLedger, (
        *eaches(e.EnergyLedger, "node", "device", "state", "kind", "energy_j"),
        each(e.EnergyLedger, "time_s", "time_in_state_s"),
    ), "row"),
    Sheet("energy_harvest", "What a node's harvester brought, told at the end", e.EnergyHarvest, (
        each(e.EnergyHarvest, "node"),
        each(e.EnergyHarvest, "offered_j", meaning="What arrived at the battery, in joules"),
        each(e.EnergyHarvest, "spilled_j", meaning="Of that, what found it full, in joules"),
    ), "row"),
    Sheet("energy_budgets", "What happened to an energy allowance", e.EnergyBudget, (
        *ones(e.EnergyBudget, "node", "event", "task", "spent_j", "allowance_j", "action"),
    ), "node"),
    Sheet("node_clocks", "How far a node's clock is ahead of true time", e.NodeClocks, (
        each(e.NodeClocks, "node"),
        each(e.NodeClocks, "ahead_s", meaning="Its clock, synchronisation included, less true time, in seconds"),
    ), "row"),
    Sheet("faults", "A fault rule that begins, ends or strikes", e.Fault, (
        *ones(e.Fault, "rule", "kind", "event", "detail"),
    )),
    Sheet("fault_nodes", "A node that a fault concerns", e.Fault, (
        one(e.Fault, "rule"),
        one(e.Fault, "event"),
        each(e.Fault, "node", meaning="Node id"),
    )),
)  # fmt: skip

_MODEL = (
    Sheet("problem", "The problem instance", e.Problem, (
        one(e.Problem, "kind", meaning="Kind of the problem, such as `association` or `tracking`"),
        one(e.Problem, "content_json"),
    )),
    Sheet("variables", "A variable of the graphical model and its host", e.VariablePlacement, (
        *eaches(e.VariablePlacement, "variable", "name", "host"),
    )),
    Sheet("variable_edges", "An edge of the graphical model", e.VariablePlacement, (
        each(e.VariablePlacement, "edge_a", "variable_a", "Number of the variable at one end"),
        each(e.VariablePlacement, "edge_b", "variable_b", "Number of the variable at the other"),
    )),
    Sheet("graph_rounds", "A round of message passing at a node", e.GraphMessages, (
        *ones(e.GraphMessages, "node", "round", "computed", "largest_change"),
        one(e.GraphMessages, "is_synchronous", is_flag=True, meaning="Whether the round is the same instant on all nodes"),
        one(e.GraphMessages, "late_ns", meaning="How much later than scheduled the node came to the round, in nanoseconds"),
    ), "node"),
    Sheet("graph_messages", "A message between two variables of the graphical model", e.GraphMessages, (
        *ones(e.GraphMessages, "node", "round"),
        each(e.GraphMessages, "source", "source_variable", "Number of the variable that sends"),
        each(e.GraphMessages, "destination", "destination_variable", "Number of the variable that receives"),
        each(e.GraphMessages, "remote", "over_air", "Whether the receiver lives on another node", is_flag=True),
    ), "node"),
    Sheet("truth_targets", "True position of a target", e.TruthTargets, (
        *eaches(e.TruthTargets, "target", "x_m", "y_m"),
    )),
    Sheet("truth_origins", "Which target a measurement came from", e.TruthOrigins, (
        one(e.TruthOrigins, "node"),
        place_of("target", "measurement", "Place of the measurement among the node's, from 0"),
        each(e.TruthOrigins, "x_m", meaning="Measured position in metres; NaN where the sensor does not measure one"),
        each(e.TruthOrigins, "y_m", meaning="As `x_m`, to the north"),
        each(e.TruthOrigins, "target", meaning=_DECIDED),
    ), "node"),
    Sheet("truth_counts", "True number of targets in a subregion", e.TruthCounts, (
        each(e.TruthCounts, "variable", meaning="Number of the variable that stands for the number"),
        each(e.TruthCounts, "count"),
    )),
)  # fmt: skip

_ANSWERS = (
    Sheet("associations", "A node's decision where a measurement came from", e.Association, (
        *ones(e.Association, "node", "round"),
        place_of("target", "measurement", "Place of the measurement among the node's, from 0"),
        each(e.Association, "target", meaning=_DECIDED),
    ), "node"),
    Sheet("marginals", "A value of a (max-)marginal of a variable", e.Marginals, (
        *ones(e.Marginals, "node", "variable", "round"),
        one(e.Marginals, "is_max", is_flag=True, meaning="Whether it is of a max-marginal"),
        place_of("probability", "value", "The variable's value: its place among them, from 0"),
        each(e.Marginals, "probability"),
    ), "node"),
    Sheet("pair_probabilities", "How probable it is that a measurement is of an event", e.PairProbabilities, (
        one(e.PairProbabilities, "node"),
        one(e.PairProbabilities, "variable", meaning="Number of the measurement among all"),
        one(e.PairProbabilities, "depth", meaning="Levels of recursion used"),
        each(e.PairProbabilities, "event", meaning="Number of the event"),
        each(e.PairProbabilities, "probability"),
        each(e.PairProbabilities, "low", meaning="The exact probability is at least this"),
        each(e.PairProbabilities, "high", meaning="The exact probability is at most this"),
    ), "node"),
    Sheet("estimates", "A position estimate of a target", e.Estimate, (
        one(e.Estimate, "node"),
        one(e.Estimate, "target", "track", "Number of the track"),
        *ones(e.Estimate, "thread", "x_m", "y_m"),
        computed("covariance_xx_m2", "float64", "Variance of x; missing where unknown", _covariance(0), nullable=True),
        computed("covariance_xy_m2", "float64", "Covariance of x and y", _covariance(1), nullable=True),
        computed("covariance_yy_m2", "float64", "Variance of y", _covariance(2), nullable=True),
    ), "node"),
    Sheet("identities", "How probable a node thinks it that a track follows a target", e.Identity, (
        one(e.Identity, "node"),
        one(e.Identity, "track", meaning="Number of the track"),
        place_of("probability", "target", "Number of the target"),
        each(e.Identity, "probability", meaning="Probability"),
    ), "node"),
    Sheet("beliefs", "A belief on a grid; its cells are in `belief_cells`", e.Belief, (
        one(e.Belief, "node"),
        one(e.Belief, "target", "track", "Number of the track"),
        *ones(e.Belief, "thread", "step"),
        one(e.Belief, "origin_x_m", meaning="West end of the first cell, in metres"),
        one(e.Belief, "origin_y_m", meaning="South end of the first cell, in metres"),
        *ones(e.Belief, "cell_m", "columns"),
    ), "node"),
    Sheet("belief_cells", "A cell of a belief, with its probability", e.Belief, (
        one(e.Belief, "node"),
        one(e.Belief, "target", "track", "Number of the track"),
        *ones(e.Belief, "thread", "step"),
        each(e.Belief, "cell", meaning="Number of the cell: row * columns + column"),
        each(e.Belief, "probability"),
    ), "node"),
    Sheet("particles", "A particle of a belief, in one track's coordinates", e.Particles, (
        *ones(e.Particles, "node", "step"),
        computed("track", "uint32", "Number of the track", _track_of, by_row=True),
        computed("particle", "uint32", "Number of the particle: the same in all tracks", _particle_of, by_row=True),
        computed("weight", "float32", "Its weight after the measurement", _weight_of, by_row=True),
        each(e.Particles, "x_m", meaning="Position in metres, to the east"),
        each(e.Particles, "y_m"),
    ), "node"),
    Sheet("groups", "A track that a group of sensors measures", e.Group, (
        one(e.Group, "node", meaning="Node id of the leader"),
        *ones(e.Group, "step"),
        each(e.Group, "target", "track", meaning="Number of the track"),
    ), "node"),
    Sheet("group_members", "A sensor whose reading a group's leader used", e.Group, (
        one(e.Group, "node", meaning="Node id of the leader"),
        *ones(e.Group, "step"),
        each(e.Group, "member", meaning="Node id of the sensor"),
    ), "node"),
    Sheet("handoffs", "A leader's choice of the next one", e.Handoff, (
        one(e.Handoff, "node", meaning="Node id of the leader"),
        one(e.Handoff, "target", "track", "Number of the track"),
        *ones(e.Handoff, "thread", "step"),
        one(e.Handoff, "destination", meaning="Node id of the next leader"),
        one(e.Handoff, "form"),
        one(e.Handoff, "payload_byte", meaning="Size of the belief handed over, in bytes"),
        one(e.Handoff, "divergence_bit"),
    ), "node"),
    Sheet("handoff_candidates", "A candidate among which a leader chose", e.Handoff, (
        one(e.Handoff, "node", meaning="Node id of the leader"),
        one(e.Handoff, "target", "track", "Number of the track"),
        *ones(e.Handoff, "thread", "step"),
        each(e.Handoff, "candidate", meaning="Node id of the candidate"),
        each(e.Handoff, "utility", meaning="What spoke for it (mutual information: bits)"),
    ), "node"),
    Sheet("roles", "A node that took or left a role", e.Role, (
        *ones(e.Role, "node", "role"),
        one(e.Role, "holds", is_flag=True),
    ), "node"),
    Sheet("algorithm_records", "What an algorithm noted", e.AlgorithmRecord, (
        one(e.AlgorithmRecord, "node"),
        one(e.AlgorithmRecord, "kind", meaning="Kind of the note"),
        one(e.AlgorithmRecord, "fields_json"),
    ), "node"),
    Sheet("log", "A line of log", e.Log, (
        one(e.Log, "level", meaning="debug, info, warning or error", codes=_LEVELS),
        one(e.Log, "name", meaning="Who says it"),
        one(e.Log, "message"),
    )),
)  # fmt: skip

SHEETS: tuple[Sheet, ...] = (*_SCENE, *_TRAFFIC, *_DEVICES, *_MODEL, *_ANSWERS)

"""Settings of message passing, standard and communication-sensitive, and the rule that selects messages.

Chen, Wainwright, Cetin, Willsky, Mathematical and Computer Modelling 43 (2006), section 5.
"""

from dataclasses import replace
from typing import Annotated, Literal

from annotated_types import Ge, Le, Lt

from netsim.codec import Precision
from netsim.kernels.adaptive_tolerance import AdaptiveTolerance
from netsim.kernels.communication import CommunicationRule
from netsim.parameters import NonNegative, Positive, PositiveInt, parameters
from netsim.protocols.exchange import Manner

LAST_ROUND = 0xFFFF
"""Largest round number: two bytes on the air."""
SETTLED = 1e-12
"""Divergence up to which a message counts as unchanged where no tolerance is set."""

Damping = Annotated[float, Ge(0), Lt(1)]


@parameters
class MessagePassingParameters:
    """Standard message passing: every message is sent in every round."""

    schedule: Literal["synchronous", "asynchronous"] = "synchronous"
    """`synchronous`: rounds driven by the nodes' timers; `asynchronous`: a node computes when something has arrived."""
    rounds: Annotated[int, Ge(1), Le(LAST_ROUND)] = 15
    """Rounds of computed messages, after the start round; asynchronous: the time limit in rounds."""
    round_s: Positive = 1.0
    """Length of a round."""
    setup_s: Positive = 4.0
    """Time for sensing and for the exchange of measurements before the first round."""
    setup_attempts: PositiveInt = 3
    """How often a measurement is sent that was not acknowledged."""
    setup_exchange: Manner = "unicast"
    """How measurements are exchanged: to each partner alone and acknowledged, or by one transmission to all in reach, after
    which a node asks the partners it did not hear."""
    spread_s: NonNegative = 0.5
    """Each node sends at a random moment within this time after computing, so that not all speak at once."""
    resend: Annotated[int, Ge(0), Le(10)] = 2
    """How often a message that the link layer gave up is sent again, while its round lasts."""
    hold_s: Positive = 0.05
    """Asynchronous: how long a node waits for more before it computes; the longest wait before a message is sent again."""
    payload: Precision = "float64"
    """Precision of numbers on the air. `uint8`: every message's log entries are quantised to 253 levels between its own
    least and greatest (see `netsim.codec`), the measurements of the setup go as float16. What decides whether a message is
    sent compares messages before they are encoded; those between vertices on one node are not encoded at all."""
    silence: Literal["timeout", "notice"] = "timeout"
    """How a receiver takes it when nothing comes. `timeout`: it goes on with the last message it has, whether the next was
    not sent or was lost. `notice`: in every round each node tells each partner, by one bit an edge, whether a new message
    comes (it then comes along); who hears nothing knows that something was lost and asks for it. Needs rounds."""
    asks: Annotated[int, Ge(0), Le(10)] = 2
    """`notice`: how often in a round a node asks a partner that it did not hear; 0: it only counts what it missed."""
    sleep: Literal["never", "scheduled", "when_quiet"] = "never"
    """`scheduled`: radios listen in a window at the start of each round, `spread_s` and `window_margin_s` long, and sleep
    for its rest. `when_quiet`: a node that has neither sent nor received a message for `quiet_rounds` rounds leaves windows
    out but every `common_every`-th; what is to be sent to a node that may be asleep waits for that one. Needs rounds."""
    window_margin_s: NonNegative = 0.2
    """How long a window lasts beyond `spread_s`: for computing, for the last frames and for what is sent again."""
    guard_s: NonNegative = 0.01
    """How much before a round the radio wakes: its start-up, and the difference of two clocks."""
    quiet_rounds: PositiveInt = 2
    """`when_quiet`: after how many rounds without a message a node, or a pair of nodes, counts as quiet."""
    common_every: PositiveInt = 4
    """`when_quiet`: every round whose number is a multiple of this has a window in which all listen."""
    rehost: bool = False
    """Data association: whether the variable of a target whose host died is taken over by another of the sensors that cover
    it (see `netsim.algorithms.rehosting`). A death shows by missing acknowledgements, so only to who has something to send
    and a MAC that acknowledges, or by missing notices, where they are given. Who is believed dead is told messages and
    notices all the same, retries included, for it may be alive or come up again: frames lost to the dead. Needs rounds."""
    suspect_after: PositiveInt = 3
    """`rehost`: how many messages in a row must fail, or notices be missing, until a node is believed dead."""
    damping: Damping = 0.0
    """Weight of a vertex's previous message in its next one, in the log domain; 0 is the plain update."""
    messages_per_round: PositiveInt | None = None
    """Most messages that a vertex sends in a round after the start round: those that changed most since they were last sent
    (residual scheduling; Elidan, McGraw, Koller 2006). The others wait, and go when they are the most changed. Null for no
    limit."""

    def __post_init__(self) -> None:
        """A message must be on its way before the next round begins."""
        if self.spread_s >= self.round_s:
            message = "spread_s below round_s"
            raise ValueError(message)
        if self.schedule == "asynchronous" and (self.silence != "timeout" or self.sleep != "never"):
            message = "schedule: synchronous with silence: notice, and where radios sleep: both go by rounds"
            raise ValueError(message)
        if self.silence == "notice" and self.sleep == "when_quiet":
            message = "silence: timeout with sleep: when_quiet: who gives notice in every round is never quiet"
            raise ValueError(message)
        if self.rehost and (self.schedule == "asynchronous" or self.sleep == "when_quiet"):
            message = "schedule: synchronous, and sleep: never or scheduled, with rehost: true"
            raise ValueError(message)
        if self.sleep != "never" and self.window_s + self.guard_s >= self.round_s:
            message = "spread_s, window_margin_s and guard_s together below round_s where radios sleep"
            raise ValueError(message)

    @property
    def window_s(self) -> float:
        """How long radios listen in a round, if they sleep at all."""
        return self.spread_s + self.window_margin_s


@parameters
class CommunicationSensitiveParameters(MessagePassingParameters):
    """Communication-sensitive message passing (Chen et al. 2006, section 5): a message that tells too little is kept."""

    tolerance: NonNegative | Literal["adaptive"] = 0.1
    """A message is sent when its Kullback-Leibler divergence (eq 19) exceeds this. `adaptive`: no tolerance to choose; a
    message is sent when it would change what its receiver believes, as far as its sender can tell, the more so if it
    changes the receiver's best state; where start messages were lost, the last message of an edge is repeated. `log_base`,
    `support` and `compare_with` then have no meaning; with the asynchronous schedule nothing is repeated."""
    tolerance_when_short: NonNegative | None = None
    """Replaces `tolerance` in rounds in which the node's energy allowance is used up (`budget` of its group, with the
    policy `warn`: with `refuse` it could send nothing); null for no difference."""
    first_round: Literal["init", "both", "ones"] = "init"
    """`init`: uniform messages are sent first and the first computed ones compared with them; `both`: the first computed
    ones are always sent; `ones`: compared with unnormalised ones, nothing sent first."""
    log_base: Literal["e", "2"] = "e"
    """Base of the divergence's logarithm: nats or bits."""
    support: Literal["full", "projected"] = "full"
    """Divergence over the receiver's full state space, or over the entries of the message."""
    compare_with: Literal["last_sent", "previous_generated"] = "last_sent"
    """Which message a new one is compared with."""
    undelivered: Literal["kept", "taken_back"] = "kept"
    """What becomes of a message that the link layer gave up for good, with `last_sent`: `kept`: later ones are compared with
    it all the same; `taken_back`: they are compared with what the receiver had before."""


@parameters
class MaxProductParameters(MessagePassingParameters):
    """Loopy max-product."""

    type: Literal["max-product"] = "max-product"


@parameters
class SumProductParameters(MessagePassingParameters):
    """Loopy sum-product (belief propagation)."""

    type: Literal["sum-product"] = "sum-product"


@parameters
class CsmpParameters(CommunicationSensitiveParameters):
    """Communication-sensitive max-product."""

    type: Literal["csmp"] = "csmp"


@parameters
class CsspParameters(CommunicationSensitiveParameters):
    """Communication-sensitive sum-product."""

    type: Literal["cssp"] = "cssp"


def tolerance_of(parameters: MessagePassingParameters, is_short: bool) -> float | None:
    """What replaces the rule's tolerance in a round; None for nothing.

    Args:
        parameters: Of the algorithm.
        is_short: Whether the node's energy allowance is used up.
    """
    if isinstance(parameters, CommunicationSensitiveParameters) and is_short:
        return parameters.tolerance_when_short
    return None


def takes_back(parameters: MessagePassingParameters) -> bool:
    """Whether the rule forgets messages that were given up."""
    return isinstance(parameters, CommunicationSensitiveParameters) and parameters.undelivered == "taken_back"


def rule_of(parameters: MessagePassingParameters) -> CommunicationRule:
    """The rule that selects messages.

    Raises:
        ScenarioError: When its settings exclude one another.
    """
    common = CommunicationRule(damping=parameters.damping, messages_per_round=parameters.messages_per_round)
    if isinstance(parameters, CommunicationSensitiveParameters):
        return _sensitive(parameters, common)
    if (
        parameters.schedule == "asynchronous"
    ):  # without rounds, an unchanged message must not wake its receiver for ever
        return replace(common, tolerance=SETTLED)
    return common


def _sensitive(parameters: CommunicationSensitiveParameters, common: CommunicationRule) -> CommunicationRule:
    if parameters.tolerance == "adaptive":
        return replace(common, first_round=parameters.first_round, adaptive=_adaptive(parameters))
    return replace(
        common,
        tolerance=parameters.tolerance,
        first_round=parameters.first_round,
        log_base=parameters.log_base,
        support=parameters.support,
        compare_with=parameters.compare_with,
    )


def _adaptive(parameters: CommunicationSensitiveParameters) -> AdaptiveTolerance:
    """Without rounds a node that hears nothing computes nothing: what it put off or would repeat, it would never send."""
    if parameters.schedule == "asynchronous":
        return AdaptiveTolerance(first=1.0, most_repeats=0)
    return AdaptiveTolerance()

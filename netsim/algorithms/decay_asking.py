"""Growing t until the certified intervals of a sensor's pairs are narrow enough, and asking for the reports that it takes.

A sensor that does not answer is not asked again. What it may have measured then stays open, and may leave an interval wider
than is asked for whatever others answer (see `LeastWidth`): where that is so of each interval that is not narrow enough yet,
and none of them can become narrower by more than is asked for, the node stops. It stops in any case when no answer could
come before the algorithm ends, and states what it can certify.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from netsim.algorithms.charging import charge
from netsim.algorithms.correlation_decay_parameters import CorrelationDecayParameters, TargetParameters
from netsim.algorithms.decay_record import Statistics
from netsim.algorithms.decay_reports import HeardReports, Pair
from netsim.api import EnergyTask, Message, NodeHandle, Op
from netsim.kernels.decay_interval import DecayInterval, LeastWidth
from netsim.kernels.known_association import KnownAssociation
from netsim.units import s_to_ns

ASK = "ask"
REPORT = "report"


@dataclass(frozen=True, slots=True)
class Grown:
    """What growing came to.

    Attributes:
        known: The graph that is known.
        depth: t.
    """

    known: KnownAssociation
    depth: int


class Asking:
    """One node's questions.

    Args:
        node: The node.
        heard: The reports it has.
        parameters: How it goes on.
        target: Until when.
        statistics: Where questions are counted.
    """

    def __init__(
        self,
        node: NodeHandle,
        heard: HeardReports,
        parameters: CorrelationDecayParameters,
        target: TargetParameters,
        statistics: Statistics,
    ) -> None:
        self._node, self._heard, self._target, self._statistics = node, heard, target, statistics
        self._most_depth = parameters.depth
        self._last_ns = s_to_ns(parameters.until_s) - s_to_ns(target.spread_s) - s_to_ns(target.answer_s)
        self._silent: set[int] = set()

    def grow(self) -> Op[Grown]:
        """Grow t by two, with what it takes to know, until every interval is narrow enough or nothing is to be gained."""
        depth = 0
        with self._node.task("association", allowance_j=self._target.allowance_j) as task:
            while depth < self._most_depth and not self._is_over(task):
                depth = min(depth + 2, self._most_depth)
                yield from self._ask_within(depth, task)
                if (yield from self._is_enough(self._heard.known(), depth)):
                    break
        yield from self._listen(0)
        return Grown(self._heard.known(), depth)

    def _is_over(self, task: EnergyTask) -> bool:
        """Whether the allowance is spent, or no answer could come before the end."""
        return task.is_short or self._node.now_ns > self._last_ns

    def _is_enough(self, known: KnownAssociation, depth: int) -> Op[bool]:
        """Whether each interval is narrow enough, or can no longer become so."""
        interval = DecayInterval(known.graph, known.incomplete)
        bounds = {pair: interval.pair(*pair, depth) for pair in self._heard.own_pairs(known)}
        widths = {pair: high - low for pair, (low, high) in bounds.items()}
        wide = {pair: width for pair, width in widths.items() if width > self._target.interval_width}
        yield from charge(self._node, interval.operations + self._heard.operations())
        return not wide or (yield from self._is_hopeless(known, depth, wide))

    def _is_hopeless(self, known: KnownAssociation, depth: int, wide: Mapping[Pair, float]) -> Op[bool]:
        """Whether no answer and no t can make any of these intervals narrow enough, or narrower by as much as that."""
        missing = self._heard.missing(known, known.incomplete)
        closed = [vertex for vertex, sensors in missing.items() if sensors & self._silent]
        if not closed:
            return False
        pending = [vertex for vertex, sensors in missing.items() if sensors - self._silent]
        least, enough = LeastWidth(known.graph, pending, closed), self._target.interval_width
        found = {pair: least.pair(*pair, depth) for pair in wide}
        yield from charge(self._node, least.operations)
        return all(found[pair] > enough and width - found[pair] <= enough for pair, width in wide.items())

    def _ask_within(self, depth: int, task: EnergyTask) -> Op[None]:
        """Ask for what is missing of events within `depth` steps of the node's own measurements."""
        while True:
            yield from self._listen(0)
            known = self._heard.known()
            missing = self._heard.missing(known, self._heard.near(known, depth))
            asked = set().union(*missing.values()) - self._silent
            if not asked or self._is_over(task):
                return
            yield from self._ask(asked, task)
            self._silent |= asked - self._heard.sensors

    def _ask(self, asked: Iterable[int], task: EnergyTask) -> Op[None]:
        """Ask sensors for their reports, those that do not answer again."""
        node, target, waiting = self._node, self._target, set(asked)
        for _ in range(target.ask_attempts):
            if not waiting or self._is_over(task):
                return
            yield from _pause_before_speaking(node, target)
            node.multicast(sorted(waiting), ASK, b"", causes=())
            self._statistics.asked += len(waiting)
            end_ns = node.now_ns + s_to_ns(target.answer_s)
            while waiting and node.now_ns < end_ns:
                yield from self._listen(end_ns - node.now_ns)
                waiting -= self._heard.sensors

    def _listen(self, timeout_ns: int) -> Op[None]:
        """Take the next report that comes in this time, and all that have come, be they late or of nobody asked."""
        message = yield from self._node.receive(kinds={REPORT}, timeout_ns=timeout_ns)
        while message is not None:
            self._heard.take(message.source, message.payload)
            message = yield from self._node.receive(kinds={REPORT}, timeout_ns=0)


def answer_all(node: NodeHandle, others: Collection[int], report: bytes, target: TargetParameters | None) -> Op[None]:
    """Tell those who ask the node's own report, until the node ends.

    Args:
        node: The node.
        others: Nodes that there are; questions that seem to come from others are ignored.
        report: What to tell.
        target: How long an answer is put off.
    """
    while True:
        question = yield from node.receive(kinds={ASK})
        if question is not None and question.source in others:
            node.spawn(_answer(node, question, report, target))


def _answer(node: NodeHandle, question: Message, report: bytes, target: TargetParameters | None) -> Op[None]:
    yield from _pause_before_speaking(node, target)
    node.send(question.source, REPORT, report, causes=[question])


def _pause_before_speaking(node: NodeHandle, target: TargetParameters | None) -> Op[None]:
    """For a random moment of `spread_s`: one question has many answers."""
    if target is not None and target.spread_s:
        yield from node.pause(int(node.rng("asking").random() * s_to_ns(target.spread_s)))

"""Energy as a constraint: what a node, or a task on it, may draw, and what happens when that is used up.

Allowances count what the whole node draws (see `netsim.sim.allowance`); here is what follows when one is used up.
"""

import math
from collections import deque
from dataclasses import replace
from types import TracebackType
from typing import Annotated, Final, Literal

from annotated_types import Ge
from simpy.events import Event as SimEvent

from netsim.api import Delivery, NoEnergyError, Op
from netsim.parameters import Positive, parameters
from netsim.sim.allowance import Allowance, Draw
from netsim.sim.clock import Clock
from netsim.sim.local_clock import LocalClock
from netsim.sim.mac.link import LinkJob, Submits
from netsim.sim.radio_switch import RadioSwitch
from netsim.trace.events import EnergyBudget
from netsim.trace.recorder import Recorder
from netsim.units import NS_PER_S, s_to_ns

S_PER_HOUR: Final = 3600
MOST_HELD: Final = 64
"""Packets that wait at a node with an allowance, for their turn or until it is replenished; more are `queue_full`."""

Policy = Literal["refuse", "sleep", "warn"]


@parameters
class BudgetParameters:
    """What a node may draw, all its devices together, and what happens when that is used up before its time."""

    allowance_j: Positive
    """Energy it may draw in a period."""
    per: Literal["run", "hour"] | Annotated[float, Ge(0.001)] = "run"
    """The period, by the node's counter from its start: the whole run, an hour, or a number of seconds. What is left over
    lapses, what was drawn too much is not charged to the next period."""
    policy: Policy = "refuse"
    """`refuse`: nothing is sent (`no_energy`; forwarding too, acknowledgements excepted), sensed or computed; `sleep`: the
    radio powers down, and what is to be sent, sensed or computed waits until the allowance is replenished; `warn`: it is
    only noted, in the trace and for the algorithm. Under `refuse` and `sleep` the MAC gets one packet at a time, and
    finishes that: at most one exchange with its retries (under low-power listening, its trains) exceeds the allowance."""

    @property
    def period_ns(self) -> int | None:
        """The period; None for the whole run."""
        if isinstance(self.per, str):
            return None if self.per == "run" else S_PER_HOUR * NS_PER_S
        return s_to_ns(self.per)


class EnergyTask:
    """See `netsim.api.EnergyTask`; made by `NodeBudget.task`."""

    def __init__(self, budget: "NodeBudget", name: str, allowance_j: float | None, policy: Policy) -> None:
        self._budget = budget
        self._allowance_j = allowance_j
        self._allowance: Allowance | None = None
        self.name = name
        self.policy = policy

    def __enter__(self) -> "EnergyTask":
        """Begin to count."""
        self._allowance = self._budget.open(self, self._allowance_j)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Count no further; what was spent can still be read."""
        if self._allowance is not None:
            self._allowance.end()
            self._budget.close(self)

    @property
    def allowance_j(self) -> float:
        """See `netsim.api.EnergyTask.allowance_j`."""
        return math.inf if self._allowance_j is None else self._allowance_j

    @property
    def spent_j(self) -> float:
        """See `netsim.api.EnergyTask.spent_j`."""
        return 0.0 if self._allowance is None else self._allowance.spent_j

    @property
    def left_j(self) -> float:
        """See `netsim.api.EnergyTask.left_j`."""
        return self.allowance_j if self._allowance is None else self._allowance.left_j

    @property
    def is_short(self) -> bool:
        """See `netsim.api.EnergyTask.is_short`."""
        return self._allowance is not None and self._allowance.is_short


class NodeBudget:
    """A node's energy allowance, those of its tasks, and the policy.

    Args:
        clock: Simulated time.
        local: The node's clock.
        node: Its id.
        draw: What it draws.
        parameters: Its allowance; None for a node without: then everything is only counted.
        switch: Powers the radio down.
        mac: Where packets go on.
        recorder: Where `EnergyBudget` events go.
    """

    def __init__(
        self,
        clock: Clock,
        local: LocalClock,
        node: int,
        draw: Draw,
        parameters: BudgetParameters | None,
        switch: RadioSwitch,
        mac: Submits,
        recorder: Recorder,
    ) -> None:
        self._clock = clock
        self._local = local
        self._node = node
        self._draw = draw
        self._policy: Policy = "warn" if parameters is None else parameters.policy
        self._period_ns = None if parameters is None else parameters.period_ns
        self._switch = switch
        self._mac = mac
        self._recorder = recorder
        self._tasks: list[EnergyTask] = []
        self._held: deque[LinkJob] = deque()
        self._is_sending = False  # the MAC has a packet of which the end is awaited here
        self._waiters: list[SimEvent] = []
        self._began_ns = local.counter_ns
        self._period = 0
        self._is_down = False
        self._allowance = Allowance(clock, draw, None if parameters is None else parameters.allowance_j, self._used_up)
        self._await_next_period()

    @property
    def allowance_j(self) -> float:
        """See `netsim.api.Budget.allowance_j`."""
        return self._allowance.allowance_j

    @property
    def spent_j(self) -> float:
        """See `netsim.api.Budget.spent_j`."""
        return self._allowance.spent_j

    @property
    def left_j(self) -> float:
        """See `netsim.api.Budget.left_j`."""
        return self._allowance.left_j

    @property
    def is_short(self) -> bool:
        """See `netsim.api.Budget.is_short`."""
        return self._allowance.is_short

    @property
    def replenishes_ns(self) -> int | None:
        """See `netsim.api.Budget.replenishes_ns`."""
        return None if self._period_ns is None else self._local.at(self._next_true_ns(self._period_ns))

    @property
    def held(self) -> int:
        """Packets that wait here, for their turn or for the allowance to be replenished."""
        return len(self._held)

    def task(self, name: str, allowance_j: float | None, policy: Policy) -> EnergyTask:
        """See `netsim.api.NodeHandle.task`."""
        return EnergyTask(self, name, allowance_j, policy)

    def open(self, task: EnergyTask, allowance_j: float | None) -> Allowance:
        """A task begins."""
        self._tasks.append(task)
        return Allowance(self._clock, self._draw, allowance_j, lambda: self._task_used_up(task))

    def close(self, task: EnergyTask) -> None:
        """A task has ended."""
        self._tasks.remove(task)
        self._note("ended", task, "")

    def submit(self, job: LinkJob) -> None:
        """See `Mac.submit`: every packet of the node goes through here."""
        if self.refuses("send"):
            job.done(Delivery(acknowledged=False, reason="no_energy", attempts=0))
        elif not self._sleeps and not self._held and not (self._limits and self._is_sending):
            self._pass_on(job)
        elif len(self._held) < MOST_HELD:
            self._held.append(job)
        else:
            job.done(Delivery(acknowledged=False, reason="queue_full", attempts=0))

    def admit(self, action: str) -> Op[None]:
        """Wait until an action of the CPU or the sensor is allowed.

        Raises:
            NoEnergyError: If it is refused.
        """
        while self._sleeps:
            event = self._clock.event()
            self._waiters.append(event)
            yield event
        if self.refuses(action):
            what: NodeBudget | EnergyTask = self if self._refuses_itself else self._refusing_tasks[0]
            name = f"task {what.name!r}" if isinstance(what, EnergyTask) else "the node"
            message = (
                f"{action} refused: {name} has spent {what.spent_j:.6g} J of its allowance of {what.allowance_j:.6g} J"
            )
            raise NoEnergyError(message)

    def restart(self) -> None:
        """The node is up again after a crash, its radio listening; what it drew before still counts."""
        self._is_down = False
        self._is_sending = False
        self._switch.restart()
        if self._sleeps:
            self._switch.hold()

    def give_up(self, reason: str) -> None:
        """The node is down: end what waits to be sent."""
        self._is_down = True
        self._switch.stop()
        held, self._held = self._held, deque()
        for job in held:
            job.done(Delivery(acknowledged=False, reason=reason, attempts=0))

    @property
    def _limits(self) -> bool:
        """Whether what is sent may have to stop: then the MAC gets one packet at a time."""
        own = self._policy != "warn"
        return own or any(task.policy == "refuse" and task.allowance_j < math.inf for task in self._tasks)

    def _pass_on(self, job: LinkJob) -> None:
        """Give the MAC a packet; one that is limited brings on the next when it is done."""
        if not self._limits and not self._held:
            self._mac.submit(job)
            return

        def done(delivery: Delivery) -> None:
            self._is_sending = False
            job.done(delivery)
            self._proceed()

        self._is_sending = True
        self._mac.submit(replace(job, done=done))

    def _proceed(self) -> None:
        """Go on with what waits, as far as the allowances let it."""
        while self._held and not (self._is_sending or self._sleeps or self._is_down):
            job = self._held.popleft()
            if self.refuses("send"):
                job.done(Delivery(acknowledged=False, reason="no_energy", attempts=0))
            else:
                self._pass_on(job)

    def _refuse_waiting(self) -> None:
        """An allowance is used up: what waits is refused at once."""
        waiting, self._held = self._held, deque()
        for job in waiting:
            self.submit(job)

    @property
    def _sleeps(self) -> bool:
        return self._policy == "sleep" and self.is_short

    def refuses(self, action: str) -> bool:
        """Whether an action is refused now; noted in the trace if so."""
        if self._refuses_itself:
            self._note("refused", None, action)
            return True
        tasks = self._refusing_tasks
        if tasks:
            self._note("refused", tasks[0], action)
        return bool(tasks)

    @property
    def _refuses_itself(self) -> bool:
        return self._policy == "refuse" and self.is_short

    @property
    def _refusing_tasks(self) -> list[EnergyTask]:
        return [task for task in self._tasks if task.policy == "refuse" and task.is_short]

    def _used_up(self) -> None:
        if self._period_ns is not None and self._next_true_ns(self._period_ns) <= self._clock.now_ns:
            return  # it is replenished at this very instant
        self._note("short", None, self._policy)
        if self._policy == "sleep":
            self._switch.hold()
        elif self._policy == "refuse":
            self._refuse_waiting()

    def _task_used_up(self, task: EnergyTask) -> None:
        self._note("short", task, task.policy)
        if task.policy == "refuse":
            self._refuse_waiting()

    def _next_true_ns(self, period_ns: int) -> int:
        return self._local.counter_true_ns(self._began_ns + (self._period + 1) * period_ns)

    def _await_next_period(self) -> None:
        if self._period_ns is not None:
            self._clock.call_first(self._next_true_ns(self._period_ns) - self._clock.now_ns, self._replenish)

    def _replenish(self, _: object) -> None:
        was_short = self.is_short
        spent_j = self.spent_j
        self._period += 1
        self._allowance.restart()
        self._await_next_period()
        if was_short and not self._is_down:
            self._record("replenished", "", spent_j, self.allowance_j, "")
            self._release()

    def _release(self) -> None:
        if self._policy == "sleep":
            self._switch.release()
        self._proceed()
        waiters, self._waiters = self._waiters, []
        for event in waiters:
            event.succeed()

    def _note(self, event: str, task: EnergyTask | None, action: str) -> None:
        what = self if task is None else task
        self._record(event, "" if task is None else task.name, what.spent_j, what.allowance_j, action)

    def _record(self, event: str, task: str, spent_j: float, allowance_j: float, action: str) -> None:
        self._recorder.record(EnergyBudget(self._node, event, task, spent_j, allowance_j, action))

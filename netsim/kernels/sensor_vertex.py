"""A sensor's association variable in the sensor-target hybrid model (Chen et al. 2006, sections 3.2.3 and 3.2.4).

Its states assign the sensor's measurements to the targets it covers, too many to enumerate. But a message depends on
the shared targets' part of the assignment alone, and the parts meet only in which measurements they use. So the targets
fall into groups, one for each edge and for each exclusive target, and a dynamic programme over masks of used
measurements combines the groups exactly, in either semiring.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from netsim.kernels.injections import Injections, IntArray
from netsim.kernels.semiring import FloatArray, Semiring, contract, log_normalise, reduce, uniform
from netsim.kernels.vertex import Choice, Incoming, Weights, margin_below


@dataclass(frozen=True, eq=False)
class SharedEvidence:
    """The edge potential of two sensors: the product over shared targets of the evidence of their measurements.

    As a matrix over the injections at both ends it would have 10^7 entries and more where sensors share five targets. As a
    product it acts on a message target by target, each step replacing the choice here by the choice there.

    Attributes:
        tables: For each shared target log evidence, shape (q here + 1, q there + 1).
        there: How the shared targets can share out the other sensor's measurements.
    """

    tables: tuple[FloatArray, ...]
    there: Injections

    def carry(self, here: FloatArray, semiring: Semiring, exponent: float = 1.0) -> FloatArray:
        """From log weights on the grid of tuples here to those of the injections there, the potential to a power."""
        for table in self.tables:
            here = contract(semiring, here, table if exponent == 1.0 else exponent * table)
        return here.reshape(-1)[self.there.cells]

    def operations(self) -> int:
        """Two operations for each pair of a choice here and a choice there, in each step."""
        here, there, shared = len(self.tables[0]), self.there.grid[0], len(self.tables)
        return int(2 * sum(here ** (shared - step) * there ** (step + 1) for step in range(shared)))


@dataclass(frozen=True, eq=False)
class TargetGroup:
    """Targets that a sensor shares with the same neighbour, or one that it alone covers.

    Attributes:
        targets: Their numbers, ascending: the order of the columns of `injections.states`.
        neighbour: Vertex at the other end: a sensor, or the target's own vertex; None for an exclusive target.
        injections: How these targets can share out the sensor's measurements.
        local: Log node potential of each injection: detections, misses and, for an exclusive target, evidence.
        edge: Log edge potential with another sensor, eq (9); None otherwise: towards a target's vertex the injection
            itself is the message's index.
        multiplicity: For each entry of the outgoing message, how many states of the receiver it stands for.
    """

    targets: tuple[int, ...]
    neighbour: int | None
    injections: Injections
    local: FloatArray
    edge: SharedEvidence | None
    multiplicity: FloatArray


class SensorVertex:
    """The association variable of one sensor.

    Messages from and to another sensor are indexed by the partial injections of the shared targets into the
    *receiver's* measurements in canonical order (`netsim.kernels.injections`), messages from and to a target's vertex
    by this sensor's measurement (0 for missed).

    Args:
        id: Its number in the model.
        groups: Its targets, those with a neighbour in ascending order of neighbours first, then the exclusive ones.
        unassigned: Log potential of the measurements left over as false alarms, per mask of used measurements.
    """

    def __init__(self, id: int, groups: Sequence[TargetGroup], unassigned: FloatArray) -> None:
        self.id = id
        self.neighbours = tuple(group.neighbour for group in groups if group.neighbour is not None)
        self._edges = [group for group in groups if group.neighbour is not None]
        self._exclusive = [group for group in groups if group.neighbour is None]
        self._unassigned = unassigned
        self._bases = {semiring: self._base(semiring) for semiring in Semiring}

    @property
    def targets(self) -> tuple[int, ...]:
        """The targets it covers, ascending: the columns of `assignment_probabilities`."""
        return tuple(sorted(target for group in self._groups for target in group.targets))

    @property
    def measurement_count(self) -> int:
        """How many measurements the sensor has."""
        return len(self._unassigned).bit_length() - 1

    @property
    def _groups(self) -> list[TargetGroup]:
        return self._edges + self._exclusive

    def _base(self, semiring: Semiring) -> FloatArray:
        """Potential of exclusive targets and false alarms, per mask that the edges' targets use."""
        table = self._unassigned
        for group in self._exclusive:
            table = group.injections.absorb(table, group.local, semiring)
        return table

    def _edge(self, neighbour: int) -> TargetGroup:
        return self._edges[self.neighbours.index(neighbour)]

    def incoming_size(self, neighbour: int) -> int:
        """Injections of the shared targets into this sensor's measurements."""
        return len(self._edge(neighbour).local)

    def outgoing_size(self, neighbour: int) -> int:
        """Injections into the other sensor's measurements, or this sensor's measurements and "missed"."""
        return len(self._edge(neighbour).multiplicity)

    def multiplicity(self, neighbour: int) -> FloatArray:
        """How many associations of the receiver agree with each entry."""
        return self._edge(neighbour).multiplicity

    def shares_states(self, neighbour: int) -> bool:
        """Towards a target's vertex: messages both ways are indexed by what the target gave this sensor."""
        return self._edge(neighbour).edge is None

    def outgoing(self, incoming: Incoming, semiring: Semiring) -> dict[int, FloatArray]:
        """Eq (3) or (5) to every neighbour."""
        weights = self._weights(self._edges, incoming)
        tables = self._others(self._edges, weights, self._bases[semiring], semiring) if self._edges else ()
        messages = {}
        for group, table in zip(self._edges, tables, strict=True):
            here = group.local + table[group.injections.masks]
            if group.edge is not None:
                here = group.edge.carry(group.injections.on_grid(here), semiring)
            messages[group.neighbour] = log_normalise(here)
        return messages  # type: ignore[return-value]  # every group among the edges has a neighbour

    def _weights(self, groups: Sequence[TargetGroup], incoming: Incoming) -> list[FloatArray]:
        """Log weight of each group's injections: node potential times message."""
        return [
            group.local + incoming[group.neighbour]
            if group.neighbour is not None and group.neighbour in incoming
            else group.local + (0.0 if group.neighbour is None else uniform(len(group.local)))
            for group in groups
        ]

    def _others(
        self, groups: Sequence[TargetGroup], weights: Sequence[FloatArray], table: FloatArray, semiring: Semiring
    ) -> Iterable[FloatArray]:
        """For each group in turn the table with all the others absorbed, halving the list to share the work."""
        if len(groups) == 1:
            yield table
            return
        half = len(groups) // 2
        parts = [(groups[:half], weights[:half]), (groups[half:], weights[half:])]
        for mine, others in (parts, parts[::-1]):
            absorbed = table
            for group, weight in zip(*others, strict=True):
                absorbed = group.injections.absorb(absorbed, weight, semiring)
            yield from self._others(*mine, absorbed, semiring)

    def reweighted(self, neighbour: int, weights: Weights, exponent: float) -> FloatArray:
        """See `netsim.kernels.vertex.ReweightableVertex`."""
        group = self._edge(neighbour)
        table = self._bases[Semiring.MAX]
        for other in self._edges:
            if other is not group:
                table = other.injections.absorb(table, self._weighed(other, weights), Semiring.MAX)
        here = self._weighed(group, weights) + table[group.injections.masks]
        if group.edge is not None:
            here = group.edge.carry(group.injections.on_grid(here), Semiring.MAX, exponent)
        return log_normalise(here)

    def choice(self, weights: Weights) -> Choice:
        """The best association of the measurements: `decide`'s answer, with its margin."""
        groups = self._groups
        weighed = [self._weighed(group, weights) for group in groups]
        decision = self._walk(weighed)
        runner_up = -np.inf
        best = float(self._chain(self._unassigned, weighed, Semiring.MAX)[0][0])
        tables = self._others(groups, weighed, self._unassigned, Semiring.MAX) if groups else ()
        for group, weight, table in zip(groups, weighed, tables, strict=True):
            # Any other state differs in some group's injection, so the second best is found group by group.
            total = weight + table[group.injections.masks]
            total[self._place(group, decision)] = -np.inf
            runner_up = max(runner_up, float(total.max()))
        return Choice(tuple(decision.tolist()), margin_below(best, runner_up))

    @staticmethod
    def _place(group: TargetGroup, decision: IntArray) -> int:
        """Index of a group's injection in a decision about all measurements."""
        state = [
            int(np.flatnonzero(decision == target)[0]) + 1 if target in decision else 0 for target in group.targets
        ]
        return int(np.flatnonzero((group.injections.states == state).all(axis=1))[0])

    @staticmethod
    def _weighed(group: TargetGroup, weights: Weights) -> FloatArray:
        """Log weight of a group's injections: node potential and what is added to it."""
        if group.neighbour is None or group.neighbour not in weights:
            return group.local
        return group.local + weights[group.neighbour]

    def belief(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """Log of `assignment_probabilities`, row after row, normalised over all (0 entries become -inf)."""
        with np.errstate(divide="ignore"):
            table = np.log(self.assignment_probabilities(incoming, semiring).ravel())
        return log_normalise(table) if table.size else table

    def assignment_probabilities(self, incoming: Incoming, semiring: Semiring) -> FloatArray:
        """Where each measurement came from: its (max-)marginal over the covered targets and "false alarm".

        Returns:
            Shape (measurements, targets + 1), rows sum to one; the columns are `targets`, the last a false alarm.
        """
        groups, count = self._groups, self.measurement_count
        weights = self._weights(groups, incoming)
        log_table = np.full((count, len(self.targets) + 1), -np.inf)
        tables = self._others(groups, weights, self._unassigned, semiring) if groups else ()
        for group, weight, table in zip(groups, weights, tables, strict=True):
            total = weight + table[group.injections.masks]
            for column, target in enumerate(group.targets):
                chosen = group.injections.states[:, column]
                for measurement in range(count):
                    entry = reduce(semiring, np.append(total[chosen == measurement + 1], -np.inf))
                    log_table[measurement, self.targets.index(target)] = entry
        for measurement in range(count):
            log_table[measurement, -1] = self._left_over(measurement, weights, semiring)
        for row in log_table:
            row[:] = np.exp(log_normalise(row))
        return log_table

    def _left_over(self, measurement: int, weights: Sequence[FloatArray], semiring: Semiring) -> float:
        """Log weight of all states in which a measurement is a false alarm."""
        masks = np.arange(len(self._unassigned))
        table = np.where(masks >> measurement & 1, -np.inf, self._unassigned)
        return float(self._chain(table, weights, semiring)[0][0])

    def _chain(self, table: FloatArray, weights: Sequence[FloatArray], semiring: Semiring) -> list[FloatArray]:
        """Tables of the dynamic programme: entry g has the groups from g on absorbed, the last none."""
        tables = [table]
        for group, weight in zip(reversed(self._groups), reversed(weights), strict=True):
            tables.append(group.injections.absorb(tables[-1], weight, semiring))
        return tables[::-1]

    def decide(self, incoming: Incoming, semiring: Semiring = Semiring.MAX) -> IntArray:
        """The sensor's decision about its measurements.

        With `MAX` it is the best state of the sensor's max-marginal, found by walking the dynamic programme back. Equal
        values are settled group by group, edges by ascending neighbour and then exclusive targets ascending, for the
        first injection in canonical order. With `SUM` it is the consistent assignment with the most probably
        right measurements in expectation: each target used at most once, false alarms as often as needed.

        Returns:
            Target number per measurement, -1 for a false alarm, shape (measurements,).

        Raises:
            ScenarioError: When no state is possible.
        """
        if semiring is Semiring.SUM:
            return self._most_expected(self.assignment_probabilities(incoming, semiring))
        return self._walk(self._weights(self._groups, incoming))

    def _walk(self, weights: Sequence[FloatArray]) -> IntArray:
        """The best state under these log weights of the groups' injections, by walking the dynamic programme back."""
        groups = self._groups
        tables = self._chain(self._unassigned, weights, Semiring.MAX)
        log_normalise(tables[0][:1])
        decision, used = np.full(self.measurement_count, -1, dtype=np.int64), 0
        for group, weight, table in zip(groups, weights, tables[1:], strict=True):
            best = int(np.argmax(weight + group.injections.after(table, used)))
            used |= int(group.injections.masks[best])
            self._enter(decision, group, group.injections.states[best])
        return decision

    @staticmethod
    def _enter(decision: IntArray, group: TargetGroup, state: IntArray) -> None:
        for target, chosen in zip(group.targets, state, strict=True):
            if chosen:
                decision[chosen - 1] = target

    def _most_expected(self, probabilities: FloatArray) -> IntArray:
        count = self.measurement_count
        gains = np.hstack([probabilities[:, :-1], np.repeat(probabilities[:, -1:], count, axis=1)])
        rows, columns = linear_sum_assignment(gains, maximize=True)
        names = np.append(np.array(self.targets, dtype=np.int64), np.full(count, -1))
        decision = np.full(count, -1, dtype=np.int64)
        decision[rows] = names[columns]
        return decision

    def decide_alone(self) -> IntArray:
        """The node-independent estimate: the best state of the local potential alone, no message used.

        Shared targets have no evidence in the local potential, so that their measurements tie.
        """
        return self.decide({}, Semiring.MAX)

    def operations(self) -> int:
        """Three operations for each entry of the mask tables absorbed, and those of the edge potentials."""
        depth = max(len(self._edges) - 1, 0).bit_length()
        absorbed = sum(group.injections.pairs + len(group.local) for group in self._edges)
        return 3 * depth * absorbed + sum(group.edge.operations() for group in self._edges if group.edge is not None)

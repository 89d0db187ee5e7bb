"""How sensors learn their associations from tree-reweighted max-product where other nodes host the variables.

In the target-oriented model (Chen et al. 2006, section 3.2.2) the host of a target decides which measurement of each
covering sensor is the target's, in the sensor-oriented model (section 3.2.1) the host of a cluster decides for all its
sensors. Once the vertices of a host have heard the last verdict, or the time is over, it tells every sensor what they
conclude: the proved state; without proof a cluster's best state, or a target's max-marginals averaged over the trees, since
the best states of two targets may claim the same measurement. A sensor confirms what it hears, a host tells again what is
not confirmed.
"""

from collections.abc import Mapping

from netsim.algorithms.hosting import Measurements
from netsim.algorithms.trmp_inference import TreeReweighted
from netsim.algorithms.trmp_messages import Claim, Entry, Heard
from netsim.kernels.association_graph import decide_by_claims
from netsim.kernels.listed_vertex import ListedVertex, Pair
from netsim.kernels.semiring import FloatArray, Semiring
from netsim.kernels.vertex import ReweightableVertex
from netsim.trace.events import Association


class Conclusions:
    """What a node tells sensors, and what its own sensor is told; nothing where sensors host their own variables.

    Args:
        measured: What the node's vertices are made of; None outside data association.
    """

    def __init__(self, measured: Measurements | None) -> None:
        self._measured = measured if measured is not None and measured.knowledge.graph != "hybrid" else None
        self._claims: dict[tuple[int, int], Entry] = {}
        self._confirmed: set[tuple[int, int]] = set()
        self._lost: set[int] = set()
        self._heard: dict[int, FloatArray] = {}
        self._iteration = 0

    @property
    def are_told(self) -> bool:
        """Whether sensors are told by others what to conclude."""
        return self._measured is not None

    @property
    def is_complete(self) -> bool:
        """Whether the node's own sensor has heard of all its targets."""
        measured = self._measured
        return measured is None or {covered.target for covered in measured.knowledge.targets} <= self._heard.keys()

    @property
    def unconfirmed(self) -> list[Entry]:
        """Claims that their sensors have not confirmed, and still may."""
        return [
            entry
            for place, entry in sorted(self._claims.items())
            if place not in self._confirmed and self.node_of(entry.destination) not in self._lost
        ]

    def lose(self, node: int) -> None:
        """Nothing goes to a node or comes from it any more."""
        self._lost.add(node)

    def peers(self, vertices: Mapping[int, ReweightableVertex]) -> set[int]:
        """The nodes that this one tells, by the vertices it hosts, and those that tell it."""
        measured = self._measured
        if measured is None:
            return set()
        told = {sensor for v in vertices.values() if isinstance(v, ListedVertex) for sensor, _ in v.scope}
        return {self.node_of(sensor) for sensor in told} | self._tellers(measured)

    @staticmethod
    def _tellers(measured: Measurements) -> set[int]:
        """Hosts of the vertices that conclude about the node's own sensor."""
        knowledge = measured.knowledge
        if knowledge.graph == "sensor":
            return {cluster.host for cluster in knowledge.clusters if knowledge.sensor in cluster.sensors}
        return {covered.host for covered in knowledge.targets if covered.host is not None}

    def node_of(self, sensor: int) -> int:
        """The node of a sensor that is told from here."""
        return self._measured.knowledge.sensor_nodes[sensor] if self._measured is not None else -1

    def draw(self, vertex: ReweightableVertex, inference: TreeReweighted | None) -> None:
        """Put together what a vertex hosted here has to tell each of its sensors."""
        if self._measured is None or not isinstance(vertex, ListedVertex):
            return
        by_sensor: dict[int, dict[int, FloatArray]] = {}
        for (sensor, target), row in self._concluded(vertex, inference).items():
            by_sensor.setdefault(sensor, {})[target] = row
        number = 0 if inference is None else inference.iteration
        for sensor, rows in by_sensor.items():
            self._claims[vertex.id, sensor] = Entry(vertex.id, sensor, Claim(number, rows))

    def _concluded(self, vertex: ListedVertex, inference: TreeReweighted | None) -> Mapping[Pair, FloatArray]:
        is_proved = inference is not None and inference.verdict is not None and inference.verdict.proved
        is_cluster = self._measured is not None and self._measured.knowledge.graph == "sensor"
        if is_proved or is_cluster:
            choice = vertex.choice({}) if inference is None else inference.choice
            return vertex.claims_of_state(choice.state[0])
        return vertex.claims({} if inference is None else inference.weights, Semiring.MAX)

    def hear(self, entry: Entry, claim: Claim) -> list[Entry]:
        """Take a claim; the answer confirms it."""
        self._heard.update(claim.rows)
        self._iteration = max(self._iteration, claim.iteration)
        return [Entry(entry.destination, entry.source, Heard())]

    def confirm(self, entry: Entry) -> None:
        """Take a sensor's confirmation."""
        self._confirmed.add((entry.destination, entry.source))

    def association(self, node: int) -> Association | None:
        """The decision of the node's own sensor by all that it has heard; None where it was to decide by itself."""
        if self._measured is None:
            return None
        decision = decide_by_claims(self._heard, len(self._measured.own_m), Semiring.MAX)
        return Association(node, decision.tolist(), self._iteration)

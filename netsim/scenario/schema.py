"""The scenario: every setting of a run, with its default, unit and range.

Sections that belong to one part of netsim are declared beside that part's code; this module puts them together.
"""

from typing import Annotated, Any, Literal

from annotated_types import MinLen

from netsim.metrics.lifetime import DutyPlan
from netsim.models.batteries import PeukertParameters, RakhmatovVrudhulaParameters
from netsim.models.harvest import HarvestParameters
from netsim.models.lora import LoraParameters
from netsim.models.media import IdealMediumParameters, MediumParameters
from netsim.models.placement import PlacementParameters
from netsim.models.sensors import SensorParameters
from netsim.models.waypoints import WaypointMobility
from netsim.parameters import Name, NonNegativeInt, PointM, Positive, parameters
from netsim.problems.association import AssociationParameters
from netsim.problems.energy_tracking import EnergyTrackingParameters
from netsim.problems.event_association import EventAssociationParameters
from netsim.problems.graph import GraphParameters
from netsim.problems.none import NoProblemParameters
from netsim.problems.target_distribution import DistributionParameters
from netsim.problems.tracking_parameters import TrackingParameters
from netsim.protocols.time_sync import FloodingTimeSyncParameters
from netsim.sim.budget import BudgetParameters
from netsim.sim.duty_cycle import DutyCycleParameters
from netsim.sim.faults.rules import FaultRule
from netsim.sim.local_clock import ClockParameters
from netsim.sim.mac.aloha import AlohaParameters
from netsim.sim.mac.csma import CsmaParameters
from netsim.sim.mac.ideal import IdealMacParameters
from netsim.sim.mac.lpl_timing import LplParameters
from netsim.sim.mac.tdma import TdmaParameters
from netsim.sim.net.collection import CollectionParameters
from netsim.sim.net.geographic import GeographicParameters
from netsim.sim.net.routes import OneHopParameters, ShortestPathParameters

MacParameters = IdealMacParameters | CsmaParameters | AlohaParameters | TdmaParameters | LplParameters
NetworkParameters = OneHopParameters | ShortestPathParameters | GeographicParameters | CollectionParameters
ProblemParameters = (
    AssociationParameters
    | GraphParameters
    | DistributionParameters
    | TrackingParameters
    | EnergyTrackingParameters
    | EventAssociationParameters
    | NoProblemParameters
)


Fidelity = Literal["ideal", "prr", "sinr", "csma", "lpl"]


@parameters
class FieldParameters:
    """The rectangle in which everything happens."""

    width_m: Positive = 100.0
    """Extent along x."""
    height_m: Positive = 100.0
    """Extent along y."""
    origin_m: PointM = (0.0, 0.0)
    """Lower left corner."""


@parameters
class DeviceBattery:
    """A battery from a device table."""

    type: Literal["device"] = "device"
    device: Name = "aa_pair"
    """A shipped battery (see `netsim list`) or the path of a battery file."""


@parameters
class CapacityBattery:
    """A battery of a given usable energy."""

    type: Literal["capacity"] = "capacity"
    energy_j: Positive
    """Usable energy when full."""


@parameters
class MainsPower:
    """Mains power: it never runs out; what is drawn is still counted."""

    type: Literal["mains"] = "mains"


BatteryParameters = DeviceBattery | CapacityBattery | MainsPower | PeukertParameters | RakhmatovVrudhulaParameters


@parameters
class NodeGroup:
    """Nodes that are alike."""

    name: Name
    """Name of the group."""
    placement: PlacementParameters
    """Where its nodes stand."""
    mobility: WaypointMobility | None = None
    """How they move; null for nodes that stay."""
    role: Literal["sensor", "sink"] = "sensor"
    """A sink has no sensor; it is usually mains-powered."""
    radio: Name = "cc2420"
    """A shipped radio (see `netsim list`) or the path of a radio file."""
    tx_power_dbm: float = 0.0
    """Transmit power; one the radio offers."""
    tx_range_m: Positive | None = None
    """For the first-order radio, in place of `tx_power_dbm`: the range that its amplifier's power is meant for."""
    lora: LoraParameters | None = None
    """Settings of a LoRa radio, if not the defaults of each; refused for other radios."""
    cpu: Name = "msp430"
    """A shipped processor (see `netsim list`) or the path of a CPU file."""
    battery: BatteryParameters = DeviceBattery()
    """What the nodes live on."""
    harvester: HarvestParameters | None = None
    """What charges the battery, up to what it holds when full; for linear batteries only."""
    sensor: SensorParameters | None = SensorParameters()
    """The sensor's cost per reading; null for none."""
    clock: ClockParameters | None = None
    """How their clocks drift; null for perfect clocks."""
    duty_cycle: DutyCycleParameters | None = None
    """When their radios sleep; null for never, unless the MAC or the algorithm lets them."""
    budget: BudgetParameters | None = None
    """What each of them may draw; null for whatever the battery holds."""
    algorithm: dict[str, Any] | None = None
    """What these nodes run, if not the scenario's algorithm."""


@parameters
class TraceParameters:
    """What the trace holds."""

    detail: Literal["summary", "frames", "full"] = "frames"
    """`summary`: one row a frame, for its addressee; `frames`: its outcome at every audible node; `full`: every radio
    state change besides."""
    energy_interval_s: Positive = 1.0
    """How often the nodes' energy is sampled into the trace."""


@parameters
class Scenario:
    """A run, fully described."""

    kind: Literal["scenario"]
    """What this file is."""
    schema_version: Literal[1]
    """Version of this format: 1."""
    name: Name
    """Short name; the run's folder is called after it."""
    description: str = ""
    """What it shows, for people."""
    seed: NonNegativeInt = 1
    """Every random number follows from it."""
    repetition: NonNegativeInt = 0
    """Which of a study's repetitions; another one draws other numbers from the same seed."""
    duration_s: Positive = 60.0
    """The run's horizon in simulated time; it ends earlier when every algorithm has."""
    field: FieldParameters = FieldParameters()
    """The rectangle in which everything happens."""
    nodes: Annotated[tuple[NodeGroup, ...], MinLen(1)]
    """Groups of nodes."""
    fidelity: Fidelity | None = None
    """A rung of the ladder from lossless to real; it overrides `medium.reception` and `mac`, and leaves the rest.

    `ideal`: the links with a packet reception ratio (PRR) of at least a half lose nothing, the others do not exist; frames
    are sent at once and never meet. `prr`: each link loses frames at its PRR. `sinr`: signals also add up and interfere, and
    a radio is deaf while it sends. `csma`: nodes listen before they send, acknowledge and retry. `lpl`: and their receivers
    are off but for short samples. A MAC of the rung's own type keeps its settings. By default `medium` and `mac` say it all.
    """
    medium: MediumParameters = IdealMediumParameters()
    """The shared air."""
    mac: MacParameters = CsmaParameters()
    """Medium access."""
    network: NetworkParameters = ShortestPathParameters()
    """How messages find their way."""
    time_sync: FloodingTimeSyncParameters | None = None
    """How nodes set their clocks by each other, beside whatever they run; null for not at all."""
    problem: ProblemParameters = NoProblemParameters()
    """What the nodes are to find out."""
    algorithm: dict[str, Any]
    """What the nodes run: `type` names a shipped algorithm (see `netsim list`) or your own `module:Class`."""
    duty_plan: DutyPlan | None = None
    """A node's day, for `netsim lifetime`; it changes nothing in the run."""
    faults: tuple[FaultRule, ...] = ()
    """What goes wrong: crashes, outages, bursts of loss, corruption, jammers, sensors that lie."""
    trace: TraceParameters = TraceParameters()
    """What the trace holds."""

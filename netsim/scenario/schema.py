"""The scenario: every setting of a run, with its default, unit and range.

Sections that belong to one part of netsim are declared beside that part's code; this module puts them together.
"""

from typing import Annotated, Any, Literal

from annotated_types import MinLen

from netsim.models.path_loss import IdealMediumParameters, LogDistanceParameters
from netsim.models.placement import PlacementParameters
from netsim.models.sensors import SensorParameters
from netsim.parameters import Name, NonNegativeInt, PointM, Positive, parameters
from netsim.problems.association import AssociationParameters
from netsim.problems.graph import GraphParameters
from netsim.problems.none import NoProblemParameters
from netsim.sim.mac.csma import CsmaParameters
from netsim.sim.mac.ideal import IdealMacParameters
from netsim.sim.net.collection import CollectionParameters
from netsim.sim.net.geographic import GeographicParameters
from netsim.sim.net.routes import OneHopParameters, ShortestPathParameters

MediumParameters = IdealMediumParameters | LogDistanceParameters
MacParameters = IdealMacParameters | CsmaParameters
NetworkParameters = OneHopParameters | ShortestPathParameters | GeographicParameters | CollectionParameters
ProblemParameters = AssociationParameters | GraphParameters | NoProblemParameters


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


BatteryParameters = DeviceBattery | CapacityBattery | MainsPower


@parameters
class NodeGroup:
    """Nodes that are alike."""

    name: Name
    """Name of the group."""
    placement: PlacementParameters
    """Where its nodes stand."""
    role: Literal["sensor", "sink"] = "sensor"
    """A sink has no sensor; it is usually mains-powered."""
    radio: Name = "cc2420"
    """A shipped radio (see `netsim list`) or the path of a radio file."""
    tx_power_dbm: float = 0.0
    """Transmit power; one the radio offers."""
    cpu: Name = "msp430"
    """A shipped processor (see `netsim list`) or the path of a CPU file."""
    battery: BatteryParameters = DeviceBattery()
    """What the nodes live on."""
    sensor: SensorParameters | None = SensorParameters()
    """The sensor's cost per reading; null for none."""
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
    medium: MediumParameters = IdealMediumParameters()
    """The shared air."""
    mac: MacParameters = CsmaParameters()
    """Medium access."""
    network: NetworkParameters = ShortestPathParameters()
    """How messages find their way."""
    problem: ProblemParameters = NoProblemParameters()
    """What the nodes are to find out."""
    algorithm: dict[str, Any]
    """What the nodes run: `type` names a shipped algorithm (see `netsim list`) or your own `module:Class`."""
    trace: TraceParameters = TraceParameters()
    """What the trace holds."""

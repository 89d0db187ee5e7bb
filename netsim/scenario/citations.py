"""Where the models come from that a scenario can name: one citation for every kind of record, and for what has no record.

The documents are those that the code beside each record follows and names; what netsim chose by itself says so. A new
kind of record without a citation fails a test.
"""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from netsim.algorithms.registry import CHEN_2006, LIU_2002, LIU_2004, OH_2010
from netsim.metrics.lifetime import DutyPlan
from netsim.models import (
    batteries,
    fading,
    first_order,
    harvest,
    lora,
    manoeuvre,
    media,
    modulation,
    noise,
    placement,
    sound,
    tracks,
)
from netsim.models.sensors import SensorParameters
from netsim.models.waypoints import WaypointMobility
from netsim.problems import (
    association,
    coverage,
    drawn_graphs,
    energy_tracking,
    event_association,
    graph,
    target_distribution,
    tracking,
    vehicle_sounds,
)
from netsim.problems.none import NoProblemParameters
from netsim.protocols.time_sync import FloodingTimeSyncParameters
from netsim.scenario.schema import CapacityBattery, DeviceBattery, MainsPower
from netsim.sim import budget, duty_cycle
from netsim.sim.faults import rules
from netsim.sim.local_clock import ClockParameters
from netsim.sim.mac.aloha import AlohaParameters
from netsim.sim.mac.csma import CsmaParameters
from netsim.sim.mac.ideal import IdealMacParameters
from netsim.sim.mac.lpl_timing import LplParameters
from netsim.sim.mac.tdma import TdmaParameters
from netsim.sim.net import routes, settings
from netsim.sim.net.collection import CollectionParameters
from netsim.sim.net.geographic import GeographicParameters

OWN: Final = "netsim's own"
_IEEE: Final = "IEEE 802.15.4-2006"
_RAPPAPORT: Final = "Rappaport, Wireless Communications"


class Cited(NamedTuple):
    """What a kind of record stands for.

    Attributes:
        part: Part of the simulation, such as `fading`.
        citation: Where it comes from; `OWN` for what netsim chose.
    """

    part: str
    citation: str


def _own(part: str, *records: type[Any]) -> dict[type[Any], Cited]:
    return {record: Cited(part, OWN) for record in records}


CITED: Final[Mapping[type[Any], Cited]] = {
    association.AssociationParameters: Cited("problem", f"{CHEN_2006}, sections 3 and 6.1"),
    graph.GraphParameters: Cited("problem", f"{OWN}; the pairwise form as in {CHEN_2006}, eqs 2 to 5"),
    target_distribution.DistributionParameters: Cited("problem", f"{CHEN_2006}, sections 4 and 6.2"),
    energy_tracking.EnergyTrackingParameters: Cited("problem", f"{LIU_2004}, sections 4 and 6"),
    energy_tracking.EnergyTarget: Cited("target", f"{LIU_2004}, eq 3; the saturation is netsim's own"),
    vehicle_sounds.LabelParameters: Cited("sensor", f"{LIU_2004}, section 6: evidence of .94; as labels netsim's own"),
    event_association.EventAssociationParameters: Cited("problem", f"{OH_2010}, sections 2, 5 and 6"),
    event_association.UniformMeasurements: Cited(
        "measurements", f"{OH_2010}, section 6; that they are uniform is a reading"
    ),
    event_association.GeneratedMeasurements: Cited("measurements", f"{OH_2010}, section 2"),
    event_association.DrawnEvents: Cited("events", f"{OH_2010}, section 6"),
    event_association.ListedEvents: Cited("events", f"{OH_2010}, section 6, first example"),
    tracking.TrackingParameters: Cited("problem", f"{LIU_2002}, sections 2 to 5"),
    tracking.AcousticTarget: Cited("target", f"{LIU_2002}, eq 5"),
    tracking.AssumedAmplitude: Cited("sensor model", f"{LIU_2002}, eq 6"),
    tracking.AssumedBearing: Cited("sensor model", f"{LIU_2002}, eq 11 and Fig. 6; slopes are netsim's own"),
    sound.MicrophoneArray: Cited("sensor model", f"{LIU_2002}, section 5.2.1; sound and noise are netsim's own"),
    **_own("track", tracks.WaypointTrack, tracks.FileTrack),
    manoeuvre.ManoeuvreTrack: Cited("track", "Gauss-Markov mobility, Liang and Haas 1999"),
    tracks.StraightTrack: Cited("track", f"{LIU_2002}, section 5.1"),
    **_own("problem", NoProblemParameters),
    coverage.DiscCoverage: Cited("coverage", f"{CHEN_2006}, section 4.1"),
    **_own("coverage", coverage.CellCoverage),
    association.UniformTargets: Cited("targets", f"{CHEN_2006}, section 6.1"),
    **_own("targets", association.ListedTargets),
    graph.GraphFile: Cited("model graph", "formats: UAI (Markov networks) and libDAI's factor graphs"),
    **_own("model graph", drawn_graphs.ChainGraph, drawn_graphs.TreeGraph, drawn_graphs.GridGraph),
    **_own("medium", media.IdealMediumParameters, media.UnitDiskParameters),
    media.FreeSpaceParameters: Cited("medium", "Friis 1946"),
    media.LogDistanceParameters: Cited("medium", f"{_RAPPAPORT}, 4.9; exponent 3 as in TOSSIM and ns-3"),
    media.TwoSlopeParameters: Cited("medium", "IEEE 802.15.4 path loss at 2.4 GHz, as INET has it"),
    media.TraceMediumParameters: Cited("medium", "measured links; formats: TOSSIM topologies, K7 testbed logs"),
    **_own("noise", noise.ConstantNoiseParameters),
    noise.GaussianNoiseParameters: Cited("noise", "white noise of TOSSIM's topology generator (sd 4 dB)"),
    noise.ReplayedNoiseParameters: Cited("noise", f"{OWN}: readings in order; files as TOSSIM's"),
    fading.RayleighFading: Cited("fading", f"{_RAPPAPORT}, 5.6.1"),
    fading.RicianFading: Cited("fading", f"{_RAPPAPORT}, 5.6.2"),
    fading.NakagamiFading: Cited("fading", "Nakagami 1960"),
    **_own("fading", fading.LogNormalFading),
    modulation.OQpsk: Cited("modulation", f"{_IEEE}, E.4.1.8"),
    modulation.NcFsk: Cited(
        "modulation",
        'Zuniga and Krishnamachari, "Analyzing the transitional region in low power wireless links", SECON 2004',
    ),
    modulation.Cc2420Fit: Cited("modulation", "TOSSIM's fit to measurements of the CC2420"),
    modulation.LoraChirps: Cited(
        "modulation", 'Bor et al., "Do LoRa low-power wide-area networks scale?", MSWiM 2016 (LoRaSim)'
    ),
    lora.LoraParameters: Cited("LoRa airtime", "Semtech AN1200.13, section 4; SX1276 data sheet, 4.1.1.6 and 4.1.1.7"),
    first_order.FirstOrderAmplifier: Cited(
        "radio energy",
        "Heinzelman, Chandrakasan, Balakrishnan, HICSS 2000; IEEE Trans. Wireless Communications 1(4), 2002",
    ),
    **_own("MAC", IdealMacParameters),
    CsmaParameters: Cited("MAC", f"{_IEEE}, 7.5.1.4 and 7.5.6.4"),
    AlohaParameters: Cited("MAC", "Abramson, AFIPS 1970; duty-cycle limit as in LoRaWAN"),
    TdmaParameters: Cited("MAC", f"{OWN}: slots by a two-hop colouring; 10 ms as in IEEE 802.15.4e TSCH"),
    LplParameters: Cited(
        "MAC",
        "x-mac: Buettner, Yee, Anderson, Han, SenSys 2006; b-mac: Polastre, Hill, Culler, SenSys 2004; sampling: "
        "Dunkels, ContikiMAC, SICS T2011:13",
    ),
    **_own("network", routes.OneHopParameters),
    routes.ShortestPathParameters: Cited(
        "network",
        "etx: De Couto, Aguayo, Bicket, Morris, MobiCom 2003; with beacons: DSDV, Perkins and Bhagwat 1994, and the "
        "feasibility condition of RFC 8966, 3.5.1",
    ),
    GeographicParameters: Cited("network", "Karp and Kung, GPSR, MobiCom 2000"),
    CollectionParameters: Cited("network", "Gnawali, Fonseca, Jamieson, Moss, Levis, CTP, SenSys 2009"),
    **_own("neighbours", settings.GivenNeighbours),
    settings.BeaconDiscovery: Cited(
        "neighbours", 'Fonseca, Gnawali, Jamieson, Levis, "Four-bit wireless link estimation", HotNets 2007'
    ),
    FloodingTimeSyncParameters: Cited(
        "time synchronisation",
        'Maroti, Kusy, Simon, Ledeczi, "The flooding time synchronization protocol", SenSys 2004',
    ),
    ClockParameters: Cited("clock", f"{OWN}: constant rates; 30 ppm as in Castalia and 6TiSCH"),
    **_own("battery", DeviceBattery, CapacityBattery, MainsPower),
    batteries.PeukertParameters: Cited("battery", "Peukert 1897"),
    batteries.RakhmatovVrudhulaParameters: Cited(
        "battery",
        'Rakhmatov and Vrudhula, "An analytical high-level battery model for use in energy management of portable '
        'electronic systems", ICCAD 2001',
    ),
    **_own("harvester", harvest.ConstantHarvest, harvest.DayHarvest),
    SensorParameters: Cited("sensor", "default: MICA2 sensor board, measured (PowerTOSSIM); its time is chosen"),
    **_own("duty cycle", duty_cycle.DutyCycleParameters),
    **_own("energy allowance", budget.BudgetParameters),
    **_own("lifetime plan", DutyPlan),
    **_own("placement", placement.GridPlacement, placement.JitteredGridPlacement, placement.UniformPlacement),
    **_own("placement", placement.PoissonDiskPlacement, placement.ListedPlacement, placement.CsvPlacement),
    **_own("mobility", WaypointMobility),
    **_own("fault", rules.CrashRule, rules.RoleCrashRule, rules.OutageRule, rules.PartitionRule),
    rules.GilbertElliottRule: Cited(
        "fault", "Gilbert, Bell System Technical Journal 39 (1960); Elliott, ibid. 42 (1963)"
    ),
    **_own("fault", rules.CorruptionRule, rules.DuplicationRule, rules.DelayRule, rules.JammerRule),
    **_own("fault", rules.SensorBiasRule, rules.SensorStuckRule, rules.SensorNoiseRule, rules.SensorDeadRule),
}
"""By the class of the record, or of the model that a device table chooses."""

NAMES: Final[Mapping[type[Any], str]] = {
    tracking.AcousticTarget: "sound-source",
    energy_tracking.EnergyTarget: "energy-source",
    vehicle_sounds.LabelParameters: "labels",
    tracking.AssumedAmplitude: "amplitude",
    tracking.AssumedBearing: "bearing",
    energy_tracking.EnergyTarget: "energy-source",
    sound.MicrophoneArray: "microphones",
    modulation.OQpsk: "o-qpsk",
    modulation.NcFsk: "nc-fsk",
    modulation.Cc2420Fit: "cc2420-fit",
    modulation.LoraChirps: "lora",
    lora.LoraParameters: "lora",
    first_order.FirstOrderAmplifier: "first-order",
    settings.GivenNeighbours: "given",
    ClockParameters: "crystal",
    SensorParameters: "sensor",
    duty_cycle.DutyCycleParameters: "periodic",
    budget.BudgetParameters: "budget",
    DutyPlan: "duty-plan",
}
"""Names of the records that have no `type`."""


class Aspect(NamedTuple):
    """A model that a record switches on by a value of its own.

    Attributes:
        part: As in `Cited`.
        name: What it is called.
        summary: What it is, in one line.
        citation: As in `Cited`.
    """

    part: str
    name: str
    summary: str
    citation: str


RECEPTION: Final[Mapping[str, Aspect]] = {
    "perfect": Aspect("reception", "perfect", "Links with a reception ratio of at least a half lose nothing", OWN),
    "prr": Aspect(
        "reception", "prr", "Each link loses frames at its own packet reception ratio; nothing interferes", OWN
    ),
    "sinr": Aspect("reception", "sinr", "Bit by bit, by the signal against noise and the sum of all interference", OWN),
}
SHADOWING: Final = Aspect(
    "shadowing", "static", "Normal in dB, drawn once for each pair of nodes", f"{_RAPPAPORT}, 4.9"
)
ASYMMETRY: Final = Aspect("shadowing", "asymmetry", "A link's two directions differ, normal in dB", OWN)
HARDWARE: Final = Aspect(
    "hardware variation",
    "covariance",
    "Output power and noise floor of nodes of one make are jointly normal",
    "Zuniga and Krishnamachari, ACM Trans. Sensor Networks 3(2), 2007",
)
ASPECTS: Final = (*RECEPTION.values(), SHADOWING, ASYMMETRY, HARDWARE)

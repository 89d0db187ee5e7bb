"""The shared air as a scenario describes it: one record a medium, told apart by `type`.

Those with physics share the fields of `PhysicalMedium` and differ in how power falls with distance: their `loss_db`.
"""

import math
from typing import Annotated, Literal

import numpy as np
from annotated_types import Gt, Le
from numpy.typing import NDArray

from netsim.models.fading import FadingParameters
from netsim.models.hardware import Covariance, is_covariance
from netsim.models.noise import ConstantNoiseParameters, NoiseParameters, ReplayedNoiseParameters
from netsim.parameters import Name, NonNegative, NonNegativeInt, Positive, Probability, parameters

Array = NDArray[np.float64]
Reception = Literal["perfect", "prr", "sinr"]
Exponent = Annotated[float, Gt(0), Le(10)]

SPEED_OF_LIGHT_M_PER_S = 299_792_458.0
NOISE_DBM = -95.4


@parameters
class IdealMediumParameters:
    """A medium without physics: every frame arrives at every node in range after a delay, unless lost at random."""

    type: Literal["ideal"] = "ideal"
    """Selects this medium."""
    delay_s: NonNegative = 1e-4
    """From the end of a frame's airtime to its reception."""
    range_m: Positive | None = None
    """How far a frame is heard; by default everywhere."""
    loss_probability: Probability = 0.0
    """Chance that a listener misses a frame, each on its own."""


@parameters
class PhysicalMedium:
    """What all media with physics have in common; not a medium by itself.

    Static shadowing, asymmetry and hardware offsets are drawn once a run, each from a stream of the nodes it concerns. They
    belong to the nodes, not to places: where nodes move, they move along.
    """

    type: str
    noise_dbm: float = NOISE_DBM
    """Effective noise power at the receiver, in its own bandwidth: the default is for 802.15.4 at 2.4 GHz.

    Radios of other bandwidths need their own: -117.03 for LoRa in 125 kHz (6 dB noise figure), -105 for the MICA2.

    The thermal noise in 2 MHz is -111.0 dBm (kTB at 290 K). The default adds 15.6 dB for noise figure and
    implementation loss, so that the 802.15.4 error formula meets the sensitivity of the CC2420 data sheet (1 % loss of
    20-byte frames at -95 dBm). ns-3's -106.987 dBm is kTB in 5 MHz without any noise figure: its links reach 2.4 times
    as far (n = 3).
    """
    noise: NoiseParameters = ConstantNoiseParameters()
    """How noise varies in time about `noise_dbm`, or a file of readings in its place."""
    shadowing_sd_db: NonNegative = 0.0
    """Standard deviation of the static shadowing of a pair of nodes."""
    asymmetry_sd_db: NonNegative = 0.0
    """Standard deviation of the difference between a link's two directions; 0 makes all links symmetric."""
    hardware_covariance: Covariance | None = None
    """How nodes of one make differ: covariance of (noise floor, output power) in dB^2; by default they are alike.

    [[3.7, -3.3], [-3.3, 6.0]] was measured for the MICA2 (Zuniga and Krishnamachari 2007). The two directions of a link then
    differ by sqrt(2 * 6.0) = 3.5 dB (standard deviation), all links of a node in the same sense.
    """
    fading: FadingParameters | None = None
    """Power gain drawn anew for each frame and listener; by default none."""
    reception: Reception = "sinr"
    """`sinr`: signal against noise and the sum of all interference, bit by bit; `prr`: each link loses frames at its own
    packet reception ratio (that of a full-size frame at the median noise, averaged over fading), and nothing interferes;
    `perfect`: links with a ratio of at least a half lose nothing, the others do not exist, and nothing interferes."""

    def __post_init__(self) -> None:
        """Refuse what no annotation can."""
        check_hardware_and_noise(self.hardware_covariance, self.noise, self.noise_dbm)


@parameters
class UnitDiskParameters(PhysicalMedium):
    """Everyone within a radius is heard equally well, nobody beyond it."""

    type: Literal["unit-disk"] = "unit-disk"
    """Selects this medium."""
    radius_m: Positive = 50.0
    """Greatest distance at which anything is heard; shadowing does not change it."""
    received_power_dbm: Annotated[float, Le(0)] = -60.0
    """What is received within the radius of a sender at 0 dBm, whatever the distance."""

    def loss_db(self, distance_m: Array) -> Array:
        """Loss over distances of any shape: one value inside the radius (its edge included), infinite outside."""
        return np.where(distance_m <= self.radius_m, -self.received_power_dbm, np.inf)


@parameters
class FreeSpaceParameters(PhysicalMedium):
    """Free space between isotropic antennas: L = 20 log10(4 pi d f / c) (Friis 1946)."""

    type: Literal["free-space"] = "free-space"
    """Selects this medium."""
    frequency_hz: Positive = 2.405e9
    """Carrier frequency; the default is IEEE 802.15.4 channel 11."""
    reference_distance_m: Positive = 1.0
    """Nearer nodes are treated as if they were this far apart; the law holds many wavelengths away."""

    def loss_db(self, distance_m: Array) -> Array:
        """Loss over distances of any shape."""
        reach = np.maximum(distance_m, self.reference_distance_m)
        loss: Array = 20.0 * np.log10(4.0 * math.pi * self.frequency_hz / SPEED_OF_LIGHT_M_PER_S * reach)
        return loss


@parameters
class LogDistanceParameters(PhysicalMedium):
    """A shared medium with log-distance path loss, static shadowing, noise and interference."""

    type: Literal["log-distance"] = "log-distance"
    """Selects this medium."""
    exponent: Exponent = 3.0
    """Path-loss exponent n: 2 in free space, 2 to 4 outdoors near the ground; 3 is the default of TOSSIM and ns-3."""
    reference_loss_db: float = 40.05
    """Loss at the reference distance; the default is free space at 2.40 GHz over 1 m, 20 log10(4 pi d f / c)."""
    reference_distance_m: Positive = 1.0
    """Reference distance d0; nearer nodes are treated as if they were this far apart."""
    shadowing_sd_db: NonNegative = 4.0
    """Standard deviation of the static shadowing of a pair of nodes; 4 dB in Castalia, 0 for a plain disk."""

    def loss_db(self, distance_m: Array) -> Array:
        """Loss over distances of any shape."""
        ratio = np.maximum(distance_m / self.reference_distance_m, 1.0)
        loss: Array = self.reference_loss_db + 10.0 * self.exponent * np.log10(ratio)
        return loss


@parameters
class TwoSlopeParameters(PhysicalMedium):
    """Log-distance path loss with another exponent beyond a breakpoint.

    The defaults are those of IEEE 802.15.4 for 2.4 GHz as INET has them: 40.2 dB at 1 m and n = 2 up to 8 m, n = 3.3
    beyond. Its 58.5 dB at the breakpoint lie 0.24 dB above the near slope; give `breakpoint_loss_db: 58.5` to have it so.
    """

    type: Literal["two-slope"] = "two-slope"
    """Selects this medium."""
    reference_loss_db: float = 40.2
    """Loss at the reference distance."""
    reference_distance_m: Positive = 1.0
    """Reference distance; nearer nodes are treated as if they were this far apart."""
    near_exponent: Exponent = 2.0
    """Path-loss exponent up to the breakpoint."""
    breakpoint_m: Positive = 8.0
    """Where the second slope begins; at least the reference distance."""
    far_exponent: Exponent = 3.3
    """Path-loss exponent beyond the breakpoint."""
    breakpoint_loss_db: float | None = None
    """Loss at the start of the second slope; by default where the first one ends."""

    def __post_init__(self) -> None:
        """Refuse what no annotation can."""
        check_hardware_and_noise(self.hardware_covariance, self.noise, self.noise_dbm)
        if self.breakpoint_m < self.reference_distance_m:
            message = "breakpoint_m of at least reference_distance_m"
            raise ValueError(message)

    def loss_db(self, distance_m: Array) -> Array:
        """Loss over distances of any shape."""
        ratio = np.maximum(distance_m / self.reference_distance_m, 1.0)
        near = self.reference_loss_db + 10.0 * self.near_exponent * np.log10(ratio)
        at_break = self.breakpoint_loss_db
        if at_break is None:
            at_break = self.reference_loss_db + 10.0 * self.near_exponent * math.log10(
                self.breakpoint_m / self.reference_distance_m
            )
        beyond = np.maximum(distance_m / self.breakpoint_m, 1.0)
        far = at_break + 10.0 * self.far_exponent * np.log10(beyond)
        return np.where(distance_m <= self.breakpoint_m, near, far)


@parameters
class TraceMediumParameters:
    """Measured or generated links from a file; positions of the nodes play no part in reception.

    `tossim`: lines `gain SOURCE LISTENER dB` and `noise NODE FLOOR_dBm SD_dB`, separated by blanks; a listener hears nothing
    of a source without a line. `k7`: a testbed's delivery ratios by link, channel and time, gzip or plain text; a frame
    arrives with the ratio that was measured in the round of that simulated time, and without a row in it never.
    """

    type: Literal["trace"] = "trace"
    """Selects this medium."""
    file: Name
    """The file, relative to the scenario."""
    format: Literal["tossim", "k7"]
    """What is in it."""
    noise_dbm: float = NOISE_DBM
    """Noise power at nodes for which the file gives none."""
    noise: NoiseParameters | None = None
    """How noise varies in time; by default as the file says (`tossim`: normal with its standard deviations, drawn anew every
    millisecond) or constant. Replayed noise takes the place of the file's; a `k7` file allows constant noise only, because
    its delivery ratios contain the noise there was."""
    fading: FadingParameters | None = None
    """`tossim` only: power gain drawn anew for each frame and listener."""
    reception: Reception = "sinr"
    """As for the media with physics. With a `k7` file, `sinr` loses frames at the measured ratio and by interference
    besides; `prr` at the measured ratio alone; `perfect` keeps the links whose ratio at the start is at least a half."""
    channel: NonNegativeInt | None = None
    """`k7` only: which channel is replayed; by default the lowest in the file."""
    transmit_power_dbm: float = 0.0
    """`k7` only: power at which the file was recorded; all nodes must send at it, since its ratios hold for no other."""
    start_s: NonNegative = 0.0
    """`k7` only: time of the recording at which the simulation starts. A sender's measurement holds until its next one,
    and its first one before it too."""
    speed: Positive = 1.0
    """`k7` only: seconds of the recording that go by in a simulated second."""
    at_end: Literal["hold", "loop"] = "hold"
    """`k7` only: after the recording's end, hold its last measurements or begin anew."""

    def __post_init__(self) -> None:
        """Refuse what no annotation can."""
        if self.format == "k7" and (self.fading is not None or not isinstance(self.noise, _NO_NOISE)):
            message = "neither fading nor varying noise with format k7: its delivery ratios contain both"
            raise ValueError(message)
        fields = TraceMediumParameters.__dataclass_fields__
        unused = [name for name in _K7_ONLY if getattr(self, name) != fields[name].default]
        if self.format != "k7" and unused:
            message = f"no {' and no '.join(unused)} with format {self.format}: only k7 files use it"
            raise ValueError(message)


_K7_ONLY = ("channel", "transmit_power_dbm", "start_s", "speed", "at_end")
_NO_NOISE = (type(None), ConstantNoiseParameters)

LossMedium = UnitDiskParameters | FreeSpaceParameters | LogDistanceParameters | TwoSlopeParameters
"""Media in which power falls with distance."""
MediumParameters = IdealMediumParameters | LossMedium | TraceMediumParameters


def check_hardware_and_noise(covariance: Covariance | None, noise: NoiseParameters, noise_dbm: float) -> None:
    """Refuse a matrix that is no covariance, and a noise level that would not be used.

    Raises:
        ValueError: With what should hold.
    """
    if covariance is not None and not is_covariance(covariance):
        message = "hardware_covariance symmetric and positive semidefinite, such as [[3.7, -3.3], [-3.3, 6.0]]"
        raise ValueError(message)
    if isinstance(noise, ReplayedNoiseParameters) and noise_dbm != NOISE_DBM:
        message = (
            "no noise_dbm where noise is replayed from a file: it would not be used; set noise.median_dbm to shift it"
        )
        raise ValueError(message)

"""The first-order radio model of the clustering literature: so much energy a bit, and an amplifier for the distance.

Heinzelman, Chandrakasan and Balakrishnan, "Energy-efficient communication protocol for wireless microsensor networks",
HICSS 2000, and "An application-specific protocol architecture for wireless microsensor networks", IEEE Trans. Wireless
Communications 1(4), 2002: sending k bits over d costs E_elec k + eps_fs k d^2 below the crossover distance
d0 = sqrt(eps_fs / eps_mp) and E_elec k + eps_mp k d^4 from there on; receiving them costs E_elec k.
"""

import math
from dataclasses import dataclass

from netsim.units import dbm_to_mw, mw_to_dbm

MW_PER_NJ_BIT = 1e-6


@dataclass(frozen=True, slots=True)
class FirstOrderAmplifier:
    """What sending costs beside and in the amplifier.

    Attributes:
        electronics_nj_per_bit: E_elec.
        free_space_pj: eps_fs, in pJ/bit/m^2.
        multipath_pj: eps_mp, in pJ/bit/m^4.
    """

    electronics_nj_per_bit: float
    free_space_pj: float
    multipath_pj: float

    @property
    def crossover_m(self) -> float:
        """d0: where both laws give the same."""
        return math.sqrt(self.free_space_pj / self.multipath_pj)

    def amplifier_nj_per_bit(self, range_m: float) -> float:
        """Energy of the amplifier for one bit over a distance."""
        if range_m < self.crossover_m:
            return 1e-3 * self.free_space_pj * range_m**2
        return 1e-3 * self.multipath_pj * range_m**4

    def power_for_range_dbm(self, range_m: float, bitrate_bps: int) -> float:
        """The output power that stands for a range: the amplifier's energy a bit times the bit rate.

        With it as `tx_power_dbm` on an ideal medium of `range_m`, sending costs what the model says.

        Args:
            range_m: Distance to be reached, above 0.
            bitrate_bps: Bit rate of the radio.
        """
        return mw_to_dbm(self.amplifier_nj_per_bit(range_m) * bitrate_bps * MW_PER_NJ_BIT)

    def transmit_power_mw(self, tx_power_dbm: float, bitrate_bps: int) -> float:
        """What sending draws: the electronics, and all that the amplifier puts out."""
        return self.electronics_nj_per_bit * bitrate_bps * MW_PER_NJ_BIT + dbm_to_mw(tx_power_dbm)

"""How finely particles resolve a space: what a belief that has come down to one of them still does not know.

Where readings tell places apart more finely than the particles lie, one particle takes all the weight, and the weighted
covariance is nothing, however far the truth is from that particle. The distance from a place to the nearest of N places
drawn around it (Clark and Evans 1954, in any number of dimensions) is what remains unknown; Gordon, Salmond and Smith 1993,
section 4, roughen their samples by a jitter of the same law, N to the power of -1/d, with a factor that is tuned.
"""

import math

from netsim.kernels.particles import ParticleBelief


def resolution_m2(count: int, targets: int, most_m: float) -> float:
    """Variance of each coordinate between a place and the nearest particle.

    The particles are independent uniform draws, of each target from a disc, so that they are Poisson-like of density
    N / (pi r^2)^M in d = 2M dimensions. A ball of radius s holds none with the probability exp(-N s^(2M) / (M! r^(2M)));
    so E[s^2] = r^2 (M! / N)^(1/M) Gamma(1 + 1/M), and each of the 2M coordinates has an equal part. Boundaries are left out.

    Args:
        count: How many particles: N.
        targets: Of each particle: M.
        most_m: Radius of the discs: r.
    """
    power = 1.0 / targets
    share = math.pow(math.factorial(targets) / count, power)
    squared_m2 = most_m**2 * share * math.gamma(1.0 + power)
    return squared_m2 / (2 * targets)


def spread_m(belief: ParticleBelief) -> float:
    """Radius of a disc whose uniform draws vary as much as the places of a belief's targets: by r^2 / 4 a coordinate."""
    variance_m2 = sum(float(belief.covariance_m2(target).trace()) for target in range(belief.targets)) / 2
    return 2.0 * math.sqrt(variance_m2 / belief.targets)

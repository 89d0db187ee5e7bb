"""The diffusion of charge in a battery cell, after Rakhmatov and Vrudhula, as a state that moves on in closed form.

With lambda_m = beta^2 m^2 the sum in their sigma(t) is a sum of u_m(t) = integral of i(s) exp(-lambda_m (t - s)) ds. Under
a constant current i for a time d

    u_m -> u_m exp(-lambda_m d) + i (1 - exp(-lambda_m d)) / lambda_m,   charge -> charge + i d,
    sigma = charge + 2 (u_1 + u_2 + ...),

so a history of constant loads needs no more memory than these numbers.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Diffusion:
    """What loads have done to a cell so far. Currents in mA, times in minutes.

    Attributes:
        rates: lambda_m, per minute.
        charge: Charge drawn, mA min.
        locked: u_m, mA min.
    """

    rates: tuple[float, ...]
    charge: float
    locked: tuple[float, ...]

    @classmethod
    def at_rest(cls, beta_per_sqrt_min: float, terms: int) -> "Diffusion":
        """A cell from which nothing has been drawn."""
        rates = tuple((beta_per_sqrt_min * m) ** 2 for m in range(1, terms + 1))
        return cls(rates, 0.0, (0.0,) * terms)

    @property
    def sigma(self) -> float:
        """Charge that is gone or out of reach."""
        return self.charge + 2.0 * math.fsum(self.locked)

    def after(self, current_ma: float, time_min: float) -> "Diffusion":
        """The state after a constant current."""
        decay = [math.expm1(-rate * time_min) for rate in self.rates]
        locked = [
            u + less * (u - current_ma / rate) for u, less, rate in zip(self.locked, decay, self.rates, strict=True)
        ]
        return Diffusion(self.rates, self.charge + current_ma * time_min, tuple(locked))

    def slope_bounds(self, current_ma: float, from_min: float, to_min: float) -> tuple[float, float]:
        """Bounds of d sigma / dt under a constant current, from one time from now to another.

        The slope is i + 2 sum of c_m exp(-lambda_m t), with c_m = i - lambda_m u_m: terms above 0 are largest at the
        interval's begin, those below 0 at its end.
        """
        low = high = current_ma
        for rate, u in zip(self.rates, self.locked, strict=True):
            share = 2.0 * (current_ma - rate * u)
            begin, end = share * math.exp(-rate * from_min), share * math.exp(-rate * to_min)
            low += min(begin, end)
            high += max(begin, end)
        return low, high

    def steepest_rise(self, current_ma: float) -> float:
        """A bound on d sigma / dt under a constant current, from now on; at least the current."""
        shares = zip(self.rates, self.locked, strict=True)
        return current_ma + 2.0 * math.fsum(max(0.0, current_ma - rate * u) for rate, u in shares)

    def first_reach(self, alpha: float, current_ma: float, per_min: int) -> int:
        """The first whole fraction of a minute, counted from now, at which sigma has reached alpha.

        Sigma can rise and fall under one current (fast terms fill up while slow ones recover), so the first crossing is
        found by halving intervals: one in which even the steepest slope does not reach alpha is passed over, in one in
        which sigma only rises the crossing is found by bisection.

        Args:
            alpha: What is to be reached.
            current_ma: Constant current, above 0.
            per_min: How many of the fractions make a minute.
        """
        last = math.ceil((alpha - self.charge) / current_ma * per_min) + 1  # sigma is at least the charge drawn
        waiting = [(0, max(1, last))]
        while waiting:
            begin, end = waiting.pop()
            low, high = self.slope_bounds(current_ma, begin / per_min, end / per_min)
            if self._sigma_at(current_ma, begin / per_min) + high * (end - begin) / per_min < alpha * (1.0 - 1e-12):
                continue
            if low >= 0.0 or end - begin == 1:
                found = self._bisected(alpha, current_ma, per_min, begin, end)
                if found is not None:
                    return found
                continue
            middle = (begin + end) // 2
            waiting += [(middle, end), (begin, middle)]
        return max(1, last)

    def _sigma_at(self, current_ma: float, time_min: float) -> float:
        return self.after(current_ma, time_min).sigma

    def _bisected(self, alpha: float, current_ma: float, per_min: int, begin: int, end: int) -> int | None:
        """Where rising sigma reaches alpha in (begin, end]; None if it does not."""
        if self._sigma_at(current_ma, end / per_min) < alpha:
            return None
        while end - begin > 1:
            middle = (begin + end) // 2
            if self._sigma_at(current_ma, middle / per_min) >= alpha:
                end = middle
            else:
                begin = middle
        return end

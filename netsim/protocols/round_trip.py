"""How long to wait for an answer before taking it for lost: Jacobson, Karels 1988; RFC 6298 (2011), section 2."""

_SMOOTHING, _DEVIATION_SMOOTHING, _DEVIATIONS = 8, 4, 4


class RoundTrip:
    """The waiting time, learned from round trips that were measured: smoothed mean plus four mean deviations.

    Args:
        first_ns: Waiting time before the first measurement.
        least_ns: Least waiting time.
        most_ns: Longest waiting time, repetitions included.
    """

    def __init__(self, first_ns: int, least_ns: int, most_ns: int) -> None:
        self._least_ns = least_ns
        self._most_ns = most_ns
        self._mean_ns: int | None = None
        self._deviation_ns = 0
        self._timeout_ns = first_ns

    def measured(self, trip_ns: int) -> None:
        """Take a round trip; never one of a message that was sent more than once (Karn, Partridge 1987)."""
        if self._mean_ns is None:
            self._mean_ns, self._deviation_ns = trip_ns, trip_ns // 2
        else:
            self._deviation_ns += (abs(trip_ns - self._mean_ns) - self._deviation_ns) // _DEVIATION_SMOOTHING
            self._mean_ns += (trip_ns - self._mean_ns) // _SMOOTHING
        self._timeout_ns = max(self._least_ns, self._mean_ns + _DEVIATIONS * self._deviation_ns)

    def timeout_ns(self, repetitions: int) -> int:
        """How long to wait after a number of repetitions, each twice as long as before."""
        return min(self._timeout_ns << min(repetitions, 16), self._most_ns)

"""Against measurements: the Grenoble testbed replayed and fitted, the USC generator's statistics."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, binomtest

from netsim.calibrate import calibrate, read_log
from netsim.calibrate.plot import draw_reception
from netsim.kernels.path_loss_fit import asymmetry_sd_db, fit_path_loss
from netsim.models.delivery import rounds_of
from netsim.models.gain_file import read_gains
from netsim.models.hardware import hardware_offsets
from netsim.models.k7 import read_k7
from netsim.models.media import LogDistanceParameters
from netsim.models.path_loss import link_gains_db
from netsim.rng import Streams
from netsim.trace.events import OUTCOMES, Event, Frame
from netsim.trace.recorder import Handler
from validation import page
from validation.run import run

Floats = NDArray[np.float64]

CHANNEL = 20
ROUNDS = 20
REPLAY = """
kind: scenario
schema_version: 1
name: grenoble
duration_s: {duration_s}
field: {{width_m: 60, height_m: 30}}
nodes:
  - name: sensors
    placement: {{type: grid, rows: 5, columns: 10, spacing_m: 5}}
    battery: {{type: mains}}
medium: {{type: trace, file: grenoble.k7.gz, format: k7, channel: {channel}}}
mac: {{type: csma}}
network: {{type: one-hop}}
algorithm: {{type: neighbour-traffic, period_s: 10, payload_byte: 60, rounds: {rounds}}}
"""
ARRIVED, LOST = {"received", "overheard"}, {"weak"}


class Links:
    """Counts each link's frames and those that arrived, leaving out what interference and busy receivers lost."""

    def __init__(self) -> None:
        self.sent: Counter[tuple[int, int]] = Counter()
        self.arrived: Counter[tuple[int, int]] = Counter()

    def handlers(self) -> Mapping[type[Event], Handler]:
        """See `Observer.handlers`."""
        return {Frame: self._count}

    def _count(self, event: Any, _: int) -> None:
        for node, code in zip(event.rx_node, event.rx_outcome, strict=True):
            outcome = OUTCOMES[code]
            self.sent[event.source, int(node)] += outcome in ARRIVED | LOST
            self.arrived[event.source, int(node)] += outcome in ARRIVED


def section() -> str:
    """The part of the page on measurements."""
    parts = ["## Against measurements\n"]
    parts += [_replay(), _fit()] if (page.DATA / "grenoble.k7.gz").is_file() else ["The Grenoble log was not there.\n"]
    parts.append(_usc() if (page.DATA / "15-15-medium-mica2-grid.txt").is_file() else "The USC file was not there.\n")
    return "\n".join(parts)


def _replay() -> str:
    path = page.DATA / "grenoble.k7.gz"
    links = Links()
    scenario = REPLAY.format(duration_s=10 * ROUNDS + 10, channel=CHANNEL, rounds=ROUNDS)
    run(scenario, [links], {"grenoble.k7.gz": path})
    rounds = rounds_of(read_k7(path), CHANNEL, range(50))
    rows = []
    for (source, listener), sent in links.sent.items():
        if sent:
            place = int(np.searchsorted(rounds[source].listeners, listener))
            rows.append((float(rounds[source].ratio[0, place]), links.arrived[source, listener], sent))
    ratio, arrived, sent = (np.array(column) for column in zip(*rows, strict=True))
    between = (ratio > 0.0) & (ratio < 1.0)
    exact = np.array_equal(arrived[~between], ratio[~between] * sent[~between])
    values = [binomtest(int(a), int(n), float(p)).pvalue for a, n, p in zip(arrived[between], sent[between],
                                                                           ratio[between], strict=True)]  # fmt: skip
    outside = sum(value < 0.01 for value in values)
    figure, axis = page.axes(width=5.2, height=4.8)
    low = beta.ppf(0.005, arrived + 1e-9, sent - arrived + 1)
    high = beta.ppf(0.995, arrived + 1, sent - arrived + 1e-9)
    got = arrived / sent
    axis.errorbar(ratio[between], got[between], [np.maximum(got - low, 0)[between], np.maximum(high - got, 0)[between]],
                  fmt=".", color=page.BLUE, ecolor=page.GREY, elinewidth=0.7, ms=4,
                  label="link, 99 % interval")  # fmt: skip
    axis.plot([0, 1], [0, 1], color=page.ORANGE, lw=1, label="equal")
    axis.set(xlabel="measured delivery ratio", ylabel="replayed delivery ratio", aspect="equal")
    axis.set_title(f"Grenoble, channel {CHANNEL}")
    axis.legend()
    picture = page.save(figure, "grenoble-replay", "Replayed over measured delivery ratios of the Grenoble testbed")
    return f"""\
### The Grenoble testbed, replayed

50 nodes of the FIT IoT-LAB, channel {CHANNEL}, January 2018 (from the 6TiSCH simulator's repository): the `trace` medium
under CSMA-CA, every node sending to its neighbours; losses by interference and busy receivers are left out.
{int(sent.sum()):,} frames over {len(ratio)} links; on the {int((~between).sum())} links measured at 0 or 1 all or nothing
arrives{"" if exact else " (**not exactly**)"}; of the {len(values)} others {outside} lie outside their own 99 % interval
({0.01 * len(values):.1f} are expected), and the smallest p-value, {min(values):.4f}, is
{"above" if min(values) > 0.01 / len(values) else "**below**"} 0.01 / {len(values)}.

{picture}
Not shown: what happens between two rounds of the recording (the ratio is held), and interference at these nodes: their
received powers are known only where frames arrived, and not below -91 dBm (next section).
"""


def _fit() -> str:
    path = page.DATA / "grenoble.k7.gz"
    log = read_log(path)
    found = calibrate(log)
    figure, axes = page.axes(2, width=10.4)
    raw = read_k7(path)
    step = 6
    axes[0].plot(raw.mean_rssi_dbm[::step], raw.pdr[::step], ".", ms=2, color=page.GREY, alpha=0.3, rasterized=True)
    count = np.arange(1, 101)
    axes[0].plot(-91.0 + np.log(count), count / 100.0, color=page.RED, lw=1, label="-91 dBm + ln(frames received)")
    axes[0].set(xlabel="mean_rssi as in the file (dBm)", ylabel="packet reception ratio", xlim=(-92, -50))
    axes[0].set_title("As in the file")
    axes[0].legend(loc="lower right")
    draw_reception(found, axes[1])
    axes[1].set_xlim(-92, -50)
    axes[1].set_title("ln(frames received) taken off")
    picture = page.save(figure, "grenoble-fit", "Reception ratio over received power, as in the file and corrected")
    strong = [(number, f"{ratio:.2%}") for number, ratio in sorted(found.strong_ratio.items())]
    half = (len(strong) + 1) // 2
    rows = [(*strong[place], *(strong[place + half] if place + half < len(strong) else ("", "")))
            for place in range(half)]  # fmt: skip
    change = found.variation
    sd = f"{change.median_sd_db:.2f} dB" if change else "-"
    return f"""\
### The Grenoble testbed, fitted: what its log can tell

`netsim calibrate grenoble.k7.gz` finds three things, and says so.

1. **The powers in the file are not means.** The column `mean_rssi` is ln(sum(exp(rssi))), never divided by the number of
   frames: it grows by ln(100) = 4.6 dB with the number received. Taken as it is, the reception ratio seems a steep function
   of received power with its 50 % point at -87.3 dBm; that curve is the logarithm itself (left, red). With it taken off, the
   powers of rows whose frames all had one reading are whole numbers, 3 dB apart, as the radio reports them.
2. **The receivers report nothing below -91 dBm.** A quarter of all rows lies there, with ratios from 1 % to 100 %: the
   transition from losing to receiving happens below what the radio can measure (its sensitivity is given as -101 dBm). So
   neither the 50 % point nor the noise can be told from this log; netsim calibrate gives a bound and no fit.
3. **Channels differ by interference, not by noise.** What links receive that are 10 dB and more above the floor:

{page.table(["channel", "strong links receive", "channel", "strong links receive"], rows)}
   Channels 15, 20, 25 and 26 lie between or beside the wireless networks' bands; 12, 13, 17, 18, 22 and 23 within them.

A link's power changes little over the two days: median standard deviation between measurements {sd}.

{picture}
Not shown: path loss; the file has no positions. That the fit itself is right is tested with logs drawn from known
parameters: over a hundred of them, estimates scatter by the standard errors stated, also where weak links are missing.
"""


def _statistics(gains_db: Floats, noise_dbm: Floats, positions_m: Floats) -> list[float]:
    source, destination = np.nonzero(np.isfinite(gains_db))
    distance_m = np.hypot(*(positions_m[source] - positions_m[destination]).T)
    fit = fit_path_loss(distance_m, gains_db[source, destination])
    return [fit.exponent, fit.reference_loss_db, fit.shadowing_sd_db, asymmetry_sd_db(gains_db),
            float(noise_dbm.mean()), float(noise_dbm.std(ddof=1))]  # fmt: skip


def _usc() -> str:
    row, column = np.divmod(np.arange(225), 15)
    positions_m = 10.0 * np.column_stack([column, row]).astype(float)
    covariance = ((3.7, -3.3), (-3.3, 6.0))
    medium = LogDistanceParameters(exponent=3.0, reference_loss_db=55.0, shadowing_sd_db=4.0, noise_dbm=-105.0,
                                   hardware_covariance=covariance)  # fmt: skip
    read = read_gains(page.DATA / "15-15-medium-mica2-grid.txt")
    gains = np.full((225, 225), -np.inf)
    gains[read.source, read.destination] = read.gain_db
    theirs = _statistics(gains, np.array([read.noise[node][0] for node in range(225)]), positions_m)
    draws = []
    for seed in range(20):
        drawn = link_gains_db(positions_m, range(225), medium, Streams(seed))
        noise = -105.0 + hardware_offsets(range(225), covariance, Streams(seed)).noise_db
        draws.append(_statistics(drawn, noise, positions_m))
    ours = np.array(draws)
    names = ["path-loss exponent", "loss at 1 m (dB)", "deviation about the line (dB)", "difference of directions (dB)",
             "noise floor, mean (dBm)", "noise floor, sd (dB)"]  # fmt: skip
    given = ["3.0", "55.0", "4.69", "3.46", "-105", "1.92"]
    rows = [
        (name, value, f"{file:.2f}", f"{mean:.2f}", f"{sd:.2f}", f"{(file - mean) / (sd * 1.05**0.5):+.1f}")
        for name, value, file, mean, sd in zip(names, given, theirs, ours.mean(0), ours.std(0, ddof=1), strict=True)
    ]
    upper = np.triu_indices(225, 1)
    distance_m = np.hypot(*(positions_m[upper[0]] - positions_m[upper[1]]).T)
    figure, sides = page.axes(2, width=10.0, height=3.8)
    ours_db = link_gains_db(positions_m, range(225), medium, Streams(1))[upper]
    fine = np.array([10.0, 200.0])
    for axis, name, gain_db, colour in zip(
        sides, ("TOSSIM's file", "netsim, seed 1"), (gains[upper], ours_db), (page.GREY, page.BLUE), strict=True
    ):
        axis.semilogx(distance_m[::4], gain_db[::4], ".", ms=2, color=colour, alpha=0.5)
        axis.plot(fine, -55.0 - 30.0 * np.log10(fine), color=page.ORANGE, label="exponent 3, 55 dB at 1 m")
        axis.set(xlabel="distance (m)", ylabel="gain (dB)", ylim=(-140.0, -65.0))
        axis.set_title(f"{name}: links of 225 nodes")
        axis.legend()
    picture = page.save(figure, "usc", "Link gains over distance: the USC generator's file and netsim's generator")
    header = ["statistic", "parameters", "file", "netsim, mean of 20 seeds", "sd over seeds", "file's score"]
    return f"""\
### The USC link generator

TOSSIM's file of 225 nodes (15 x 15, 10 m apart, MICA2) beside netsim's generator with the parameters it was made with:
exponent 3.0, 55 dB at 1 m, shadowing 4 dB, hardware covariance [[3.7, -3.3], [-3.3, 6.0]], so that a sender's output power
adds 6 dB^2 to the deviation (sqrt(16 + 6) = 4.69) and sqrt(12) = 3.46 dB to the difference of directions.

{page.table(header, rows)}
The last column is the file's distance from netsim's mean in standard deviations of such a draw.

{picture}
Not shown: that a real field of MICA2 nodes looks so. The file was generated, not measured.
"""

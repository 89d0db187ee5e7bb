"""What was found, as tables for people and as a medium for a scenario."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from netsim import __version__
from netsim.calibrate.found import Calibration
from netsim.calibrate.loss import MOST_EXPONENT
from netsim.kernels.prr_fit import PrrFit

BY_CHANNEL = "By channel"


class Table(NamedTuple):
    """A table of text.

    Attributes:
        title: What it shows.
        header: Column names; empty for none.
        rows: Rows of as many cells.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables(found: Calibration) -> list[Table]:
    """Everything found, in the order in which one asks."""
    parts = [_log(found), _reception(found), _channels(found), _path_loss(found), _variation(found)]
    return [part for part in parts if part.rows]


def _log(found: Calibration) -> Table:
    log = found.log
    rows = [
        ("rows", f"{len(log.sent):,}, {'a frame each' if log.per_frame else 'a measurement each'} ({log.format})"),
        ("nodes", f"{len(log.names):,}"),
        ("links (ordered pairs)", f"{len(np.unique(log.link)):,}"),
        ("frames sent", f"{int(log.sent.sum()):,}"),
        ("frames received", f"{int(log.received.sum()):,} ({log.received.sum() / log.sent.sum():.1%})"),
    ]
    if (log.channel > 0).any():
        channels = np.unique(log.channel).tolist()
        rows.append(("channels", f"{channels[0]}" if len(channels) == 1 else f"{len(channels)} together"))
    return Table(f"{log.path.name}", (), tuple(rows))


def _reception(found: Calibration) -> Table:
    rows = [
        (
            fit.curve,
            with_error(fit.half_dbm, fit.half_se_db),
            with_error(fit.width_db, fit.width_se_db),
            with_error(fit.ceiling, fit.ceiling_se, 4),
            f"{fit.deviance:,.0f} / {fit.freedom:,}",
            f"{fit.dispersion:.3g}",
        )
        for fit in found.prr
    ]
    header = ("curve", "50 % at (dBm)", "10 to 90 % (dB)", "strong links", "deviance / freedom", "dispersion")
    return Table("Reception against received power (best curve first)", header, tuple(rows))


def _channels(found: Calibration) -> Table:
    rows = [
        (
            str(number),
            "-" if fit is None else with_error(fit.half_dbm, fit.half_se_db),
            "-" if fit is None else with_error(fit.width_db, fit.width_se_db),
            f"{found.strong_ratio[number]:.2%}" if number in found.strong_ratio else "-",
        )
        for number, fit in sorted(found.by_channel.items())
    ]
    return Table(BY_CHANNEL, ("channel", "50 % at (dBm)", "10 to 90 % (dB)", "strong links receive"), tuple(rows))


def _path_loss(found: Calibration) -> Table:
    loss = found.path_loss
    if loss is None:
        return Table("", (), ())
    fit, plain = loss.fit, loss.plain
    naive = ("-", "-", "-") if plain is None else (
        with_error(plain.exponent, plain.exponent_se),
        with_error(plain.reference_loss_db, plain.reference_loss_se_db),
        f"{plain.shadowing_sd_db:.2f}",
    )  # fmt: skip
    rows = [
        ("path-loss exponent", with_error(fit.exponent, fit.exponent_se), naive[0]),
        ("loss at 1 m (dB)", with_error(fit.reference_loss_db, fit.reference_loss_se_db), naive[1]),
        ("deviation of a link (dB)", with_error(fit.sd_db, fit.sd_se_db), naive[2]),
        ("shadowing of a pair (dB)", f"{loss.shadowing_sd_db:.2f}", ""),
        ("difference of directions (dB)", _asymmetry(found), ""),
        ("links seen / unseen", f"{fit.seen} / {'not listed' if fit.truncated else fit.unseen}", ""),
        ("R squared", "", "-" if plain is None else f"{plain.r_squared:.3f}"),
    ]
    return Table(
        "Path loss (standard errors in brackets)",
        ("", "unseen links considered", "least squares, seen links only"),
        tuple(rows),
    )


def _asymmetry(found: Calibration) -> str:
    loss = found.path_loss
    if loss is None or loss.asymmetry_sd_db is None:
        return "no pair seen both ways"
    return f"{with_error(loss.asymmetry_sd_db, loss.asymmetry_se_db)}, {loss.pairs} pairs"


def _variation(found: Calibration) -> Table:
    change = found.variation
    if change is None:
        return Table("", (), ())
    text = f"median {change.median_sd_db:.2f}, nine tenths below {change.ninetieth_sd_db:.2f}, {change.links:,} links"
    return Table("Change in time", (), ((f"sd between a link's {change.between} (dB)", text),))


def with_error(value: float, error: float, digits: int = 2) -> str:
    """A value with its standard error in brackets, both with as many digits as the error bears."""
    if error > 0.0 and math.isfinite(error):
        digits = max(digits, min(6, 1 - math.floor(math.log10(error))))
    return f"{value:.{digits}f} ({error:.{digits}f})"


def medium_yaml(found: Calibration, folder: Path | None = None) -> str:
    """A file with a `medium:` section, the goodness of fit in comments; a scenario takes it up with `extends:`.

    Args:
        found: What was found.
        folder: Where the file will lie, for the path of a log that is replayed; by default the path as it was given.
    """
    log = found.log
    head = [
        f"Fitted by netsim calibrate (netsim {__version__}) to {log.path.name}.",
        "Use it with `extends: THIS_FILE`.",
    ]
    for table in [part for part in tables(found) if part.title != BY_CHANNEL]:
        head += ["", table.title, *(f"  {'; '.join(cell for cell in row if cell)}" for row in _with_header(table))]
    head += ["", *found.notes]
    lines = [f"# {line}".rstrip() for text in head for line in _wrapped(text)]
    return "\n".join([*lines, "medium:", *_medium(found, folder)]) + "\n"


def _with_header(table: Table) -> Sequence[tuple[str, ...]]:
    if not table.header:
        return [tuple(f"{name}: {value}" for name, value in [row]) for row in table.rows if len(row) == 2]
    return [
        tuple(f"{name} {cell}".strip() for name, cell in zip(table.header, row, strict=True) if cell)
        for row in table.rows
    ]


def _wrapped(text: str, width: int = 110) -> Iterator[str]:
    indent = "  " if text.startswith("  ") else ""
    line = ""
    for word in text.split():
        if line and len(line) + len(word) + 1 > width:
            yield line
            line = f"{indent}  {word}"
        else:
            line = f"{line} {word}" if line else f"{indent}{word}"
    yield line


def _medium(found: Calibration, folder: Path | None) -> Iterator[str]:
    """The lines of the section."""
    if found.log.format == "k7" and found.path_loss is None:
        yield from _replay(found, folder)
        return
    yield "  type: log-distance"
    loss = found.path_loss
    if loss is not None and 0.0 < loss.fit.exponent <= MOST_EXPONENT:
        yield f"  exponent: {loss.fit.exponent:.3f}  # standard error {loss.fit.exponent_se:.3f}"
        yield f"  reference_loss_db: {loss.fit.reference_loss_db:.2f}  # standard error {loss.fit.reference_loss_se_db:.2f}"
        yield "  reference_distance_m: 1.0"
        yield f"  shadowing_sd_db: {loss.shadowing_sd_db:.2f}"
        if loss.asymmetry_sd_db is not None:
            yield f"  asymmetry_sd_db: {loss.asymmetry_sd_db:.2f}  # standard error {loss.asymmetry_se_db:.2f}"
    else:
        yield "  # exponent, reference_loss_db, shadowing_sd_db: not fitted, so netsim's defaults"
    if found.noise_dbm is not None:
        yield f"  noise_dbm: {found.noise_dbm:.2f}  # {_noise_comment(found, found.prr[0])}"


def _noise_comment(found: Calibration, fit: PrrFit) -> str:
    return (
        f"802.15.4 frames of {found.frame_byte} bytes then have their 50 % point at {fit.half_dbm:.2f} dBm; "
        f"standard error {found.noise_se_db:.2f}"
    )


def _replay(found: Calibration, folder: Path | None) -> Iterator[str]:
    """A K7 file without positions is replayed as it is."""
    log = found.log
    path = log.path if folder is None else _relative(log.path, folder)
    channels = np.unique(log.channel).tolist()
    yield "  type: trace"
    yield "  format: k7"
    yield f'  file: "{path.as_posix()}"'
    yield f"  channel: {channels[0]}" + ("  # of several: choose one with --channel" if len(channels) > 1 else "")
    if found.noise_dbm is not None:
        yield f"  noise_dbm: {found.noise_dbm:.2f}  # for interference only: {_noise_comment(found, found.prr[0])}"


def _relative(path: Path, folder: Path) -> Path:
    try:
        return path.resolve().relative_to(folder.resolve())
    except ValueError:
        return path.resolve()

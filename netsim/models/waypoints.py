"""Paths of mobile nodes: straight lines from waypoint to waypoint, from the scenario or from a CSV file."""

import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Literal

from netsim.errors import Finding, ScenarioError
from netsim.models.csv_rows import csv_rows, number
from netsim.parameters import Name, Positive, parameters
from netsim.units import NS_PER_S, s_to_ns

HEADER = ["node", "at_s", "x_m", "y_m"]


@parameters
class Waypoint:
    """A place to be at, at a time."""

    at_s: Positive
    """When, in simulated time."""
    x_m: float
    """Where."""
    y_m: float
    """Where."""


@parameters
class WaypointMobility:
    """Nodes that move: from where they are placed, in straight lines at even speed, from waypoint to waypoint.

    They stay at the last one. Positions and radio links change in steps of `update_s`. What a sensor measures and what the
    problem gives to know are those of the places at the start.
    """

    type: Literal["waypoints"] = "waypoints"
    points: tuple[Waypoint, ...] = ()
    """The way of the group's one node."""
    file: Name | None = None
    """Instead, a CSV file with the header `node,at_s,x_m,y_m` and the ways of any of the group's nodes, by id."""
    update_s: Positive = 0.5
    """Time between two positions."""

    def __post_init__(self) -> None:
        """Either points, in order, or a file."""
        if bool(self.points) == (self.file is not None):
            message = "either points or a file"
            raise ValueError(message)
        times_s = [point.at_s for point in self.points]
        if any(later <= earlier for earlier, later in pairwise(times_s)):
            message = "points in the order of their times"
            raise ValueError(message)


@dataclass(frozen=True, slots=True)
class Path:
    """The way of a node.

    Attributes:
        times_ns: When it is at each point, ascending; the first is 0.
        points_m: The points.
    """

    times_ns: tuple[int, ...]
    points_m: tuple[tuple[float, float], ...]

    @property
    def end_ns(self) -> int:
        """When it has arrived at the last point."""
        return self.times_ns[-1]

    def at(self, time_ns: int) -> tuple[float, float]:
        """Where the node is at a time from 0."""
        return self.points_m[-1] if time_ns >= self.end_ns else along(self.times_ns, self.points_m, time_ns)


def along(times_ns: Sequence[int], points_m: Sequence[tuple[float, float]], time_ns: int) -> tuple[float, float]:
    """Where a point is that goes in straight lines at even speed.

    Args:
        times_ns: When it is at each place, ascending.
        points_m: The places.
        time_ns: From the first time to the last.
    """
    leg = min(bisect_right(times_ns, time_ns), len(times_ns) - 1)
    begin_ns, end_ns = times_ns[leg - 1], times_ns[leg]
    (x_m, y_m), (to_x_m, to_y_m) = points_m[leg - 1], points_m[leg]
    share = (time_ns - begin_ns) / (end_ns - begin_ns)
    return x_m + share * (to_x_m - x_m), y_m + share * (to_y_m - y_m)


def path_through(start_m: tuple[float, float], points: Sequence[Waypoint]) -> Path:
    """The way from a place at time 0 through waypoints."""
    times_ns = (0, *(s_to_ns(point.at_s) for point in points))
    return Path(times_ns, (start_m, *((point.x_m, point.y_m) for point in points)))


def read_waypoints(path: FilePath) -> dict[int, tuple[Waypoint, ...]]:
    """The ways in a CSV file, by node.

    Args:
        path: The file, in UTF-8, with the header `node,at_s,x_m,y_m`. Empty lines are skipped; the rows of a node stand
            in the order of their times, those of different nodes as they like.

    Raises:
        ScenarioError: If there is no such file, or with every wrong line: a wrong header, a wrong number of columns, a node
            that is no whole number, a time that is not above the one before, a number that is not finite.
    """
    rows = csv_rows(path, "waypoints")
    findings = list(_findings(str(path), rows))
    if findings:
        raise ScenarioError(findings)
    ways: defaultdict[int, list[Waypoint]] = defaultdict(list)
    for _, (node, at_s, x_m, y_m) in rows[1:]:
        ways[int(node)].append(Waypoint(at_s=float(at_s), x_m=float(x_m), y_m=float(y_m)))
    return {node: tuple(points) for node, points in ways.items()}


def _findings(file: str, rows: Sequence[tuple[int, list[str]]]) -> Iterator[Finding]:
    if not rows or rows[0][1] != HEADER:
        line, header = rows[0] if rows else (1, [])
        yield Finding(file, line, "", f"the header `{','.join(HEADER)}`", f"`{','.join(header)}`")
        return
    last_ns: dict[str, int] = {}
    for line, row in rows[1:]:
        if len(row) != len(HEADER):
            yield Finding(file, line, "", f"{len(HEADER)} columns", f"{len(row)}")
            continue
        yield from _row_findings(file, line, row, last_ns)


def _row_findings(file: str, line: int, row: Sequence[str], last_ns: dict[str, int]) -> Iterator[Finding]:
    node, *texts = row
    if not (node.isascii() and node.isdigit()):
        yield Finding(file, line, "node", "the id of a node", f"`{node}`")
    at_s, x_m, y_m = (number(text) for text in texts)
    for column, text, value in (("x_m", texts[1], x_m), ("y_m", texts[2], y_m)):
        if not math.isfinite(value):
            yield Finding(file, line, column, "a number of metres", f"`{text}`")
    earlier_ns = last_ns.get(node, 0)
    if not math.isfinite(at_s) or s_to_ns(at_s) <= earlier_ns:
        yield Finding(
            file, line, "at_s", f"a time above {earlier_ns / NS_PER_S:g} s", f"`{texts[0]}`", "order the rows of a node"
        )
    else:
        last_ns[node] = s_to_ns(at_s)

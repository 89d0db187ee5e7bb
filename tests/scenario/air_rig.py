"""The air of small scenarios."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from netsim.rng import Streams
from netsim.scenario.links import Air, air_between
from netsim.scenario.load import LoadedScenario, load
from netsim.scenario.places import Place, places

SCENARIO = """\
kind: scenario
schema_version: 1
name: small
duration_s: 5
field: {{width_m: 200, height_m: 200}}
nodes:
  - name: sensors
    placement: {placement}
    tx_power_dbm: {power}
    {more}
medium: {medium}
mac: {{type: ideal}}
algorithm: {{type: neighbour-traffic}}
"""
GRID = "{type: grid, rows: 4, columns: 4, spacing_m: 12}"


def scenario(folder: Path, medium: str, placement: str = GRID, power: float = 0.0, more: str = "") -> LoadedScenario:
    """A loaded scenario; the line of `medium` is 11, of `tx_power_dbm` 9."""
    path = folder / "small.yaml"
    path.write_text(SCENARIO.format(medium=medium, placement=placement, power=power, more=more))
    return load(path)


def nodes_of(loaded: LoadedScenario, moved: Mapping[int, tuple[float, float]] | None = None) -> list[Place]:
    """The scenario's nodes, some of them elsewhere."""
    moved = moved or {}
    found = places(loaded, Streams(loaded.scenario.seed))
    return [
        replace(place, x_m=moved[place.id][0], y_m=moved[place.id][1]) if place.id in moved else place
        for place in found
    ]


def air_of(loaded: LoadedScenario, moved: Mapping[int, tuple[float, float]] | None = None) -> Air:
    """The air between the scenario's nodes."""
    return air_between(nodes_of(loaded, moved), loaded, Streams(loaded.scenario.seed))

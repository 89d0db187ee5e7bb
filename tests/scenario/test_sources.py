"""Nothing that a scenario can name is without a source, and a scenario's sources are those of what it uses."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest

from netsim.algorithms.registry import SHIPPED
from netsim.models.device_tables import load_radio, shipped
from netsim.models.media import Reception
from netsim.models.radio_tables import ModulationTable
from netsim.models.track_files import TrackPoint
from netsim.models.waypoints import Waypoint
from netsim.reading.shapes import ListShape, MapShape, RecordShape, TaggedShape, TupleShape, record_fields, shape_of
from netsim.scenario.citations import CITED, RECEPTION
from netsim.scenario.load import load
from netsim.scenario.schema import FieldParameters, NodeGroup, Scenario, TraceParameters
from netsim.scenario.sources import Source, everything, sources_of

STRUCTURE = {Scenario, NodeGroup, FieldParameters, TraceParameters, TrackPoint, Waypoint}
"""Records that hold others or plain facts of the scenario: there is no model behind them."""


def records_below(hint: Any, seen: set[type[Any]]) -> Iterator[type[Any]]:
    """Every record type that may stand in a file at a place, and in the records there."""
    shape = shape_of(hint)
    inner: list[Any] = []
    if isinstance(shape.mapping, RecordShape | TaggedShape):
        single = isinstance(shape.mapping, RecordShape)
        for cls in [shape.mapping.cls] if single else shape.mapping.members.values():
            if cls not in seen:
                seen.add(cls)
                yield cls
                inner += [field.hint for field in record_fields(cls).values()]
    if isinstance(shape.mapping, MapShape):
        inner.append(shape.mapping.value)
    if isinstance(shape.sequence, ListShape):
        inner.append(shape.sequence.item)
    if isinstance(shape.sequence, TupleShape):
        inner += shape.sequence.items
    for each in inner:
        yield from records_below(each, seen)


def by_part(found: list[Source]) -> dict[str, set[str]]:
    names: dict[str, set[str]] = {}
    for source in found:
        names.setdefault(source.part, set()).add(source.name)
    return names


def cited_in(found: list[Source], part: str) -> str:
    return "; ".join(source.citation for source in found if source.part == part)


def test_every_record_that_a_scenario_can_name_has_a_source():
    known = set(records_below(Scenario, set()))
    assert len(known) > 50
    assert known - STRUCTURE - set(CITED) == set()


def test_what_is_cited_can_be_named_by_a_scenario_or_chosen_by_a_device():
    known = set(records_below(Scenario, set()))
    models = {type(load_radio(name, Path()).modulation) for name in shipped("radios")}
    amplifiers = {type(load_radio(name, Path()).amplifier) for name in shipped("radios")}
    fit = {cls for cls in CITED if cls.__name__ == "Cc2420Fit"}  # of a table of one's own
    assert set(CITED) - known - models - amplifiers - fit == set()


def test_every_modulation_of_the_tables_is_cited():
    tags = {record_fields(cls)["type"].hint for cls in get_args(ModulationTable)}
    names = {get_args(tag)[0] for tag in tags} | {"lora"}
    assert by_part(everything()["modulation"])["modulation"] == names


def test_every_way_of_reception_is_cited():
    assert set(RECEPTION) == set(get_args(Reception))


def test_everything_has_one_name_a_summary_and_a_citation():
    for part, sources in everything().items():
        assert len({source.name for source in sources}) == len(sources), part
        for source in sources:
            assert source.part == part
            assert source.name
            assert len(source.summary) > 2, source
            assert "\n" not in source.summary
            assert source.citation, source


def test_everything_names_all_algorithms_and_device_tables():
    found = everything()
    assert {source.name for source in found["algorithm"]} == set(SHIPPED)
    assert {source.name for source in found["radio"]} == set(shipped("radios"))
    assert {source.name for source in found["processor"]} == set(shipped("cpus"))
    assert {source.name for source in found["battery table"]} == set(shipped("batteries"))


def test_the_sources_of_the_association_scenario(scenarios: Path):
    found = sources_of(load(scenarios / "chen2006" / "association-csmp.yaml"))
    names = by_part(found)
    assert names["algorithm"] == {"csmp"}
    assert names["problem"] == {"association"}
    assert names["medium"] == {"log-distance"}
    assert names["shadowing"] == {"static"}
    assert names["reception"] == {"sinr"}
    assert names["MAC"] == {"csma"}
    assert names["radio"] == {"cc2420"}
    assert names["modulation"] == {"o-qpsk"}
    assert names["processor"] == {"cortex_m4"}
    assert not {"fading", "clock", "fault", "harvester", "hardware variation", "LoRa airtime"} & set(names)
    assert "43 (2006)" in cited_in(found, "algorithm")
    assert "section 5" in cited_in(found, "algorithm")
    assert "7.5.1.4" in cited_in(found, "MAC")
    assert "SWRS041" in cited_in(found, "radio")
    assert len(set(found)) == len(found)


@pytest.mark.parametrize(
    ("override", "part", "name"),
    [
        ("medium.fading={type: rician}", "fading", "rician"),
        ("medium.noise={type: gaussian}", "noise", "gaussian"),
        ("medium.hardware_covariance=[[3.7, -3.3], [-3.3, 6.0]]", "hardware variation", "covariance"),
        ("medium.asymmetry_sd_db=1", "shadowing", "asymmetry"),
        ("mac={type: lpl}", "MAC", "lpl"),
        ("fidelity=lpl", "MAC", "lpl"),
        ("fidelity=prr", "reception", "prr"),
        ("network.discovery={type: beacons}", "neighbours", "beacons"),
        ("time_sync={type: ftsp}", "time synchronisation", "ftsp"),
        ("nodes.0.clock={}", "clock", "crystal"),
        ("nodes.0.battery={type: device, device: itsy_rv}", "battery", "rakhmatov-vrudhula"),
        ("nodes.0.harvester={type: day, peak_mw: 3}", "harvester", "day"),
        ("faults=[{type: gilbert-elliott, mean_good_s: 10, mean_bad_s: 1}]", "fault", "gilbert-elliott"),
    ],
)
def test_what_a_setting_switches_on_is_cited(scenarios: Path, override: str, part: str, name: str):
    path = scenarios / "chen2006" / "association-csmp.yaml"
    assert name not in by_part(sources_of(load(path))).get(part, set())
    assert name in by_part(sources_of(load(path, [override])))[part]


def test_an_ideal_medium_needs_no_modulation_and_no_reception(scenarios: Path):
    overrides = ["medium={type: ideal}", "mac={type: ideal}"]
    names = by_part(sources_of(load(scenarios / "chen2006" / "association-csmp.yaml", overrides)))
    assert names["medium"] == {"ideal"}
    assert not {"modulation", "reception", "shadowing"} & set(names)


def test_a_lora_radio_brings_its_airtime_and_capture_even_with_default_settings(scenarios: Path):
    overrides = ["nodes.0.radio=sx1276", "nodes.0.tx_power_dbm=14", "medium.noise_dbm=-117.03", "mac={type: aloha}"]
    found = sources_of(load(scenarios / "chen2006" / "association-csmp.yaml", overrides))
    assert "AN1200.13" in cited_in(found, "LoRa airtime")
    assert by_part(found)["modulation"] == {"lora"}


def test_an_algorithm_that_no_node_runs_is_left_out(scenarios: Path):
    override = "nodes.0.algorithm={type: neighbour-traffic}"
    names = by_part(sources_of(load(scenarios / "chen2006" / "association-csmp.yaml", [override])))
    assert names["algorithm"] == {"neighbour-traffic"}


def test_ones_own_algorithm_says_that_its_source_is_not_known(tmp_path: Path, scenarios: Path):
    (tmp_path / "cited_mine.py").write_text(
        'class Quiet:\n    """Says nothing."""\n\n    def run(self, node):\n        yield from ()\n'
    )
    text = (scenarios / "chen2006" / "association-csmp.yaml").read_text()
    (tmp_path / "mine.yaml").write_text(text[: text.index("\nalgorithm:")] + "\nalgorithm: {type: cited_mine:Quiet}\n")
    found = sources_of(load(tmp_path / "mine.yaml"))
    assert found[0] == Source("algorithm", "cited_mine:Quiet", "Says nothing.", "not said by cited_mine:Quiet")

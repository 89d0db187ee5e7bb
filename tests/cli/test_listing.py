"""`netsim list`: nothing is left out, everything has its source, and it reads well in a terminal."""

from pathlib import Path
from typing import get_args

import pytest
from rich.cells import cell_len

from netsim.algorithms.registry import SHIPPED
from netsim.cli import listing
from netsim.cli.console import WIDTH_ELSEWHERE
from netsim.cli.listing import PARTS, list_command
from netsim.cli.sections import Section
from netsim.metrics.catalogue import CATALOGUE
from netsim.scenario.sources import everything

SECTIONS = get_args(Section)


def printed(capsys: pytest.CaptureFixture[str], section: Section | None, *, metrics: bool = False) -> str:
    list_command(section, metrics=metrics)
    return capsys.readouterr().out


def unwrapped(text: str) -> str:
    return " ".join(text.split())


def first_words(text: str) -> set[str]:
    return {line.split()[0] for line in text.splitlines() if line.split()}


def test_every_part_stands_in_one_section_and_devices_in_one_of_their_own_besides():
    own = ("radios", "processors")
    listed = [part for section, (_, parts) in PARTS.items() for part in parts if section not in own]
    assert sorted(listed) == sorted(everything())
    assert {part for section in own for part in PARTS[section][1]} <= set(PARTS["devices"][1])


@pytest.mark.parametrize("section", list(PARTS))
def test_a_section_names_all_its_parts_and_models(capsys: pytest.CaptureFixture[str], section: Section):
    words = first_words(printed(capsys, section))
    for part in PARTS[section][1]:
        assert {source.name for source in everything()[part]} <= words


@pytest.mark.parametrize("section", [*SECTIONS, None])
def test_no_line_is_wider_than_the_page(capsys: pytest.CaptureFixture[str], section: Section | None):
    assert max(map(cell_len, printed(capsys, section).splitlines()), default=0) <= WIDTH_ELSEWHERE


def test_algorithms_stand_with_their_paper_and_nothing_else_does(capsys: pytest.CaptureFixture[str]):
    text = printed(capsys, "algorithms")
    assert set(SHIPPED) <= first_words(text)
    assert "Mathematical and Computer Modelling" in unwrapped(text)
    assert "lpl" not in first_words(text)


def test_the_overview_has_the_main_parts_and_says_where_the_rest_is(capsys: pytest.CaptureFixture[str]):
    text = printed(capsys, None)
    assert {"csmp", "association", "log-distance", "csma", "collection", "peukert", "cc2420", "aa_pair", "crash"} <= (
        first_words(text)
    )
    assert any(line.endswith("quickstart.yaml") for line in text.splitlines())
    assert "rayleigh" not in first_words(text)
    assert "netsim list media adds reception, modulation, shadowing, hardware variation, fading, noise" in text


def test_the_metrics_stand_with_unit_and_definition(capsys: pytest.CaptureFixture[str]):
    text = printed(capsys, "metrics")
    assert set(CATALOGUE) <= first_words(text)
    assert {metric.group.capitalize() for metric in CATALOGUE.values()} <= set(map(str.strip, text.splitlines()))
    assert text == printed(capsys, None, metrics=True)


def test_studies_stand_with_their_question(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / "bits.yaml").write_text(
        "kind: study\nname: bits\nquestion: >\n  How many bits\n  suffice?\n"
    )
    (tmp_path / "one.yaml").write_text("kind: scenario\nname: one\ndescription: Shows one.\n")
    (tmp_path / "broken.yaml").write_text("kind: [")
    monkeypatch.setattr(listing, "scenario_folder", lambda: tmp_path)
    assert printed(capsys, "studies").splitlines() == [
        "Studies: netsim study FILE",
        "",
        f" {tmp_path / 'studies' / 'bits.yaml'}",
        "     How many bits suffice?",
        "",
    ]
    assert "Shows one." in printed(capsys, "scenarios")
    assert "bits" not in printed(capsys, "scenarios")

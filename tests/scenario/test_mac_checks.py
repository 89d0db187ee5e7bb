"""Every MAC from a scenario file, and what is refused before anything runs."""

from pathlib import Path

import pytest

from netsim.errors import ScenarioError
from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.scenario.run import run

TEXT = """\
kind: scenario
schema_version: 1
name: macs
duration_s: 20
nodes:
  - name: n
    placement: {{type: grid, rows: 1, columns: 3, spacing_m: 10}}
medium: {medium}
mac: {mac}
algorithm: {{type: neighbour-traffic, rounds: 2, period_s: 2, payload_byte: 200}}
"""
AIR = "{type: log-distance, shadowing_sd_db: 0}"
IDEAL = "{type: ideal}"
RETRYING = ("csma", "aloha, acknowledge: true", "tdma", "lpl", "lpl, variant: b-mac")


def scenario(folder: Path, mac: str, medium: str = AIR) -> Path:
    path = folder / "macs.yaml"
    path.write_text(TEXT.format(mac=f"{{type: {mac}}}", medium=medium), encoding="utf-8")
    return path


@pytest.mark.parametrize("medium", [AIR, IDEAL])
@pytest.mark.parametrize("mac", ["ideal", "aloha", *RETRYING])
def test_each_mac_runs_over_each_medium_or_is_refused(tmp_path: Path, mac: str, medium: str) -> None:
    if mac.startswith("lpl") and medium == IDEAL:
        with pytest.raises(ScenarioError, match="a medium on which a channel can be sensed"):
            build(load(scenario(tmp_path, mac, medium)))
        return
    figures = run(load(scenario(tmp_path, mac, medium))).metrics
    assert figures["radio_messages"] == 12
    if mac in RETRYING or medium == IDEAL:
        assert figures["delivery_ratio_unicast"] == 1.0
    assert (figures["frames_strobe"] > 0) is mac.startswith("lpl")
    assert ("radio.strobe_transmit" in figures["energy_by_state_j"]) is mac.startswith("lpl")


def test_sleepers_draw_less_than_listeners(tmp_path: Path) -> None:
    energy_j = {mac: run(load(scenario(tmp_path, mac))).metrics["energy_j"] for mac in ("csma", "tdma", "lpl")}
    assert energy_j["lpl"] < energy_j["tdma"] < energy_j["csma"] / 2


REFUSED = {
    "slot too short": ("tdma, slot_ms: 5", AIR, "mac.slot_ms: expected at least 6.992 ms", "got 5"),
    "slot too short for the delay": (
        "tdma, slot_ms: 7",
        "{type: ideal, delay_s: 1e-4}",
        "mac.slot_ms: expected at least 7.192 ms",
        "got 7",
    ),
    "too few slots": ("tdma, frame_slots: 2", AIR, "mac.frame_slots", "at least 3 slots"),
    "acknowledgement never in time": ("csma, ack_wait_symbols: 33", AIR, "mac.ack_wait_symbols", "at least 34 symbols"),
    "acknowledgement delayed": ("tdma", "{type: ideal, delay_s: 1e-3}", "medium.delay_s", "at most 0.00015 s"),
    "aloha delayed": ("aloha, acknowledge: true", "{type: ideal, delay_s: 1e-3}", "medium.delay_s", "0.00015"),
    "nothing to sense": (
        "lpl",
        "{type: log-distance, reception: prr}",
        "mac.type",
        "on log-distance with reception prr",
    ),
    "one sample misses strobes": ("lpl, samples: 2", AIR, "mac.samples", "more than 1.056 ms"),
    "samples far apart": ("lpl, sample_spacing_ms: 1", AIR, "mac.sample_spacing_ms", "less than 0.544 ms"),
    "samples overlap": ("lpl, samples: 20, sample_spacing_ms: 0.1", AIR, "mac.sample_spacing_ms", "sample_ms"),
    "no time to answer": ("lpl, gap_ms: 0.5", AIR, "mac.gap_ms", "at least 0.544 ms"),
    "sleeps before a strobe is over": ("lpl, listen_ms: 2", AIR, "mac.listen_ms", "at least 2.144 ms"),
    "preamble frames too long": ("lpl, variant: b-mac, listen_ms: 8", AIR, "mac.listen_ms", "at least 8.512 ms"),
    "no rest between checks": ("lpl, wake_interval_ms: 1.5", AIR, "mac.wake_interval_ms", "more than 2.18 ms"),
    "strobe without a header": ("lpl, strobe_byte: 5", AIR, "mac.strobe_byte", "11 to 127 bytes"),
    "duty cycle of nothing": ("aloha, duty_cycle: 0", AIR, "mac.duty_cycle", "got 0"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_work_is_refused_with_its_place(tmp_path: Path, case: str) -> None:
    mac, medium, place, expected = REFUSED[case]
    with pytest.raises(ScenarioError) as refused:
        build(load(scenario(tmp_path, mac, medium)))
    text = str(refused.value)
    assert "macs.yaml:" in text
    assert place in text
    assert expected in text


def test_aloha_may_be_as_late_as_it_likes_without_acknowledgements(tmp_path: Path) -> None:
    build(load(scenario(tmp_path, "aloha", "{type: ideal, delay_s: 1.0}")))


@pytest.mark.parametrize(("offset_sd_s", "all_arrive"), [(2e-4, True), (0.05, False)])
def test_slots_follow_the_clocks_of_the_nodes(tmp_path: Path, offset_sd_s: float, all_arrive: bool) -> None:
    """A guard time of 1 ms bears offsets of 0.2 ms; with those of 50 ms, five slots, neighbours sleep when one sends."""
    path = scenario(tmp_path, "tdma, max_retries: 0")
    clock = f"    clock: {{drift_sd_ppm: 0, offset_sd_s: {offset_sd_s}}}\n"
    path.write_text(path.read_text().replace("medium:", clock + "medium:"), encoding="utf-8")
    assert (run(load(path)).metrics["delivery_ratio_unicast"] == 1.0) is all_arrive

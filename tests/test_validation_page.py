"""docs/validation.md is whole, and the stored figures of ns-3 that it compares with agree with netsim's formulas."""

import json
import re
from pathlib import Path

import pytest

from netsim.models.reception import frame_success_probability, oqpsk_bit_error_rate

ROOT = Path(__file__).parents[1]
NS3 = json.loads((ROOT / "tools" / "ns3_reference.json").read_text(encoding="utf-8"))
PER_BITS = 8 * 51


def test_every_picture_of_the_page_is_there_and_every_picture_is_shown() -> None:
    text = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"\]\((validation/[^)]+)\)", text))
    assert shown == {f"validation/{path.name}" for path in (ROOT / "docs" / "validation").glob("*.png")}
    sections = re.findall(r"<!-- (\w+) -->", text)
    assert sections == ["reception", "csma", "energy", "battery", "measured", "limits"]


@pytest.mark.parametrize("snr_db", ["2", "-1", "-4", "-7"])
def test_bit_error_rates_are_those_of_ns3(snr_db: str) -> None:
    ours = oqpsk_bit_error_rate(10.0 ** (float(snr_db) / 10.0))
    assert ours == pytest.approx(NS3["bit_error_rate"][snr_db], rel=1e-9)


def test_at_5_db_ns3_holds_three_digits() -> None:
    """Its figure is 1 less a number that differs from 1 in the fourteenth place."""
    assert oqpsk_bit_error_rate(10.0**0.5) == pytest.approx(NS3["bit_error_rate"]["5"], abs=1.2e-16)


def test_packet_error_rates_are_those_of_ns3() -> None:
    assert len(NS3["packet_error_rate"]) == 20
    for snr_db, rate in NS3["packet_error_rate"].items():
        ours = 1.0 - frame_success_probability(10.0 ** (float(snr_db) / 10.0), PER_BITS)
        assert ours == pytest.approx(rate, abs=1e-12)

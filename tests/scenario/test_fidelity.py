"""The ladder of fidelity: each rung is an ordinary scenario, and brings one thing that the rung below has not."""

from collections import Counter
from dataclasses import replace

import pytest

from netsim.errors import ScenarioError
from netsim.scenario.fidelity import RUNGS, climb
from netsim.scenario.load import load
from netsim.scenario.run import run
from netsim.trace.events import OUTCOMES, EnergyLedger, Frame, MessageDelivered, MessageSent

SCENARIO = """
kind: scenario
schema_version: 1
name: ladder
duration_s: 14
field: {width_m: 80, height_m: 80}
nodes:
  - {name: sensors, placement: {type: grid, rows: 4, columns: 4, spacing_m: 15, origin_m: [5, 5]}}
medium: {type: log-distance, exponent: 4.5}
mac: MAC
algorithm: {type: neighbour-traffic, period_s: 0.4, rounds: 6, payload_byte: 90, neighbours: 3}
"""
ORDER = ("ideal", "prr", "sinr", "csma", "lpl")


class Tally:
    """What became of frames, and of messages."""

    def __init__(self):
        self.outcomes, self.sent, self.delivered, self.acks, self.strobes, self.asleep_s = Counter(), 0, 0, 0, 0, 0.0

    @property
    def delivery_ratio(self):
        return self.delivered / self.sent

    def handlers(self):
        return {
            Frame: self._on_frame,
            MessageSent: self._on_sent,
            MessageDelivered: self._on_delivery,
            EnergyLedger: self._on_ledger,
        }

    def _on_frame(self, frame, _):
        self.outcomes.update(OUTCOMES[code] for code in frame.rx_outcome)
        self.acks += frame.is_ack
        self.strobes += frame.is_strobe

    def _on_sent(self, event, _):
        self.sent += 1

    def _on_delivery(self, event, _):
        self.delivered += 1

    def _on_ledger(self, event, _):
        rows = zip(event.device, event.state, event.time_s, strict=True)
        self.asleep_s = sum(time_s for device, state, time_s in rows if (device, state) == ("radio", "sleep"))


def loaded_on(tmp_path, rung, mac="{type: csma}", overrides=()):
    path = tmp_path / "ladder.yaml"
    path.write_text(SCENARIO.replace("MAC", mac), encoding="utf-8")
    return load(path, [*overrides, *([f"fidelity={rung}"] if rung else [])])


@pytest.fixture(scope="module")
def tallies(tmp_path_factory):
    found = {}
    for rung in ORDER:
        tally = Tally()
        run(loaded_on(tmp_path_factory.mktemp(rung), rung), observers=[tally])
        found[rung] = tally
    return found


def test_the_ladder_has_the_rungs_in_order():
    assert tuple(RUNGS) == ORDER


def test_ideal_links_lose_nothing(tallies):
    assert set(tallies["ideal"].outcomes) == {"received", "overheard"}
    assert tallies["ideal"].delivery_ratio == 1.0


def test_with_reception_ratios_links_lose_frames_and_nothing_else_happens(tallies):
    assert set(tallies["prr"].outcomes) == {"received", "overheard", "lost"}
    assert tallies["prr"].delivery_ratio < 1.0


def test_with_interference_frames_meet(tallies):
    outcomes = tallies["sinr"].outcomes
    assert "lost" not in outcomes
    assert {"busy", "collided"} & set(outcomes)
    assert tallies["sinr"].acks == 0


def test_with_csma_frames_are_acknowledged_and_more_arrives_than_without(tallies):
    assert tallies["csma"].acks > 0
    assert tallies["csma"].strobes == 0
    assert tallies["csma"].delivery_ratio > tallies["sinr"].delivery_ratio


def test_with_low_power_listening_receivers_are_mostly_off(tallies):
    assert tallies["lpl"].strobes > 0
    assert tallies["lpl"].asleep_s > 0.5 * 16 * 10
    assert all(tallies[rung].asleep_s < tallies["lpl"].asleep_s / 10 for rung in ORDER[:3])


@pytest.mark.parametrize("rung", ORDER)
def test_climbing_twice_is_climbing_once(tmp_path, rung):
    scenario = loaded_on(tmp_path, rung).scenario
    assert climb(scenario) == scenario


def test_a_mac_of_the_rungs_own_type_keeps_its_settings(tmp_path):
    assert loaded_on(tmp_path, "csma", "{type: csma, max_retries: 7}").scenario.mac.max_retries == 7
    assert loaded_on(tmp_path, "csma", "{type: aloha}").scenario.mac.type == "csma"


@pytest.mark.parametrize("rung", ["sinr", "csma", "lpl"])
def test_a_medium_without_propagation_cannot_climb(tmp_path, rung):
    with pytest.raises(ScenarioError, match=rf"fidelity: expected .* got {rung}; set a medium"):
        loaded_on(tmp_path, rung, overrides=["medium={type: ideal}"])


def test_the_lowest_rungs_take_the_ideal_medium_too(tmp_path):
    lossy = ["medium={type: ideal, loss_probability: 0.2}"]
    assert loaded_on(tmp_path, "ideal", overrides=lossy).scenario.medium.loss_probability == 0.0
    assert loaded_on(tmp_path, "prr", overrides=lossy).scenario.medium.loss_probability == 0.2


def test_without_the_key_nothing_changes(tmp_path):
    scenario = loaded_on(tmp_path, None).scenario
    assert climb(scenario) is scenario
    assert replace(scenario, fidelity="csma").medium == scenario.medium

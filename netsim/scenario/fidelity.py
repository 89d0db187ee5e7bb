"""The ladder: one key takes a scenario from lossless links to radios that sleep, one step of realism at a time.

A rung sets `medium.reception` and the type of `mac`; everything else stays as the scenario says, and so do the positions,
the links' gains and all random streams. The result of climbing is an ordinary scenario.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from netsim.errors import Finding
from netsim.models.media import IdealMediumParameters, Reception
from netsim.reading import Document
from netsim.scenario.schema import Fidelity, Scenario
from netsim.sim.mac.csma import CsmaParameters
from netsim.sim.mac.ideal import IdealMacParameters
from netsim.sim.mac.lpl_timing import LplParameters

RUNGS: Final[Mapping[Fidelity, tuple[Reception, type[Any]]]] = {
    "ideal": ("perfect", IdealMacParameters),
    "prr": ("prr", IdealMacParameters),
    "sinr": ("sinr", IdealMacParameters),
    "csma": ("sinr", CsmaParameters),
    "lpl": ("sinr", LplParameters),
}
"""For each rung, how frames are received and which MAC sends them."""

NEEDS_PROPAGATION: Final = ("sinr", "csma", "lpl")


def climb(scenario: Scenario) -> Scenario:
    """The scenario with its rung's medium and MAC put in; a MAC of the rung's own type keeps its settings."""
    if scenario.fidelity is None:
        return scenario
    reception, mac = RUNGS[scenario.fidelity]
    medium = scenario.medium
    if isinstance(medium, IdealMediumParameters):
        medium = replace(medium, loss_probability=0.0) if scenario.fidelity == "ideal" else medium
    else:
        medium = replace(medium, reception=reception)
    return replace(scenario, medium=medium, mac=scenario.mac if isinstance(scenario.mac, mac) else mac())


def fidelity_findings(scenario: Scenario, document: Document) -> Iterator[Finding]:
    """A medium without physics has nothing that could interfere."""
    if scenario.fidelity in NEEDS_PROPAGATION and isinstance(scenario.medium, IdealMediumParameters):
        yield document.finding(
            ("fidelity",),
            "`ideal` or `prr` with the medium `ideal`, which has no signals that could interfere",
            scenario.fidelity,
            "set a medium with propagation, such as `medium: {type: log-distance}`",
        )

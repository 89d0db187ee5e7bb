"""Settings that do nothing beside other ones, in words: a line each, with the remedy."""

from collections.abc import Iterator
from typing import Any

from netsim.algorithms.message_passing_parameters import CommunicationSensitiveParameters, MessagePassingParameters
from netsim.problems.association import AssociationParameters
from netsim.scenario.load import LoadedScenario
from netsim.scenario.schema import MacParameters, NodeGroup, Scenario
from netsim.sim.mac.lpl_timing import LplParameters
from netsim.sim.mac.tdma import TdmaParameters

MEASURED_BY = {
    "measurement_variance_ratio": ("position",),
    "range_sd_m": ("range_bearing", "range"),
    "bearing_sd_rad": ("range_bearing", "bearing"),
}
"""Noises of the association problem, and the measurements that have them."""


def setting_warnings(loaded: LoadedScenario) -> Iterator[str]:
    """What a scenario sets in vain, each once."""
    scenario = loaded.scenario
    if isinstance(scenario.problem, AssociationParameters):
        yield from _noises(scenario.problem)
    everybody = scenario.nodes
    yield from _algorithm(scenario, scenario.algorithm, "algorithm", everybody)
    for index, group in enumerate(everybody):
        yield from _algorithm(scenario, group.algorithm, f"nodes[{index}].algorithm", (group,))


def _is_set(record: Any, name: str) -> bool:
    """Whether a setting is other than by default."""
    return bool(getattr(record, name) != type(record).__dataclass_fields__[name].default)


def _noises(problem: AssociationParameters) -> Iterator[str]:
    for name, measures in MEASURED_BY.items():
        if _is_set(problem, name) and problem.measures not in measures:
            yield (
                f"problem.{name}: does nothing with measures: {problem.measures}; leave it out, or set measures: "
                f"{' or '.join(measures)}"
            )


def _algorithm(scenario: Scenario, record: Any, path: str, groups: tuple[NodeGroup, ...]) -> Iterator[str]:
    if isinstance(record, MessagePassingParameters):
        yield from _without_partner(record, path)
        yield from _rehosting(record, path, scenario.mac)
        yield from _sleep(record, path, scenario.mac, groups)
    if isinstance(record, CommunicationSensitiveParameters):
        yield from _tolerance(record, path, groups)


def _without_partner(record: MessagePassingParameters, path: str) -> Iterator[str]:
    """Settings of a rule that is not chosen."""
    sleeps, quiet = record.sleep != "never", record.sleep == "when_quiet"
    for name, holds, rule in (
        ("asks", record.silence == "notice", "silence: notice"),
        ("suspect_after", record.rehost, "rehost: true"),
        ("window_margin_s", sleeps, "sleep: scheduled or when_quiet"),
        ("guard_s", sleeps, "sleep: scheduled or when_quiet"),
        ("quiet_rounds", quiet, "sleep: when_quiet"),
        ("common_every", quiet, "sleep: when_quiet"),
    ):
        if _is_set(record, name) and not holds:
            yield f"{path}.{name}: does nothing without {rule}; set that, or leave {name} out"


def _rehosting(record: MessagePassingParameters, path: str, mac: MacParameters) -> Iterator[str]:
    """A death shows by what is missing: acknowledgements or notices."""
    if record.rehost and record.silence != "notice" and not getattr(mac, "acknowledge", False):
        yield (
            f"{path}.rehost: nobody can notice a death: mac {mac.type} acknowledges nothing and silence: {record.silence} "
            "gives no notice; set silence: notice, or a mac that acknowledges"
        )


def _sleep(
    record: MessagePassingParameters, path: str, mac: MacParameters, groups: tuple[NodeGroup, ...]
) -> Iterator[str]:
    """Two schedules for one radio."""
    if record.sleep == "never":
        return
    cycled = [group.name for group in groups if group.duty_cycle is not None]
    is_scheduled = isinstance(mac, LplParameters) or (isinstance(mac, TdmaParameters) and mac.listen != "always")
    for other in ([f"mac {mac.type}"] if is_scheduled else []) + [f"duty_cycle of group {name}" for name in cycled]:
        yield (
            f"{path}.sleep: {record.sleep} with {other}: both switch the radio, by schedules of their own, and what is sent "
            "to a sleeper is lost; leave one of them out"
        )


def _tolerance(record: CommunicationSensitiveParameters, path: str, groups: tuple[NodeGroup, ...]) -> Iterator[str]:
    if record.tolerance == "adaptive":
        for name in ("log_base", "support", "compare_with"):
            if _is_set(record, name):
                yield f"{path}.{name}: does nothing with tolerance: adaptive; leave it out, or set a number as tolerance"
    if record.tolerance_when_short is not None and all(group.budget is None for group in groups):
        yield (
            f"{path}.tolerance_when_short: does nothing, for no group has an allowance of energy; give one `budget`, or "
            "leave it out"
        )

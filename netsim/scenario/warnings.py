"""Combinations that a run allows and that rarely are what was meant, in words."""

from collections.abc import Callable, Iterator
from itertools import chain

from netsim.models.device_tables import load_radio
from netsim.scenario.group_warnings import group_warnings
from netsim.scenario.load import LoadedScenario
from netsim.scenario.setting_warnings import setting_warnings
from netsim.scenario.tracker_warnings import tracker_warnings
from netsim.scenario.tracking_checks import algorithms
from netsim.scenario.tracking_warnings import tracking_warnings
from netsim.sim.faults.rules import CrashRule, OutageRule, RoleCrashRule
from netsim.sim.mac.lpl_timing import LplParameters
from netsim.sim.mac.tdma import TdmaParameters
from netsim.units import s_to_ns


def scenario_warnings(loaded: LoadedScenario) -> Iterator[str]:
    """What a valid scenario does that is without effect or at odds with itself, each once."""
    checks: tuple[Callable[[LoadedScenario], Iterator[str]], ...] = (
        *(_time_sync, _faults, _duty_cycles, _guard_time),
        *(_roles, tracking_warnings, tracker_warnings, group_warnings, setting_warnings),
    )
    yield from chain.from_iterable(check(loaded) for check in checks)


def _time_sync(loaded: LoadedScenario) -> Iterator[str]:
    scenario = loaded.scenario
    if scenario.time_sync is not None and all(group.clock is None for group in scenario.nodes):
        yield "time_sync: all clocks are perfect, so it only costs messages; give the groups a `clock`"


def _faults(loaded: LoadedScenario) -> Iterator[str]:
    duration_s = loaded.scenario.duration_s
    for index, rule in enumerate(loaded.scenario.faults):
        if isinstance(rule, CrashRule | RoleCrashRule) and rule.at_s is not None and rule.at_s >= duration_s:
            yield f"faults[{index}]: the crash at {rule.at_s:g} s never comes: the run ends at {duration_s:g} s"
        if isinstance(rule, OutageRule):
            groups = {group.name for group in loaded.scenario.nodes}
            own = [a for a, b in rule.links if a == b and a not in groups]
            yield from (f"faults[{index}]: a link of node {node} with itself: there is none to cut" for node in own)


def _roles(loaded: LoadedScenario) -> Iterator[str]:
    """Crashes of roles that nobody takes; what a user's own algorithm tells is not known before it runs."""
    entries = [loaded.registry.entry_of(record) for _, record in algorithms(loaded.scenario)]
    if any(entry.roles is None for entry in entries):
        return
    known = list(dict.fromkeys(role for entry in entries for role in entry.roles or ()))
    for index, rule in enumerate(loaded.scenario.faults):
        if isinstance(rule, RoleCrashRule) and rule.role not in known:
            names = " and ".join(dict.fromkeys(entry.name for entry in entries))
            takes = f"takes {' or '.join(f'`{role}`' for role in known)}" if known else "tells no roles"
            yield f"faults[{index}]: nobody ever holds the role `{rule.role}`, so nobody crashes: {names} {takes}"


def _duty_cycles(loaded: LoadedScenario) -> Iterator[str]:
    mac = loaded.scenario.mac
    for group in loaded.scenario.nodes:
        if group.duty_cycle is None:
            continue
        if isinstance(mac, LplParameters | TdmaParameters):
            yield f"group {group.name}: duty_cycle with mac {mac.type}: both switch the radio, by schedules of their own"
        wake_ns = load_radio(group.radio, loaded.folder).wake_ns
        if s_to_ns(group.duty_cycle.on_s) <= wake_ns:
            yield (
                f"group {group.name}: duty_cycle.on_s is {group.duty_cycle.on_s:g} s, but the radio {group.radio} takes "
                f"{wake_ns / 1e9:g} s to start: it never listens but at the very beginning"
            )


def _guard_time(loaded: LoadedScenario) -> Iterator[str]:
    mac = loaded.scenario.mac
    if not isinstance(mac, TdmaParameters):
        return
    for group in loaded.scenario.nodes:
        if group.clock is not None and 1e3 * group.clock.offset_sd_s > mac.guard_ms:
            yield (
                f"group {group.name}: clocks start off by {1e3 * group.clock.offset_sd_s:g} ms (standard deviation), more "
                f"than mac.guard_ms, {mac.guard_ms:g} ms: slots overlap"
            )

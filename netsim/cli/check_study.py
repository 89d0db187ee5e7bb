"""Checking a study: all its variants are read, and those that differ are built."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from netsim.cli.console import counted, say, tell
from netsim.errors import ScenarioError
from netsim.scenario.build import build
from netsim.study.plan import Plan, load_plan
from netsim.study.variants import Variant

MOST_BUILT = 50
"""So many variants are built; more would take too long for a check."""


def check_study(file: Path, overrides: Sequence[str], plugins: bool) -> int:
    """Check a study and say what is wrong with it; how many errors."""
    try:
        plan = load_plan(file, overrides, plugins=plugins)
    except ScenarioError as error:
        found: Sequence[object] = list(error.findings) or [error]
        for finding in found:
            tell(str(finding))
        return len(found)
    different = list({variant.digest: variant for variant in reversed(plan.variants)}.values())[::-1]
    errors = list(dict.fromkeys(_errors(plan, different[:MOST_BUILT])))
    for line in errors:
        tell(line)
    if not errors:
        _tell(plan, different)
    return len(errors)


def _errors(plan: Plan, variants: Sequence[Variant]) -> Iterator[str]:
    """What shows only when a variant is built, in the first repetition."""
    for variant in variants:
        loaded = variant.loaded
        first = replace(loaded, scenario=replace(loaded.scenario, repetition=plan.repetitions[0]))
        try:
            build(first)
        except ScenarioError as error:
            yield from map(str, error.findings or [f"{plan.path}: variant {_name(variant)}: {error}"])


def _tell(plan: Plan, different: Sequence[Variant]) -> None:
    count, repetitions = len(plan.variants), len(plan.repetitions)
    trials = (
        f"{counted(count, 'variant')} x {counted(repetitions, 'repetition')} = {counted(count * repetitions, 'trial')}"
    )
    say(f"{plan.path}: ok ({plan.study.name}: {trials})")
    if len(different) < count:
        same = count - len(different)
        say(f"  {counted(same, 'variant')} {'is' if same == 1 else 'are'} the same as others and run only once")
    if len(different) > MOST_BUILT:
        say(f"  {MOST_BUILT} of {len(different)} different variants were built, the others only read")
    imported = {name: entry for each in different for name, entry in each.loaded.registry.found.items() if ":" in name}
    for name, entry in sorted(imported.items()):
        say(f"  {name} was imported: {entry.summary}")
    for warning in plan.warnings:
        tell(f"warning: {warning}")


def _name(variant: Variant) -> str:
    return ", ".join(f"{name}={level}" for name, level in variant.levels.items()) or "the only one"

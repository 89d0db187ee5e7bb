"""The sections of a report, in the order in which a reader asks."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import metric_of
from netsim.study.cells import cells_of
from netsim.study.info import STUDY_FILE
from netsim.study.reporting import tables
from netsim.study.reporting.answer import answer
from netsim.study.reporting.blocks import Block, Bullets, Code, Page, Picture, Section, Text, code, plain, prose
from netsim.study.reporting.names import title_of
from netsim.study.reporting.phrases import and_list
from netsim.study.reporting.view import ALL_BUT_CONSTANT, View
from netsim.study.statistics import flips

OWN = "netsim's own"
"""What stands for a citation where there is none."""

Pictures = Mapping[str, Sequence[Picture]]
"""The plots by topic: tradeoff, trend, distribution, differences, energy, nodes, lifetime, published."""


def page_of(view: View, pictures: Pictures, study_file: str) -> Page:
    """The whole report.

    Args:
        view: What to show.
        pictures: The plots there are, by topic.
        study_file: Text of the study file; empty if it is not there.
    """
    info = view.info
    made = (
        Section("Answer", answer(view)),
        Section("Failed trials", _blocks(tables.failures(view))),
        Section("Error against cost", tuple(pictures.get("tradeoff", ()))),
        Section("Results by variant", _blocks(*tables.result_tables(view)) if view.variants else ()),
        Section("Against the baseline", tuple(_against(view, pictures))),
        Section("Along the axes", tuple(pictures.get("trend", ()))),
        Section("From trial to trial", tuple(pictures.get("distribution", ()))),
        Section("Published figures", _published(view, pictures)),
        Section("Where the energy goes", tuple(pictures.get("energy", ()))),
        Section("Energy by node", tuple(pictures.get("nodes", ()))),
        Section("Lifetime", _blocks(*pictures.get("lifetime", ()), tables.lifetimes(view))),
        Section("What the metrics mean", _blocks(tables.definitions(view) if view.shown else None)),
        Section("Sources", _sources(view)),
        Section("Assumptions and caveats", (Bullets(tuple(_caveats(view))),)),
        Section("To make it again", tuple(_again(view, study_file))),
    )
    sections = tuple(section for section in made if section.blocks)
    return Page(plain(info.name), plain(info.question), tuple(_intro(view)), sections)


def _blocks(*blocks: Block | None) -> tuple[Block, ...]:
    return tuple(block for block in blocks if block is not None)


def _intro(view: View) -> Iterator[Block]:
    if view.info.description.strip():
        yield Text(prose(view.info.description))
    yield Text(_trials(view))


def _trials(view: View) -> str:
    """How many trials there are of how many, and what was varied."""
    info = view.info
    asked = len(info.variants) * len(info.repetitions)
    failed = int((view.results.trials["status"] != "ok").sum())
    there = len(view.results.trials)
    count = (
        f"**{asked} trials**: {_count(len(info.variants), 'variant')} × {_count(len(info.repetitions), 'repetition')}"
    )
    axes = and_list([f"{plain(axis.name)} ({_count(len(axis.levels), 'level')})" for axis in info.axes])
    state = [f"only {there} of them were run so far"] if there < asked else []
    state += [f"**{failed} failed**"] if failed else ["all ended"] if there == asked else ["these all ended"]
    text = f"{count}; {', '.join(state)}."
    return text + (f" Varied: {axes}." if axes else "")


def _against(view: View, pictures: Pictures) -> Iterator[Block]:
    if view.differences is None:
        return
    yield from pictures.get("differences", ())
    yield from tables.difference_tables(view)
    found = [
        f"{title_of(metric)}, {plain(row['axis'])} {plain(row['level'])}: {plain(row['words'])}"
        for metric in view.compared
        for row in flips(view.results.trials, view.info, metric).to_dict("records")
    ]
    if found:
        yield Text("**Where the verdict flips**, of differences that stand after Holm's adjustment:")
        yield Bullets(tuple(found))
    elif len(view.info.axes) > 1:
        yield Text("No verdict flips along another axis, as far as differences stand after Holm's adjustment.")


def _published(view: View, pictures: Pictures) -> tuple[Block, ...]:
    return _blocks(*pictures.get("published", ()), tables.published(view))


def _sources(view: View) -> tuple[Block, ...]:
    sources = view.info.sources
    items = [
        f"{plain(each.part)} {code(each.name)}: {plain(each.citation)}" for each in sources if each.citation != OWN
    ]
    own = [f"{plain(each.part)} {code(each.name)}" for each in sources if each.citation == OWN]
    items += [f"{OWN}: {and_list(own)}"] if own else []
    items += [f"metric {code(name)}: {plain(source)}" for name in view.shown if (source := _paper(name))]
    items += list(dict.fromkeys(f"published figures: {plain(each.source)}" for each in view.info.published))
    return (Bullets(tuple(items)),) if items else ()


def _paper(metric: str) -> str:
    """The paper that a metric is defined in; empty if its definition is our own."""
    try:
        parts = metric_of(metric).source.split("; ")
    except ScenarioError:
        return ""
    return "; ".join(part for part in parts if any(letter.isdigit() for letter in part))


def _caveats(view: View) -> Iterator[str]:
    if view.variants:
        yield from _of_intervals(view)
    if view.conditions:
        names = and_list([plain(axis.name) for axis in view.conditions])
        yield f"Not a designer's choice but circumstances, within which the variants are held against each other: {names}."
    yield from _of_trials(view)
    if len(view.info.builds) > 1:
        yield "Trials were run by different versions, told at the end: what differs may be due to them."
    if view.absent:
        yield f"Asked for, but no trial has a figure of it: {and_list([code(name) for name in view.absent])}."
    yield from (f"netsim warns: {plain(warning)}." for warning in view.info.warnings)
    if view.error is None and view.variants:
        yield "No metric of error has figures in this study: it compares costs alone."
    if view.constant:
        names = and_list([code(name) for name in view.constant])
        yield (
            f"All but constant, within {100 * ALL_BUT_CONSTANT:g} % for all variants of a setting, and so left out of the "
            f"answer and of the plots: {names}. The tables have them; `costs:` in the study brings them back."
        )
    if "energy_j" in view.shown and "energy_j" not in view.constant:
        yield (
            "Where radios listen all the time, `energy_j` is all but constant; `energy_beyond_listening_j` leaves out "
            "listening and sleep, and shows what the algorithms do."
        )


def _of_intervals(view: View) -> Iterator[str]:
    n = len(view.info.repetitions)
    if n == 1:
        yield "One repetition: there are no intervals, and no difference can be told from chance."
    else:
        few = (
            "with so few, only if these are nearly normal" if n < 15 else "by the central limit theorem fair for others"
        )
        yield (
            f"Intervals are Student's t at 95 % over at most {n} repetitions: exact for normal figures, {few}. One in "
            "twenty misses."
        )
        yield from _of_pairs(view)
    if len(view.variants) > 1 and view.error is not None:
        yield "Pareto sets are those of the means: where intervals overlap, other repetitions may change the members."
        if any(view.candidates(cost) for cost in view.costs):
            yield (
                "“Not shown to be dominated”: outside the Pareto set by their means, but of no other variant of the setting "
                "do the paired differences show, after Holm's adjustment for all pairs, that it is better in one of error "
                "and cost and better or equal in the other."
            )


def _of_pairs(view: View) -> Iterator[str]:
    """Whether variants drew the same random numbers, and so can be compared in pairs."""
    if len(view.variants) < 2:
        return
    found = Counter(draw for cell in cells_of(view.ended, ()) for draw in cell.rows)
    where = "one repetition of one seed" if len(view.info.seeds) > 1 else "one repetition"
    if max(found.values()) > 1:
        yield (
            f"In {where} all variants see the same targets, noise and shadowing; differences are taken within "
            "repetitions, which makes them sharper than the overlap of two intervals suggests."
        )
    if view.differences is not None and not (view.differences["n"] > 0).any():
        why = "their seeds differ" if len(view.info.seeds) > 1 else "they have no repetition in common"
        yield (
            f"No variant has a pair with its baseline ({why}): differences within repetitions are not known, and those of "
            "the means are not tested."
        )


def _of_trials(view: View) -> Iterator[str]:
    trials = view.results.trials
    if len(trials) and (trials["status"] != "ok").any():
        yield "Failed trials are left out; if they fail for a reason that has to do with the figures, means are biased."
    if len(trials) < len(view.info.variants) * len(view.info.repetitions):
        yield "The study is incomplete: variants may rest on different repetitions; paired differences use common ones."


def _again(view: View, study_file: str) -> Iterator[Block]:
    info = view.info
    seeds = and_list(list(map(str, info.seeds)))
    yield Text("The whole study:")
    yield Code(info.command, "sh")
    if len(view.results.trials):
        yield Text("One trial with its trace, from the study's folder (each has its command in results.csv):")
        yield Code(str(view.results.trials["command"].iloc[0]), "sh")
    yield Text("This report from the results, from the study's folder:")
    yield Code("netsim report .", "sh")
    versions = ", ".join(f"{name} {version}" for name, version in info.trial_versions.items())
    last, first = info.repetitions[-1], info.repetitions[0]
    numbers = f"repetitions {first} to {last}" if last != first else f"repetition {first}"
    yield Text(f"Seed {seeds}; {numbers}." + (f" Versions: {plain(versions)}." if versions else ""))
    if study_file:
        yield Code(study_file.rstrip("\n"), "yaml", f"The study ({code(STUDY_FILE)})")


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"

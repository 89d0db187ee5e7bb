"""The report of a study: what it says for studies of every shape, and the same bytes for the same results."""

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from report_studies import figures, written

from netsim.errors import ScenarioError, TraceError
from netsim.study.info import PublishedInfo, SourceInfo
from netsim.study.plots.distribution import distribution_plots
from netsim.study.plots.draw import TOPICS
from netsim.study.plots.forest import difference_plots, lifetime_plots, published_plots
from netsim.study.plots.trend import trend_plots
from netsim.study.report import write_report
from netsim.study.reporting.view import view_of
from netsim.study.results import load_study

TOLERANCES = {"tolerance": [0, 1, 2]}


@pytest.fixture
def words_only(monkeypatch):
    """No plots, for tests of what is said: they take most of the time."""
    monkeypatch.setattr("netsim.study.report.draw", lambda view: {})


@pytest.fixture
def one_plot(monkeypatch):
    """Plots of one topic alone, for tests that any plot will do for."""
    monkeypatch.setattr("netsim.study.plots.draw.TOPICS", {"tradeoff": TOPICS["tradeoff"]})


def report(folder: Path) -> str:
    """The report as Markdown."""
    write_report(folder)
    return (folder / "report.md").read_text(encoding="utf-8")


def section(text: str, title: str) -> str:
    """What stands below a heading; empty if it is not there."""
    found = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    return found[1] if found else ""


def verdict_table(text: str) -> str:
    """The table of verdicts, without its caption."""
    return "\n".join(line for line in section(text, "Answer").splitlines() if line.startswith("|"))


def titles(text: str) -> list[str]:
    return re.findall(r"^## (.*)$", text, re.MULTILINE)


def cells(text: str) -> list[list[str]]:
    """The rows of all tables, heads included."""
    rows = [re.split(r"(?<!\\)\|", line)[1:-1] for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row] for row in rows if not set("".join(row)) <= set("-: ")]


class Page(HTMLParser):
    """Notes what an HTML page refers to, and whether its tags are closed in order."""

    EMPTY = frozenset({"meta", "img", "br"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.sources: list[str] = []
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.alts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if tag == "img":
            self.sources.append(given["src"])
            self.alts.append(given["alt"])
        if tag == "a":
            self.links.append(given["href"])
        if "id" in given:
            self.anchors.add(given["id"])
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def test_a_study_with_two_axes_gets_every_section_in_the_order_of_questions(tmp_path):
    published = [
        PublishedInfo("association_error", 0.3, {"tolerance": t}, 0.01, "Chen 2006, Table I", "") for t in (0, 1, 2)
    ]
    axes = {**TOLERANCES, "fidelity": ["ideal", "csma-ca"]}
    sources = (SourceInfo("algorithm", "csmp", "Chen et al. 2006"),)
    law = lambda levels, repetition: figures(levels, repetition, lifetime_first_dead_days=10.0 + repetition)  # noqa: E731
    written(tmp_path, axes, law=law, published=published, sources=sources, versions={"netsim": "1.2.3"})
    text = report(tmp_path)
    assert titles(text) == [
        "Answer",
        "Error against cost",
        "Results by variant",
        "Against the baseline",
        "Along the axes",
        "Published figures",
        "Where the energy goes",
        "Energy by node",
        "Lifetime",
        "What the metrics mean",
        "Sources",
        "Assumptions and caveats",
        "To make it again",
    ]
    assert "**30 trials**: 6 variants × 5 repetitions; all ended." in text
    assert "Chen et al. 2006" in section(text, "Sources")
    assert "netsim 1.2.3" in section(text, "To make it again")
    assert "kind: study" in section(text, "To make it again")
    assert {path.stem for path in (tmp_path / "plots").glob("*.png")} == {
        path.stem for path in (tmp_path / "plots").glob("*.svg")
    }
    for name in re.findall(r"!\[[^\]]+\]\((plots/[^)]+)\)", text):
        assert (tmp_path / name).is_file()
    check_page((tmp_path / "report.html").read_text(encoding="utf-8"))


def check_page(text: str) -> None:
    """It is well-formed, holds pictures, and refers to nothing but itself."""
    page = Page(text)
    assert page.wrong == []
    assert page.open == []
    assert page.sources
    assert all(source.startswith("data:image/svg+xml;base64,") for source in page.sources)
    assert all(page.alts)
    assert {link.removeprefix("#") for link in page.links} <= page.anchors
    assert not re.search(r"""(src|href)=["']?(http|//|plots)""", text)


def test_the_same_results_give_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        written(tmp_path / name, TOLERANCES, 2)
        write_report(tmp_path / name)
    made = {path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file()}
    assert made == {path.relative_to(tmp_path / "two") for path in (tmp_path / "two").rglob("*") if path.is_file()}
    assert len(made) > 20
    for name in sorted(made):
        if name.suffix != ".parquet":
            assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_the_page_needs_no_other_file_and_is_well_formed(tmp_path, one_plot):
    written(tmp_path, {"thing": ["a|b", "*c*", "<script>alert(1)</script>", "`d`"]}, 3)
    text = write_report(tmp_path).read_text(encoding="utf-8")
    check_page(text)
    assert "<script" not in text
    assert "&lt;script&gt;" in text


def test_an_old_plot_goes_when_the_report_is_made_anew(tmp_path, words_only):
    written(tmp_path, TOLERANCES, 2)
    (tmp_path / "plots").mkdir()
    (tmp_path / "plots" / "gone.png").write_bytes(b"")
    write_report(tmp_path)
    assert not (tmp_path / "plots" / "gone.png").exists()


def test_one_variant_has_figures_and_nothing_to_compare(tmp_path, words_only):
    written(tmp_path, {})
    text = report(tmp_path)
    assert "One variant, nothing to compare it with: association error 0.5" in section(text, "Answer")
    assert "Against the baseline" not in titles(text)
    assert not (tmp_path / "differences.csv").exists()


def test_one_repetition_has_no_intervals_and_says_so(tmp_path, words_only):
    written(tmp_path, TOLERANCES, 1)
    text = report(tmp_path)
    assert "no interval" in section(text, "Results by variant")
    assert "±" not in section(text, "Results by variant").split("Mean")[0]
    assert "One repetition" in section(text, "Assumptions and caveats")
    assert "too few pairs" in section(text, "Answer")
    assert "**" not in verdict_table(text)


def test_a_variant_that_failed_is_left_out_and_told_with_its_command(tmp_path, words_only):
    written(tmp_path, TOLERANCES, 3, lambda levels, rep: None if levels["tolerance"] == 1 else figures(levels, rep))
    text = report(tmp_path)
    failed = cells(section(text, "Failed trials"))[1:]
    assert [row[1:4] for row in failed] == [["tolerance 1", str(repetition), "boom"] for repetition in range(3)]
    assert "netsim run variants/001/scenario.yaml --set repetition=2" in failed[2][4]
    assert "**3 failed**" in text
    assert [row[1] for row in cells(section(text, "Results by variant")) if row[0].isdigit()] == ["0", "2"] * 2
    assert "Failed trials are left out" in section(text, "Assumptions and caveats")


def test_without_the_baseline_nothing_is_said_against_it(tmp_path, words_only):
    written(tmp_path, TOLERANCES, 3, lambda levels, rep: None if levels["tolerance"] == 0 else figures(levels, rep))
    text = report(tmp_path)
    assert "**" not in verdict_table(text)
    assert "no pairs to compare" in section(text, "Answer")
    assert "has a pair with its baseline (they have no repetition in common)" in section(
        text, "Assumptions and caveats"
    )
    assert "(against the baseline" not in section(text, "Answer")
    assert list(difference_plots(view_of(load_study(tmp_path)))) == []


@pytest.mark.parametrize("law", [lambda levels, rep: None, lambda levels, rep: {}], ids=["failed", "empty"])
def test_a_study_without_a_figure_has_a_report_all_the_same(tmp_path, law):
    written(tmp_path, TOLERANCES, 2, law)
    text = report(tmp_path)
    assert titles(text)[-1] == "To make it again"
    assert not list((tmp_path / "plots").glob("tradeoff*"))


def test_an_interrupted_study_is_reported_as_far_as_it_got(tmp_path, words_only):
    written(tmp_path, TOLERANCES, 4, only=5)
    text = report(tmp_path)
    assert "**12 trials**: 3 variants × 4 repetitions; only 5 of them were run so far, these all ended." in text
    assert "The study is incomplete" in section(text, "Assumptions and caveats")


def test_a_problem_without_an_error_compares_costs_alone(tmp_path, words_only):
    def law(levels, repetition):
        return {name: value for name, value in figures(levels, repetition).items() if name != "association_error"}

    written(tmp_path, {"mac": ["csma", "a-longer-name"]}, 4, law)
    text = report(tmp_path)
    assert "Error against cost" not in titles(text)
    assert "Pareto" not in section(text, "Answer")
    assert "energy beyond listening" in section(text, "Answer")
    assert "No metric of error" in section(text, "Assumptions and caveats")


def test_traps_that_variants_fall_into_are_told(tmp_path, words_only):
    written(tmp_path, TOLERANCES, warnings=("radio cc1000: the noise makes it deaf (1 of 3 variants)",))
    assert "the noise makes it deaf (1 of 3 variants)." in section(report(tmp_path), "Assumptions and caveats")


def test_what_is_asked_for_and_not_there_is_told(tmp_path, words_only):
    written(tmp_path, TOLERANCES, 2, metrics=("energy_j", "ospa_mean_m"), costs=("radio_messages", "no_such_metric"))
    text = report(tmp_path)
    assert "`ospa_mean_m` and `no_such_metric`" in section(text, "Assumptions and caveats")
    assert "association error" in section(text, "Results by variant")


def test_a_figure_that_some_trials_lack_says_how_many_have_it(tmp_path, words_only):
    def law(levels, repetition):
        return figures(levels, repetition, latency_mean_s=None if repetition == 1 else 0.1 * (1 + repetition))

    written(tmp_path, TOLERANCES, 4, law, metrics=("association_error", "latency_mean_s"))
    assert "(n = 3)" in section(report(tmp_path), "Results by variant")


def test_levels_of_several_kinds_keep_their_names(tmp_path, words_only):
    written(tmp_path, {"thing": [None, True, 0.5, "a|b*"]}, 3)
    rows = cells(section(report(tmp_path), "Results by variant"))
    assert [row[1] for row in rows[1:5]] == ["null", "true", "0.5", r"a\|b\*"]


def test_a_hundred_variants_and_three_axes_stay_readable(tmp_path, words_only):
    axes = {"algorithm": [f"a{number:02d}" for number in range(25)], "radio": ["r1", "r22"], "mac": ["m", "mmm"]}
    written(tmp_path, axes, 2)
    text = report(tmp_path)
    assert max(map(len, section(text, "Answer").splitlines())) < 1500
    numbered = [row for row in cells(section(text, "Results by variant")) if row[0].isdigit()]
    assert len(numbered) == 120  # sixty in either of two tables
    assert "60 of 100 variants" in text
    assert "of 96 rows" in text


def test_published_figures_stand_beside_the_measured_ones(tmp_path, words_only):
    figure = PublishedInfo("association_error", 0.25, {"tolerance": 1}, 0.0106, "Chen 2006, Table I", "a note")
    other = PublishedInfo("energy_j", 11.0, {}, None, "elsewhere", "")
    written(tmp_path, TOLERANCES, 5, published=[figure, other])
    rows = cells(section(report(tmp_path), "Published figures"))
    assert rows[1][0:3] == ["association error", "tolerance=1", "0.25 ± 0.011"]
    assert rows[1][4].endswith("(±2.8)")  # Student's t of four degrees of freedom, not 1.96
    assert rows[1][6:] == ["Chen 2006, Table I", "a note"]
    assert [row[0] for row in rows[2:]] == ["energy"] * 3  # given for every variant
    assert rows[2][2] == "11"
    assert [plot.stem for plot in published_plots(view_of(load_study(tmp_path)))] == ["published"]


def test_published_figures_stand_on_the_lines_along_an_axis(tmp_path):
    known = [PublishedInfo("association_error", 0.4, {"tolerance": level}, 0.01, "A 2000", "") for level in (0, 2)]
    elsewhere = PublishedInfo("energy_j", 5.0, {"tolerance": 1}, None, "A 2000", "")
    written(tmp_path, TOLERANCES, published=[*known, elsewhere], metrics=("association_error",))
    (plot,) = trend_plots(view_of(load_study(tmp_path)))
    drawn = {tuple(line.get_xdata()) for line in plot.figure.axes[0].lines if line.get_marker() == "D"}
    assert drawn == {(0.0,), (2.0,)}
    assert "published" in [text.get_text() for text in plot.figure.legends[0].get_texts()]


def test_single_trials_are_dots_where_a_study_asks_for_them(tmp_path):
    written(tmp_path / "plain", TOLERANCES, repetitions=4)
    written(tmp_path / "dots", TOLERANCES, repetitions=4, plots=("trials",))

    def dots(name: str) -> int:
        (plot,) = trend_plots(view_of(load_study(tmp_path / name)))
        return sum(len(line.get_xdata()) for line in plot.figure.axes[0].lines if line.get_marker() == ".")

    assert (dots("plain"), dots("dots")) == (0, 12)


def test_a_distribution_climbs_to_the_whole_of_the_trials_that_have_a_figure(tmp_path):
    def law(levels, repetition):
        return figures(levels, repetition, outage_longest_s=None if repetition == 0 else float(repetition))

    written(tmp_path, {"tolerance": [0, 1]}, 5, law, error="outage_longest_s", plots=("distribution",))
    (plot,) = distribution_plots(view_of(load_study(tmp_path)))
    steps = [line for line in plot.figure.axes[0].lines if len(line.get_xdata()) > 2]
    assert [(list(line.get_xdata()), list(line.get_ydata())) for line in steps] == [
        ([1.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.25, 0.5, 0.75, 1.0])
    ] * 2
    assert "4 to 5 trials" in plot.caption


def test_no_distribution_is_drawn_unasked(tmp_path):
    written(tmp_path, TOLERANCES)
    assert not list(distribution_plots(view_of(load_study(tmp_path))))


def test_lifetimes_that_never_end_are_never(tmp_path, words_only):
    def law(levels, repetition):
        partition = None if levels["tolerance"] == 2 or repetition == 0 else 50.0 + repetition
        days = {"lifetime_first_dead_days": 10.0 + repetition, "lifetime_partition_days": partition}
        return figures(levels, repetition, lifetime_accuracy_days=None, **days)

    written(tmp_path, TOLERANCES, 3, law)
    rows = cells(section(report(tmp_path), "Lifetime"))
    assert rows[0][2:] == ["lifetime to the first death (days)", "lifetime to partition (days)",
                           "lifetime to the first loss of accuracy (days)"]  # fmt: skip
    assert "(in 2 of 3, else never)" in rows[1][3]
    assert rows[3][3] == "never"
    assert {row[4] for row in rows[1:]} == {"never"}
    assert [plot.stem for plot in lifetime_plots(view_of(load_study(tmp_path)))] == ["lifetime"]


def test_circumstances_are_told_from_choices(tmp_path):
    axes = {"algorithm": ["a", "bb"], "fidelity": ["ideal", "csma"], "radio": ["x", "yyy"]}
    info = written(tmp_path, axes, 2)
    view = view_of(load_study(tmp_path))
    assert [axis.name for axis in view.conditions] == ["fidelity"]
    assert [axis.name for axis in view.choices] == ["algorithm", "radio"]
    assert {where: len(found) for where, found in view.settings.items()} == {"ideal": 4, "csma": 4}
    assert sorted(number for found in view.settings.values() for number in found) == [
        each.number for each in info.variants
    ]


def test_the_axis_of_the_comparison_is_a_choice_whatever_it_changes(tmp_path):
    written(tmp_path, {"fidelity": ["ideal", "csma"], "mac": ["x", "yyy"]}, 2)
    view = view_of(load_study(tmp_path))
    assert view.conditions == ()


def test_a_folder_without_a_study_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="expected the description of a study"):
        write_report(tmp_path)


def test_plots_that_cannot_be_written_are_an_error_of_one_line(tmp_path, one_plot):
    written(tmp_path, TOLERANCES, 2)
    (tmp_path / "plots").write_text("in the way")
    with pytest.raises(TraceError, match="plots"):
        write_report(tmp_path)


def test_a_usual_cost_that_hardly_varies_is_no_cost_to_choose_by(tmp_path, words_only):
    def law(levels, repetition):
        found = figures(levels, repetition)
        return {**found, "energy_j": 50.0 + 0.01 * found["energy_beyond_listening_j"]}

    written(tmp_path / "usual", TOLERANCES, law=law)
    text = report(tmp_path / "usual")
    assert not re.search(r"(better|worse)\*\* in energy(,| and|;)", section(text, "Answer"))
    assert "left out of the answer and of the plots: `energy_j`" in section(text, "Assumptions and caveats")
    written(tmp_path / "asked", TOLERANCES, law=law, costs=("energy_j",))
    assert "left out" not in section(report(tmp_path / "asked"), "Assumptions and caveats")

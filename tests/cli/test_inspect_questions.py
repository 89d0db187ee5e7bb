"""`netsim inspect` asked about one node or one message."""

import re
from pathlib import Path

import pytest
from mcap.opcode import Opcode

import netsim
from netsim.cli.questions import Question, ask
from netsim.errors import ScenarioError
from netsim.trace.events import EnergyLedger, Handoff
from netsim.trace.reader import TruncatedTraceWarning, read_trace
from netsim.trace.writer import TraceWriter


@pytest.fixture(scope="module")
def run(scenarios: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in which n03 speaks in round 0, is silent in round 1, and speaks again in round 2."""
    loaded = netsim.load(scenarios / "quickstart.yaml", ["seed=11"])
    folder = tmp_path_factory.mktemp("run") / "out"
    netsim.run(loaded, folder=folder)
    return folder


def test_why_a_node_woke(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ask(run, Question(why="n03", round=2))
    told = capsys.readouterr().out
    assert "n03 spoke in round 2 (begun 6.0000" in told
    assert "Before, n03 was silent for 1 round: it spoke last in round 0 (begun 4.0000" in told
    first_level = re.findall(r"^[├└]── #\d+ belief of round (\d) from (n\d\d)", told, re.MULTILINE)
    assert first_level == [("0", "n07"), ("0", "n04"), ("1", "n04"), ("1", "n07")]
    assert "the same causes as #" in told
    ask(run, Question(why="n03", at_s=6.5))
    assert capsys.readouterr().out == "By 6.5 s the last turn of n03 is round 2 (begun 6.000011 s).\n" + told


def test_a_silent_node_is_said_to_be(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ask(run, Question(why="n03", round=1))
    told = capsys.readouterr().out
    assert "n03 was silent in round 1" in told
    assert "It spoke last in round 0" in told
    assert "Rounds in which it spoke: 0, 2." in told
    ask(run, Question(why="n03", round=4))
    assert "It had been silent for 1 round before" in capsys.readouterr().out
    ask(run, Question(why="n03", at_s=0.0))
    assert "n03 had sent nothing by 0 s; its first turn is at 0.0" in capsys.readouterr().out


def test_a_message_has_a_story(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ask(run, Question(message=32, depth=1))
    told = capsys.readouterr().out
    assert re.search(r"^#32: belief of round 1, \d+ byte.*sent by n04 to n03 at 5\.\d{6} s$", told, re.MULTILINE)
    assert re.search(r"data frame, \d+ byte +n04 +n03 +received", told)
    assert re.search(r"ack frame, 5 byte +n03 +n04 +received", told)
    assert re.search(r"delivered +n04 +n03 +[\d.]+ ms, 1 hop", told)
    assert "4 causes not followed: see --depth, --top" in told
    assert re.search(r"^It led to:\n  #40: belief of round 2, .* sent by n03 to n04", told, re.MULTILINE)


def test_a_time_line_is_bounded(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ask(run, Question(timeline="n03", start_s=4.0, end_s=6.0, top=3))
    told = capsys.readouterr().out
    assert re.findall(r"^ +(\d\.\d{6}) ", told, re.MULTILINE)[0] == "4.000000"
    left_out = int(re.findall(r"and (\d+) more", told)[0])
    ask(run, Question(timeline="3", start_s=4.0, end_s=6.0))
    whole = capsys.readouterr().out
    assert len(re.findall(r"^ +\d\.\d{6} ", whole, re.MULTILINE)) == left_out + 3
    assert "hears" not in whole
    ask(run, Question(timeline="n03", start_s=4.0, end_s=6.0, frames=True))
    assert "hears" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("question", "message"),
    [
        (Question(why="n03"), "expected --round N or --at SECONDS"),
        (Question(why="n03", round=1, at_s=2.0), "expected --round N or --at SECONDS"),
        (Question(why="n03", round=99), r"expected a round of n03, 0 to 10; got 99"),
        (Question(why="n03,n04", round=1), "expected one node, got n03,n04"),
        (Question(why="n33", round=1), "got n33"),
        (Question(timeline="n03", message=1), "--timeline and --message: expected one question at a time"),
        (Question(timeline="n03", start_s=4.0, end_s=3.0), "expected a time after --start"),
        (Question(round=1), "--round: expected with --why only"),
        (Question(frames=True, kinds="a"), "--kinds: expected with --timeline or --sequence only"),
        (Question(message=999), r"expected the number of a message of this trace, 1 to \d+, got 999"),
    ],
)
def test_what_makes_no_sense_is_refused(run: Path, question: Question, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        ask(run, question)


def without_the_end(data: bytes) -> bytes:
    """An MCAP file up to the record that says that its data are over."""
    at = 8
    while data[at] != Opcode.DATA_END:
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    return data[:at]


def test_of_a_trace_cut_short_the_part_that_is_there_is_told(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(without_the_end((run / "trace.mcap").read_bytes()))
    for question in (Question(why="n03", round=2), Question(message=32), Question(timeline="n03"), Question()):
        with pytest.warns(TruncatedTraceWarning):
            ask(cut, question)
        assert "n03" in capsys.readouterr().out


def test_the_figures_of_a_part_are_said_to_be_that(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A killed run leaves no figures and no account of its energy: it is not said to have drawn nothing."""
    part = tmp_path / "part.mcap"
    with TraceWriter(part, {"scenario": "killed"}) as writer:
        for time_ns, event in read_trace(run / "trace.mcap"):
            if not isinstance(event, EnergyLedger):
                writer.write(event, time_ns)
    part.write_bytes(without_the_end(part.read_bytes()))
    with pytest.warns(TruncatedTraceWarning, match=r"what came after [0-9.]+ s is lost; copy the file again"):
        ask(part, Question())
    told = capsys.readouterr().out
    assert "killed (seed ?), the part up to " in told
    assert "no energy ledger: the trace is cut short" in told
    assert " J" not in told


def test_a_study_is_sent_on_to_its_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "study.json").write_text("{}")
    (tmp_path / "report.html").write_text("")
    ask(tmp_path, Question())
    assert capsys.readouterr().out == f"{tmp_path} is a study, of many runs: look at {tmp_path}/report.html\n"


def test_a_leader_says_whom_it_chose(scenarios: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    netsim.run(netsim.load(scenarios / "liu2002" / "tracking.yaml", ["duration_s=0.7"]), folder=tmp_path / "run")
    (choice,) = (event for _, event in read_trace(tmp_path / "run" / "trace.mcap", {Handoff.topic}))
    ask(tmp_path / "run", Question(why=f"{choice.node}", at_s=0.65))
    told = capsys.readouterr().out
    assert f"n{choice.node:02d} chose n{choice.destination:02d} to lead track 0 next, by utility of n" in told


def test_a_sequence_chart_is_written(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "chart.html"
    ask(run, Question(sequence=out, start_s=4.0, end_s=5.0, nodes="n03,n04", kinds="belief", time="events"))
    told = capsys.readouterr().out
    assert re.match(r"4\.\d{6} to 4\.\d{6} s · \d+ messages in \d+ frames · \d nodes, in the order", told)
    assert f"wrote {out}; open it in a browser" in told
    with pytest.raises(ScenarioError, match="this file exists"):
        ask(run, Question(sequence=out))
    with pytest.raises(ScenarioError, match="expected at most 3 frames in a chart"):
        ask(run, Question(sequence=out, limit=3, force=True))


@pytest.mark.parametrize(
    ("question", "words"),
    [
        (Question(sequence=Path("a.svg"), message=3), "--sequence and --message: expected one question at a time"),
        (Question(time="linear"), "--time: expected with --sequence only"),
        (Question(timeline="n03", limit=3, force=True), "--limit, --force: expected with --sequence only"),
        (Question(sequence=Path("a.svg"), frames=True), "--frames: expected with --timeline only"),
        (Question(start_s=1.0), "--start: expected with --timeline or --sequence only"),
        (Question(sequence=Path("a.svg"), nodes="n99"), "expected some of n00"),
    ],
)
def test_options_of_a_chart_that_do_not_go_together(run: Path, question: Question, words: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(words)):
        ask(run, question)

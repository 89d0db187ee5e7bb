"""The journal: whole lines only, and nobody else's."""

import json
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from netsim.errors import TraceError
from netsim.study.journal import Journal, StudyInUse, read_journal
from netsim.study.trial import Outcome


def outcome(number: int, **more) -> Outcome:
    return Outcome(number, f"digest-{number}", "ok", figures={"energy_j": number / 3, "by": {"a": 1}}, **more)


def test_outcomes_come_back_as_they_were(tmp_path):
    path = tmp_path / "trials.jsonl"
    written = [outcome(0), outcome(1, error="", details="Traceback\n  ...", nodes={"node": [0, 1]})]
    assert list(read_journal(path)) == []
    with Journal(path) as journal:
        for each in written:
            journal.add(each)
            assert list(read_journal(path))[-1] == each
    assert list(read_journal(path)) == written


@pytest.mark.parametrize("cut_byte", [1, 20, 60])
def test_a_torn_last_line_is_left_out_and_cut_off(tmp_path, cut_byte):
    path = tmp_path / "trials.jsonl"
    with Journal(path) as journal:
        journal.add(outcome(0))
        journal.add(outcome(1))
    path.write_bytes(path.read_bytes()[:-cut_byte])
    assert list(read_journal(path)) == [outcome(0)]
    with Journal(path) as journal:
        journal.add(outcome(2))
    assert list(read_journal(path)) == [outcome(0), outcome(2)]


@pytest.mark.parametrize("damage", ["{]", "[1, 2]", '{"trial": 1}', "\\xff\\x00"])
def test_damage_before_the_end_is_named_with_its_line(tmp_path, damage):
    path = tmp_path / "trials.jsonl"
    with Journal(path) as journal:
        journal.add(outcome(0))
        journal.add(outcome(1))
    first, second = path.read_text().splitlines()
    path.write_text(f"{first}\n{damage}\n{second}\n")
    with pytest.raises(TraceError, match=r"trials\.jsonl:2: damaged: .*delete the line"):
        list(read_journal(path))


def test_afresh_throws_away(tmp_path):
    path = tmp_path / "trials.jsonl"
    with Journal(path) as journal:
        journal.add(outcome(0))
    with Journal(path, afresh=True):
        pass
    assert path.read_bytes() == b""


HOLD = """
import sys
from pathlib import Path
from netsim.study.journal import Journal
with Journal(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_one_process_at_a_time_and_a_killed_one_leaves_no_lock(tmp_path):
    path = tmp_path / "trials.jsonl"
    arguments = [sys.executable, "-c", HOLD, str(path)]
    with subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(StudyInUse, match="another `netsim study` is at work"):
            Journal(path)
        holder.kill()
    with Journal(path) as journal:
        journal.add(outcome(0))


FILL = """
import sys
from pathlib import Path
from netsim.study.journal import Journal
from netsim.study.trial import Outcome
from netsim.errors import TraceError
with Journal(Path(sys.argv[1])) as journal:
    try:
        for number in range(1000):
            journal.add(Outcome(number, f"k-{number}", "ok"))
    except TraceError as error:
        print(error)
        sys.exit(3)
"""


def test_a_disk_that_is_full_is_one_line_and_what_is_whole_stays(tmp_path):
    path = tmp_path / "trials.jsonl"

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))

    done = subprocess.run(
        [sys.executable, "-c", FILL, str(path)], preexec_fn=limit, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (3, "")
    assert "cannot write or read the study's journal: File too large" in done.stdout
    assert path.stat().st_size == 1000
    assert not path.read_bytes().endswith(b"\n")
    whole = [json.loads(line) for line in path.read_bytes().split(b"\n")[:-1]]
    assert [each.trial for each in read_journal(path)] == [line["trial"] for line in whole] == list(range(len(whole)))
    assert len(whole) > 1


def test_a_folder_that_is_not_there_is_one_line(tmp_path):
    with pytest.raises(TraceError, match="No such file"):
        Journal(Path(tmp_path / "nowhere" / "trials.jsonl"))

"""A user's algorithm with helpers beside it: which files it consists of, and that an edited one is not taken for the old."""

import sys

import pytest

import netsim
from netsim.algorithms.own_modules import own_files
from netsim.study.executors import local_workers
from netsim.study.plan import load_plan
from netsim.study.run import open_study

SCENARIO = """kind: scenario
schema_version: 1
name: own
duration_s: 2
nodes:
  - {name: a, placement: {type: grid, rows: 1, columns: 2, spacing_m: 5}}
medium: {type: log-distance}
algorithm: {type: "own_shouter:Shouter"}
"""
SHOUTER = """from own_words import WORD


class Shouter:
    \"\"\"Says a word.\"\"\"

    def run(self, node):
        node.broadcast("word", WORD)
        yield from node.receive(timeout_ns=1_000_000_000)
"""
STUDY = """kind: study
schema_version: 1
name: own
question: How long is the word?
scenario: own.yaml
repetitions: 2
"""


@pytest.fixture
def folder(tmp_path):
    written = {
        "own.yaml": SCENARIO,
        "own_shouter.py": SHOUTER,
        "own_words.py": "from own_parts.size import N\n\nWORD = bytes(N)\n",
    }
    for name, text in written.items():
        (tmp_path / name).write_text(text)
    package = tmp_path / "own_parts"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "size.py").write_text("N = 3\n")
    (tmp_path / "study.yaml").write_text(STUDY)
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("own_")]:
        del sys.modules[name]


def payload_byte(folder):
    return netsim.run(netsim.load(folder / "own.yaml")).metrics["message_payload_byte"]


def test_an_algorithm_is_its_module_and_what_it_imports_from_beside_it(folder):
    (folder / "own_stranger.py").write_text("raise RuntimeError\n")
    found = [path.relative_to(folder).as_posix() for path in own_files("own_shouter", folder)]
    assert found == ["own_shouter.py", "own_words.py", "own_parts/__init__.py", "own_parts/size.py"]
    assert own_files("own_absent", folder) == []


def test_a_module_in_a_circle_of_imports_is_found_once(tmp_path):
    (tmp_path / "own_a.py").write_text("import own_b\n")
    (tmp_path / "own_b.py").write_text("import own_a\nimport json\n")
    assert [path.name for path in own_files("own_a", tmp_path)] == ["own_a.py", "own_b.py"]


def test_a_helper_that_is_edited_counts_from_the_next_run_on(folder):
    assert payload_byte(folder) == 6
    (folder / "own_parts" / "size.py").write_text("N = 5\n")
    assert payload_byte(folder) == 10


def test_the_folder_of_a_run_holds_the_helpers(folder):
    netsim.run(netsim.load(folder / "own.yaml"), folder=folder / "run", trace=False)
    for name in [name for name in sys.modules if name.startswith("own_")]:
        del sys.modules[name]
    (folder / "own_words.py").unlink()
    again = netsim.run(netsim.load(folder / "run" / "scenario.yaml"))
    assert again.metrics["message_payload_byte"] == 6


def test_an_edited_helper_makes_another_study(folder):
    digests = [load_plan(folder / "study.yaml").variants[0].digest]
    (folder / "own_parts" / "size.py").write_text("N = 5\n")
    digests.append(load_plan(folder / "study.yaml").variants[0].digest)
    assert digests[0] != digests[1]


def test_workers_of_a_pool_get_the_helpers(folder):
    (folder / "out").mkdir()
    with open_study(load_plan(folder / "study.yaml"), folder / "out", "c") as study:
        end = study.run(lambda trials: local_workers(2), lambda standing: True)
    assert not end.failures
    assert netsim.load_results(folder / "out")["message_payload_byte"].tolist() == [6, 6]

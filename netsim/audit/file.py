"""The file itself: whole, in order, described as this version describes it, with its attachments."""

import json
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from netsim import __version__
from netsim.audit.rule import Run
from netsim.audit.tally import Tally, seconds
from netsim.errors import TraceError
from netsim.trace.index import announced, indexed_counts
from netsim.trace.reader import RawMessage, is_complete, trace_attachments, trace_metadata

SCENARIO = "scenario.yaml"
METRICS = "metrics.json"
_RUN_KEYS = ("scenario", "seed", "repetition", "horizon_s", "detail")


class Reading:
    """Follows the reading of a trace: is it whole, do times and sequence numbers go up, does the index agree?

    Args:
        path: The trace.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._whole = Tally("the file is whole", "events")
        self._order = Tally("time goes on", "events")
        self._counts: Counter[str] = Counter()
        self._next: defaultdict[str, int] = defaultdict(int)
        self.last_ns = 0
        self.is_whole = True
        try:
            self.is_whole = is_complete(path)
        except TraceError as error:
            self.stop(error)

    @property
    def tallies(self) -> Sequence[Tally]:
        """What was found so far."""
        return (self._whole, self._order)

    def take(self, message: RawMessage) -> None:
        """The next message."""
        self._whole.looked += 1
        self._order.looked += 1
        self._counts[message.topic] += 1
        if message.time_ns < self.last_ns:
            what = f"{message.topic}: recorded after an event at {seconds(self.last_ns)} s"
            self._order.found(what, message.time_ns)
        if message.sequence != self._next[message.topic]:
            what = f"{message.topic}: expected event {self._next[message.topic]} of its topic, got {message.sequence}"
            self._order.found(what, message.time_ns)
        self._next[message.topic] = message.sequence + 1
        self.last_ns = max(self.last_ns, message.time_ns)

    def stop(self, error: TraceError) -> None:
        """The file is damaged here."""
        self.is_whole = False
        self._whole.found(str(error).removeprefix(f"{self._path}: "), self.last_ns if self._whole.looked else None)

    def cut(self) -> None:
        """The records end here; damage, where the end of the file is in its place all the same."""
        if self.is_whole:
            self.stop(TraceError("damaged: a record has a wrong length, so that what follows it is lost"))

    def conclude(self) -> None:
        """The last message has been read."""
        if not self.is_whole:
            if not self._whole.wrong:
                self._whole.found(
                    "cut short: what came after is lost; only the part that is there was checked", self.last_ns
                )
            return
        try:
            indexed = indexed_counts(self._path)
        except TraceError as error:
            self.stop(error)
            return
        for topic in sorted({*indexed, *self._counts}):
            if indexed.get(topic, 0) != self._counts[topic]:
                self._whole.found(
                    f"{topic}: {self._counts[topic]} events, but its index counts {indexed.get(topic, 0)}"
                )


def format_tally(path: Path) -> Tally:
    """Whether every topic is announced once, with the schema that this version has for it."""
    version = trace_metadata(path)["format_version"]
    tally = Tally("topics are described", "topics", f"format version {version}, read by netsim {__version__}")
    try:
        topics = announced(path)
    except TraceError as error:
        tally.found(str(error).removeprefix(f"{path}: "))
        return tally
    tally.looked = len(topics)
    for each in topics:
        if each.wrong:
            tally.found(f"{each.topic}: {each.wrong}")
    for topic, count in Counter(each.topic for each in topics).items():
        if count > 1:
            tally.found(f"{topic}: announced {count} times")
    unknown = [each.topic for each in topics if not each.is_known]
    if unknown:
        tally.note += f"; not known to this version and not checked: {', '.join(unknown)}"
    return tally


def attachments_tally(path: Path, run: Run, *, is_whole: bool) -> Tally:
    """Whether the files that a trace carries can be read, and are of the run that its metadata name."""
    tally = Tally("attachments are readable", "files")
    try:
        files = trace_attachments(path)
    except TraceError as error:
        tally.found(str(error).removeprefix(f"{path}: "))
        return tally
    tally.looked = len(files)
    for what in (*_of_scenario(files, run), *(_of_metrics(files) if is_whole else ())):
        tally.found(what)
    return tally


def scenario_of(path: Path) -> dict[str, Any]:
    """The scenario that a trace carries, as plain values; empty where there is none that can be read."""
    try:
        content = _yaml(trace_attachments(path).get(SCENARIO, b""))
    except (TraceError, YAMLError, UnicodeDecodeError):
        return {}
    return content if isinstance(content, dict) else {}


def _of_scenario(files: dict[str, bytes], run: Run) -> Iterator[str]:
    if SCENARIO not in files:
        yield f"{SCENARIO} is missing"
    elif run.scenario.get("kind") != "scenario":
        yield f"{SCENARIO} is no scenario"
    else:
        scenario, trace = run.scenario, run.scenario.get("trace")
        detail = trace.get("detail") if isinstance(trace, dict) else None
        told = (
            scenario.get("name"),
            scenario.get("seed"),
            scenario.get("repetition"),
            scenario.get("duration_s"),
            detail,
        )
        for key, value in zip(_RUN_KEYS, told, strict=True):
            if str(value) != run.metadata.get(key):
                yield f"{SCENARIO} says {key} {value}, the record netsim.run {run.metadata.get(key)}"


def _of_metrics(files: dict[str, bytes]) -> Iterator[str]:
    if METRICS not in files:
        yield f"{METRICS} is missing"
        return
    try:
        metrics = json.loads(files[METRICS])
    except ValueError as error:
        yield f"{METRICS} is no JSON: {error}"
        return
    if not isinstance(metrics, dict):
        yield f"{METRICS}: expected an object, got {type(metrics).__name__}"


def _yaml(data: bytes) -> Any:
    return YAML(typ="safe", pure=True).load(data.decode())

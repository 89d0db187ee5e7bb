"""Handing out trials, with workers that do as the test says."""

from collections import Counter
from concurrent.futures import Future

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netsim.errors import NetsimError
from netsim.study.dispatch import Dispatcher, Standing
from netsim.study.executors import WorkerDied
from netsim.study.trial import Outcome, Task


@pytest.fixture(autouse=True, scope="module")
def _look_often():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("netsim.study.dispatch.LOOK_S", 0.0005)
        yield


def task(number: int) -> Task:
    return Task(number, 0, number, f"v-{number}", "")


class ScriptedPool:
    """Workers that share their fate: a killer takes with it whatever the pool holds at the time."""

    name = "scripted"
    share_fate = True

    def __init__(self, window=3, killers=(), deaths_allowed=2):
        self.window = self.count = window
        self.deaths_allowed = deaths_allowed
        self.killers = set(killers)
        self.held: list[tuple[Task, Future]] = []
        self.runs: Counter = Counter()
        self.most_held = 0
        self.renewed = 0
        self.broken = False

    def submit(self, given: Task) -> Future:
        if self.broken:
            raise WorkerDied("died")
        future: Future = Future()
        self.held.append((given, future))
        self.most_held = max(self.most_held, len(self.held))
        if len(self.held) >= self.window or given.trial in self.killers:
            self._work()
        return future

    def _work(self) -> None:
        if any(each.trial in self.killers for each, _ in self.held):
            self.broken = True
            for each, future in self.held:
                self.runs[each.trial] += 1
                future.set_exception(WorkerDied("died"))
        else:
            for each, future in self.held:
                self.runs[each.trial] += 1
                future.set_result(Outcome(each.trial, each.key, "ok"))
        self.held = []

    def look(self, standing: Standing) -> bool:
        """The last ones do not fill the window: they finish when somebody looks."""
        if self.held:
            self._work()
        return True

    def error_of(self, future):
        return future.exception()

    def renew(self) -> None:
        self.renewed += 1
        self.broken = False

    def close(self, *, at_once) -> None:
        pass


def dispatch(workers, count, watch=None):
    notes: list[Outcome] = []
    standing = Standing(count)
    dispatcher = Dispatcher(workers, notes.append, watch or workers.look, standing)
    whole = dispatcher.run([task(number) for number in range(count)])
    return whole, notes, standing


@given(st.integers(0, 12), st.integers(1, 5))
def test_every_trial_runs_once_and_the_window_is_kept(count, window):
    workers = ScriptedPool(window)
    whole, notes, standing = dispatch(workers, count)
    assert whole
    assert sorted(note.trial for note in notes) == list(range(count))
    assert set(workers.runs.values()) <= {1}
    assert workers.most_held <= window
    assert (standing.done, standing.ran, standing.ran_failed, standing.left) == (count, count, 0, 0)


@given(st.sets(st.integers(0, 9), max_size=2), st.integers(1, 5))
def test_only_the_trial_that_kills_its_worker_fails(killers, window):
    workers = ScriptedPool(window, killers)
    whole, notes, standing = dispatch(workers, 10)
    assert whole
    assert sorted(note.trial for note in notes) == list(range(10))
    failed = {note.trial for note in notes if note.status == "failed"}
    assert failed == killers
    assert {note.error for note in notes if note.status == "failed"} <= {"its worker died"}
    assert standing.ran_failed == len(killers)


def test_workers_that_never_bring_anything_back_end_the_study():
    with pytest.raises(NetsimError, match="3 trials died with their workers and none came back"):
        dispatch(ScriptedPool(3, range(20)), 20)


def test_no_new_trials_once_the_user_has_had_enough():
    workers = ScriptedPool(2)
    looks = iter([True, True])

    def watch(standing):
        if workers.held:
            workers._work()
        return next(looks, False)

    whole, notes, standing = dispatch(workers, 10, watch)
    assert not whole
    assert len(notes) == workers.runs.total() == standing.done == 4


def test_an_error_of_the_workers_own_ends_the_study():
    class Lost(ScriptedPool):
        def submit(self, given):
            future: Future = Future()
            future.set_exception(NetsimError("lost the scheduler"))
            return future

    with pytest.raises(NetsimError, match="lost the scheduler"):
        dispatch(Lost(), 3)


def test_remaining_time_is_the_trials_own_mean_shared_by_the_workers():
    standing = Standing(trials=10, done=2, ran=2, workers=4, trial_wall_s=3.0)
    assert standing.remaining_s == pytest.approx(8 * 1.5 / 4)
    assert Standing(trials=10).remaining_s is None

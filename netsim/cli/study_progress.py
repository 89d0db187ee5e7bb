"""How far a study is: a bar on a terminal, a plain line now and then elsewhere."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TaskID, TextColumn

from netsim.cli.console import tell
from netsim.cli.watching import LINE_EVERY_S, progress_bar, wish_to_end
from netsim.study.dispatch import Standing


class StudyWatch:
    """Shows the progress of one study and notes the wish to end it."""

    def __init__(self, bar: Progress | None) -> None:
        self._bar = bar
        self._task: TaskID | None = None
        self._begun_s = time.perf_counter()
        self._shown_s = self._begun_s
        self.standing: Standing | None = None
        self.wants_end = False

    def __call__(self, standing: Standing) -> bool:
        """See `netsim.study.dispatch.Watch`."""
        self.standing = standing
        now_s = time.perf_counter()
        if self._bar is not None:
            self._draw(self._bar, standing, now_s - self._begun_s)
        elif now_s - self._shown_s >= LINE_EVERY_S and standing.left:
            self._shown_s = now_s
            tell(f"{standing.done} of {standing.trials} trials, {remarks(standing, now_s - self._begun_s)}")
        return not self.wants_end

    def _draw(self, bar: Progress, standing: Standing, wall_s: float) -> None:
        if self._task is None:
            self._task = bar.add_task("study", total=standing.trials, remarks="")
        bar.update(self._task, completed=standing.done, remarks=remarks(standing, wall_s))


def remarks(standing: Standing, wall_s: float) -> str:
    """Failures, rate and remaining time."""
    if not standing.workers:
        return "no worker there: waiting for one"
    if not standing.ran:
        return f"{standing.workers} at a time"
    failed = f"{standing.ran_failed} failed, " if standing.ran_failed else ""
    left = "" if standing.remaining_s is None else f", about {duration(standing.remaining_s)} left"
    return f"{failed}{standing.ran / wall_s:.3g} trials/s{left}"


def duration(time_s: float) -> str:
    """A time as one says it: 12 s, 3 min 20 s, 2 h 5 min."""
    whole = round(time_s)
    if whole < 60:
        return f"{whole} s"
    minutes, seconds = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes} min {seconds} s"
    return f"{minutes // 60} h {minutes % 60} min"


@contextmanager
def watched_study() -> Iterator[StudyWatch]:
    """Show progress, and turn the first Ctrl-C (or SIGTERM) into the wish to end; a second one stops at once."""
    columns = (
        TextColumn("trials"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f}"),
        TextColumn("{task.fields[remarks]}"),
    )
    with progress_bar(*columns) as bar:
        watch = StudyWatch(bar)

        def note() -> None:
            watch.wants_end = True
            tell(_ending(watch.standing))

        with wish_to_end(note):
            yield watch


def _ending(standing: Standing | None) -> str:
    count = 1 if standing is None else max(1, standing.running)
    trials = "the trial that runs" if count == 1 else f"the {count} trials that run"
    return f"finishing {trials}; Ctrl-C once more to stop at once (finished trials are kept either way)"

"""How far a run is: a bar in simulated time on a terminal, a plain line now and then elsewhere."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from netsim.cli.console import tell
from netsim.cli.watching import LINE_EVERY_S, progress_bar, wish_to_end
from netsim.units import NS_PER_S

MIN_LOOK_S = 0.1


class Watch:
    """Shows the progress of one run and notes the wish to end it."""

    def __init__(self, bar: Progress | None) -> None:
        self._bar = bar
        self._task: TaskID | None = None
        self._begun_s = time.perf_counter()
        self._shown_s = self._begun_s
        self.wants_end = False

    def __call__(self, now_ns: int, horizon_ns: int) -> bool:
        """See `netsim.scenario.run.Progress`."""
        wall_s = time.perf_counter()
        if wall_s - self._shown_s >= (MIN_LOOK_S if self._bar else LINE_EVERY_S):
            self._shown_s = wall_s
            self._show(now_ns / NS_PER_S, horizon_ns / NS_PER_S, wall_s - self._begun_s)
        return not self.wants_end

    def _show(self, now_s: float, horizon_s: float, wall_s: float) -> None:
        speed = now_s / wall_s
        if self._bar is None:
            left_s = (horizon_s - now_s) / speed if speed > 0 else float("inf")
            tell(
                f"simulated {now_s:.1f} of at most {horizon_s:g} s, {speed:.3g} x real time, at most {left_s:.0f} s left"
            )
            return
        if self._task is None:
            self._task = self._bar.add_task("run", total=horizon_s, speed="")
        self._bar.update(self._task, completed=now_s, speed=f"{speed:.3g} x real time")


@contextmanager
def watched() -> Iterator[Watch]:
    """Show progress, and turn the first Ctrl-C (or SIGTERM) into the wish to end; a second one stops at once."""
    columns = (
        TextColumn("simulating"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of at most {task.total:g} s"),
        TextColumn("{task.fields[speed]}"),
        TimeRemainingColumn(),
    )
    with progress_bar(*columns) as bar:
        watch = Watch(bar)

        def note() -> None:
            watch.wants_end = True
            tell("ending the run and closing its files; once more to stop at once")

        with wish_to_end(note):
            yield watch

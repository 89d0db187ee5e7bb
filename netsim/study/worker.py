"""What a worker process of a study does before its first trial. Light: numpy must not have been loaded yet."""

import os
import signal
import threading
from multiprocessing import connection, parent_process

ONE_THREAD_EACH = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Settings of the libraries for linear algebra: as many workers as cores, each with a thread."""


def one_thread_each() -> None:
    """Keep linear algebra to one thread, unless the user said otherwise; of use only before numpy is loaded."""
    for name in ONE_THREAD_EACH:
        os.environ.setdefault(name, "1")


def prepare_worker() -> None:
    """Leave Ctrl-C to the process that runs the study, use one thread, and end with that process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    one_thread_each()
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    """A worker that waits for work would not notice that a killed study gives out no more."""
    connection.wait([sentinel])
    os._exit(1)

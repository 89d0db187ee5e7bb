"""How pictures are drawn and written: the same settings each time, and equal pictures as equal files."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from netsim.errors import NetsimError
from netsim.flow import look


@contextmanager
def styled() -> Iterator[None]:
    """Matplotlib with our settings and otherwise its own; afterwards as it was."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(dict[Any, Any](look.RC))
        yield


def save(figure: Figure, path: Path) -> None:
    """Write a figure.

    Args:
        figure: What to write.
        path: Where; a name that ends in `.png` or `.svg`.

    Raises:
        NetsimError: If the file cannot be written.
    """
    metadata = {"Date": None} if path.suffix.lower() == ".svg" else {"Software": None}
    try:
        figure.savefig(path, metadata=metadata)
    except OSError as error:
        message = f"{path}: cannot write the picture: {error.strerror}"
        raise NetsimError(message) from error

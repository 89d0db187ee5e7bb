"""Where a movie may be written."""

from pathlib import Path

from netsim.errors import ScenarioError


def check_place(path: Path, *, force: bool) -> None:
    """Make sure that a movie can be written, without writing anything.

    Raises:
        ScenarioError: If the folder does not exist, or there is something of that name that may not be replaced.
    """
    asked = f"--{path.suffix[1:].lower()} {path}"
    if not path.parent.is_dir():
        msg = f"{asked}: expected a folder that exists, got {path.parent}; make it, or name another"
        raise ScenarioError(msg)
    if path.is_dir():
        msg = f"{asked}: expected the name of a movie, got that of a folder"
        raise ScenarioError(msg)
    if path.exists() and not force:
        msg = f"{asked}: expected a new file, got one that exists; name another, or replace it (--force)"
        raise ScenarioError(msg)

"""Where a picture is to be written."""

from pathlib import Path

from netsim.errors import ScenarioError

ENDINGS = (".png", ".svg")


def check_picture(out: Path | None) -> None:
    """Refuse a place for a picture before anything is computed for it.

    Raises:
        ScenarioError: If its name has another ending, or its folder does not exist.
    """
    if out is None:
        return
    if out.suffix.lower() not in ENDINGS:
        message = f"--out {out}: expected the name of a picture that ends in .png or .svg"
        raise ScenarioError(message)
    if not out.parent.is_dir():
        message = f"--out {out}: expected a folder that exists, got {out.parent}; make it, or name another"
        raise ScenarioError(message)

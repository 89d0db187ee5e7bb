"""Which netsim it is: its version, and a digest of its sources, since figures may change between two versions."""

import platform
from functools import cache
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path
from typing import Final

import netsim

PACKAGES: Final = ("simpy", "numpy", "scipy", "networkx")
"""Those that figures depend on."""


@cache
def build_id() -> str:
    """Such as `0.1.0+3f9c2a17`: equal for equal sources and data tables, wherever they are installed."""
    digest = blake2b(digest_size=4)
    package = Path(netsim.__file__).parent
    files = [path for suffix in ("py", "yaml") for path in package.rglob(f"*.{suffix}")]
    for path in sorted(path for path in files if path.relative_to(package).parts[0] != "_scenarios"):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return f"{netsim.__version__}+{digest.hexdigest()}"


def package_versions() -> dict[str, str]:
    """Of Python and the packages that figures depend on, in this process."""
    return dict(_package_versions())


def versions() -> dict[str, str]:
    """Of netsim, Python and the packages that figures depend on."""
    return {"netsim": build_id(), **package_versions()}


@cache
def _package_versions() -> tuple[tuple[str, str], ...]:
    return ("python", platform.python_version()), *((name, version(name)) for name in PACKAGES)

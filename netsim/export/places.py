"""Where an export goes: under a temporary name while it is being written, under its own name only when it is whole."""

import shutil
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from netsim.errors import ScenarioError

_PARTIAL = ".partial"


@dataclass(frozen=True, slots=True)
class Place:
    """A file or a folder to be written.

    Attributes:
        option: The option that asks for it, for messages.
        path: Its own name.
        ending: How the name of the file, or of the files in the folder, ends.
        is_folder: Whether it is a folder.
        names: What the files in the folder may be called, without ending.
    """

    option: str
    path: Path
    ending: str
    is_folder: bool
    names: Collection[str] = ()

    @property
    def partial(self) -> Path:
        """Its name while it is being written; beside its own, also where that is a link, or `.`."""
        real = self.path.resolve()
        return real.with_name(real.name + _PARTIAL)

    def check(self, *, force: bool) -> None:
        """Refuse a place that cannot or must not be written, before any work is done for it.

        Raises:
            ScenarioError: If it has a wrong ending, its folder does not exist, or something is there that may not be
                replaced: anything without `force`, and with it anything but an earlier export.
        """
        if not self.is_folder and self.path.suffix.lower() != self.ending:
            self._refuse(f"expected the name of a file that ends in {self.ending}", self.path.name)
        if not self.path.absolute().parent.is_dir():
            self._refuse("expected a folder that exists", f"{self.path.parent}; make it, or name another")
        if self.path.is_dir() != self.is_folder and self.path.exists():
            self._refuse(f"expected {'a folder' if self.is_folder else 'a file'}", "something else of this name")
        if self.is_folder:
            self._check_folder(force)
        elif self.path.exists() and not force:
            self._refuse("expected a new file", "one that exists; name another, or replace it (--force)")

    def begin(self) -> Path:
        """Make room for what is to be written; returns where to write it."""
        _remove(self.partial)
        if self.is_folder:
            self.partial.mkdir()
        return self.partial

    def commit(self) -> None:
        """Give what was written its own name, in place of what was there; a folder that exists stays, with new files."""
        real = self.path.resolve()
        if not self.is_folder or not real.exists():
            self.partial.replace(real)
            return
        names = {path.name for path in self.partial.iterdir()}
        for name in sorted(names):
            (self.partial / name).replace(real / name)
        for path in real.iterdir():
            if path.name not in names:
                path.unlink()
        self.partial.rmdir()

    def discard(self) -> None:
        """Take back what was written."""
        with suppress(OSError):
            _remove(self.partial)

    def _check_folder(self, force: bool) -> None:
        present = list(self.path.iterdir()) if self.path.exists() else []
        if present and not force:
            self._refuse("expected a new or empty folder", "one with files; name another, or replace them (--force)")
        foreign = [path.name for path in present if path.suffix != self.ending or path.stem not in self.names]
        if foreign:
            found = f"one with {foreign[0]}; name another"
            self._refuse("expected a folder with nothing but an earlier export", found)

    def _refuse(self, expected: str, got: str) -> None:
        message = f"{self.option} {self.path}: {expected}, got {got}"
        raise ScenarioError(message)


def _remove(path: Path) -> None:
    remove: Callable[[Path], None] = shutil.rmtree if path.is_dir() and not path.is_symlink() else _unlink
    remove(path)


def _unlink(path: Path) -> None:
    path.unlink(missing_ok=True)

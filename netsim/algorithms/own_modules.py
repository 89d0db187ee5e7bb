"""The files of a user's algorithm: its module, and what this imports from beside the scenario.

Found by reading the sources, not by looking at what has been imported: what belongs to a run must not depend on what else
the process has done.
"""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def own_files(module_name: str, folder: Path) -> list[Path]:
    """The Python files in a folder that a module consists of, itself first, then what it imports from there, in order.

    A package counts with all its files.

    Args:
        module_name: As it stands before the colon of `module:Class`; may be dotted.
        folder: Where the scenario lies.

    Returns:
        Paths below `folder`; empty for a module that is not there.
    """
    found: dict[Path, None] = {}
    waiting = [module_name]
    while waiting:
        for path in _files_of(waiting.pop(0), folder):
            if path not in found:
                found[path] = None
                waiting += _imports(path, folder)
    return list(found)


def module_of(path: Path, folder: Path) -> str:
    """The name under which a file of `own_files` is imported."""
    parts = path.relative_to(folder).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def forget_others(files: list[Path], folder: Path) -> None:
    """Forget modules of the same names that were imported from elsewhere, or have changed since.

    If one goes, all go that belong to the same algorithm: they would hold on to the old one.
    """
    names = [module_of(path, folder) for path in files]
    if any(_is_another(sys.modules.get(name), path) for name, path in zip(names, files, strict=True)):
        for name in names:
            sys.modules.pop(name, None)


def _files_of(name: str, folder: Path) -> list[Path]:
    """The file of a module, or all files of the package that a dotted name begins with."""
    top = folder / name.partition(".")[0]
    if (top / "__init__.py").is_file():
        return sorted(top.rglob("*.py"))
    file = top.with_suffix(".py")
    return [file] if file.is_file() and file.stem not in sys.stdlib_module_names else []


def _imports(path: Path, folder: Path) -> Iterator[str]:
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return  # importing it will say what is wrong
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module


def remember(files: list[Path], folder: Path) -> None:
    """Note what was imported, so that a file edited later in this process is told from it."""
    for path in files:
        module = sys.modules.get(module_of(path, folder))
        if module is not None and not hasattr(module, _MARK):
            setattr(module, _MARK, path.read_bytes())


_MARK = "__netsim_source__"


def _is_another(known: Any, path: Path) -> bool:
    """Whether the module known by a name was made from another content than the file's."""
    if known is None:
        return False
    content = getattr(known, _MARK, None)
    if content is None:
        file = getattr(known, "__file__", None)
        content = Path(file).read_bytes() if file is not None and Path(file).is_file() else None
    return bool(content != path.read_bytes())

"""`netsim new`: templates that work as they are."""

import keyword
from importlib.resources import files
from pathlib import Path

from netsim.cli.console import say
from netsim.errors import ScenarioError

TEMPLATES = {
    "{module}.py": "algorithm.py.txt",
    "test_{module}.py": "test_algorithm.py.txt",
    "{module}.yaml": "scenario.yaml.txt",
}


def new_algorithm_command(name: str, folder: Path) -> None:
    """Write an algorithm, its test and a scenario; existing files are never touched."""
    module = name.replace("-", "_").lower()
    if not module.isidentifier() or keyword.iskeyword(module):
        message = f"{name!r}: expected a name that can be a Python module, such as gossip or my_tracker"
        raise ScenarioError(message)
    class_name = "".join(part.capitalize() for part in module.split("_"))
    targets = {folder / target.format(module=module): template for target, template in TEMPLATES.items()}
    taken = [str(path) for path in targets if path.exists()]
    if taken:
        message = f"{', '.join(taken)}: exists already; choose another name or --folder"
        raise ScenarioError(message)
    for path, template in targets.items():
        text = (files("netsim.cli") / "templates" / template).read_text(encoding="utf-8")
        _write(path, text.replace("@MODULE@", module).replace("@CLASS@", class_name))
    say(f"Run it:  netsim run {folder / f'{module}.yaml'}")
    say(f"Test it: python -m pytest {folder / f'test_{module}.py'}   (needs pip install -e '.[test]')")


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        message = f"cannot write {path}: {error.strerror or error}"
        raise ScenarioError(message) from error
    say(f"wrote {path}")

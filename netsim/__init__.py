"""Discrete-event simulation of sensor networks that run distributed inference over real messages.

    import netsim

    scenario = netsim.load("scenarios/quickstart.yaml", overrides=["algorithm.tolerance=1"])
    result = netsim.run(scenario)
    print(result.metrics["association_error"], result.metrics["energy_j"])

`load` reads and checks a scenario, `run` simulates it and returns a `Result`: metrics, energy ledger, where the trace is.
`load_results` reads the table of a study as a pandas DataFrame.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

__all__ = [
    "LoadedScenario",
    "NetsimError",
    "Result",
    "ScenarioError",
    "TraceError",
    "__version__",
    "load",
    "load_results",
    "run",
]

from netsim.errors import NetsimError, ScenarioError, TraceError

if TYPE_CHECKING:
    import pandas as pd

    from netsim.scenario.load import LoadedScenario
    from netsim.scenario.run import Result


def load(path: str | Path, overrides: Sequence[str] = (), *, plugins: bool = True) -> "LoadedScenario":
    """Read and check a scenario file.

    Args:
        path: The YAML file.
        overrides: `path=value` each, such as `algorithm.tolerance=1`, applied over the file.
        plugins: Whether algorithms named `module:Class` may be imported.

    Raises:
        ScenarioError: With every finding (`.findings`), each naming file, line, path, what was expected, and a remedy.
    """
    from netsim.scenario.load import load as load_scenario

    return load_scenario(path, overrides, plugins=plugins)


def run(
    scenario: "LoadedScenario | str | Path",
    *,
    folder: str | Path | None = None,
    trace: bool = True,
    force: bool = False,
) -> "Result":
    """Simulate a scenario to its end.

    Args:
        scenario: What `load` gave, or the path of a scenario file.
        folder: Where to write trace.mcap, metrics.json, run.json and scenario.yaml; None writes nothing.
        trace: Whether to write the trace.
        force: Whether an earlier run in `folder` may be replaced.

    Raises:
        ScenarioError: If the scenario cannot be run, or `folder` is not empty and `force` is not set.
        TraceError: If a file cannot be written.
    """
    from netsim.scenario.folder import new_folder
    from netsim.scenario.run import run as run_scenario

    loaded = load(scenario) if isinstance(scenario, str | Path) else scenario
    made = None if folder is None else new_folder(Path(folder), loaded.scenario.name, force)
    return run_scenario(loaded, folder=made, trace=trace)


def load_results(path: str | Path) -> "pd.DataFrame":
    """The trials of a study, one row each: axes, repetition, seed, status, and every scalar metric.

    Args:
        path: The folder that `netsim study` wrote, or the results.parquet or results.csv in it.

    Raises:
        ScenarioError: If there is no such table.
    """
    from netsim.study.results import load_results as load_table

    return load_table(path)


def __getattr__(name: str) -> Any:
    """The types of the interface, imported when asked for: `import netsim` stays quick."""
    if name == "LoadedScenario":
        from netsim.scenario.load import LoadedScenario

        return LoadedScenario
    if name == "Result":
        from netsim.scenario.run import Result

        return Result
    message = f"module 'netsim' has no attribute {name!r}"
    raise AttributeError(message)

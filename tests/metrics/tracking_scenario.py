"""A run with targets and estimates, for several tests."""

from pathlib import Path

from netsim.scenario.load import LoadedScenario, load

TRACKING = """
kind: scenario
schema_version: 1
name: priors
duration_s: 5
field: {width_m: 200, height_m: 200}
nodes:
  - name: sensors
    placement: {type: grid, rows: 8, columns: 8, spacing_m: 25, origin_m: [10, 10]}
medium: {type: ideal}
problem:
  type: association
  detection_radius_m: 15
  targets: {type: uniform, count: 60}
  prior_variance_m2: 1.0
  prior_mean: drawn
algorithm: {type: "tracking_algorithms:TellPriors"}
"""


def tracking_scenario(folder: Path, *overrides: str) -> LoadedScenario:
    """The scenario, written into a folder."""
    path = folder / "priors.yaml"
    path.write_text(TRACKING, encoding="utf-8")
    return load(path, overrides)

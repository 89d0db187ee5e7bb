"""Small scenarios, and an environment that shuffles what happens at one instant."""

from pathlib import Path

import numpy as np
import simpy
from sim_rig import Log

from netsim.scenario.build import build
from netsim.scenario.load import load
from netsim.sim.clock import Clock

ROOT = Path(__file__).parents[2]

SMALL = """
kind: scenario
schema_version: 1
name: small
seed: {seed}
duration_s: {duration_s}
field: {{width_m: 60, height_m: 60}}
nodes:
  - name: sensors
    placement: {{type: grid, rows: 3, columns: 3, spacing_m: {spacing_m}}}
    cpu: cortex_m4
    battery: {battery}
{more}
medium: {medium}
mac: {mac}
network: {network}
algorithm: {algorithm}
trace: {{detail: {detail}, energy_interval_s: 1}}
"""


def small(folder, **settings):
    """A loaded scenario: nine nodes of which neighbours talk, with some of its settings replaced."""
    values = {
        "seed": 1,
        "duration_s": 20,
        "spacing_m": 15,
        "battery": "{type: mains}",
        "more": "",
        "medium": "{type: log-distance, exponent: 3.0, shadowing_sd_db: 4}",
        "mac": "{type: csma}",
        "network": "{type: shortest-path}",
        "algorithm": "{type: neighbour-traffic, period_s: 0.25, payload_byte: 150, rounds: 6}",
        "detail": "full",
    } | settings
    path = Path(folder) / "small.yaml"
    path.write_text(SMALL.format(**values), encoding="utf-8")
    return load(path)


class Shuffled(simpy.Environment):
    """Handles what happens at one instant, and of one rank, in random order."""

    def __init__(self, seed):
        super().__init__(initial_time=0)
        self._random = np.random.default_rng(seed)

    def schedule(self, event, priority=1, delay=0):
        super().schedule(event, priority + 0.5 * self._random.random(), delay)


def run(loaded, environment=None):
    """Run a scenario; returns (events with times, simulation)."""
    log = Log()
    clock = None if environment is None else Clock(environment)
    simulation = build(loaded, [log], clock).simulation
    simulation.run()
    simulation.conclude()
    return log.events, simulation

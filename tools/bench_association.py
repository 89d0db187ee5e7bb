"""How much time and memory data association takes: by targets on the 5 x 5 grid, or by sensors at equal density.

    python tools/bench_association.py reach --targets 17 33 54 70 --seeds 10
    python tools/bench_association.py scale --side 5 10 20 40

`reach` builds all vertices of a problem and passes messages for 15 rounds of max-product in one place, each problem in a
process of its own, so that the peak of memory is its own. `scale` runs whole simulations on ideal links, from drawing
the problem to the last event; the exact MAP, which a run computes for its metrics, is left out: the integer programme does
not grow linearly. Times are processor time and differ from machine to machine; everything else is equal for equal seeds.
"""

import argparse
import multiprocessing
import resource
import time
from pathlib import Path

import numpy as np

from netsim.errors import ScenarioError
from netsim.kernels.association_reach import largest, require_reach, sensor_states
from netsim.kernels.association_vertices import instance_vertices
from netsim.kernels.central import run_synchronous
from netsim.kernels.semiring import Semiring
from netsim.metrics.inference import GraphTraffic
from netsim.problems.association import AssociationParameters, UniformTargets, build
from netsim.rng import Streams
from netsim.scenario.build import build as build_scenario
from netsim.scenario.load import load

SCENARIO = Path(__file__).parent.parent / "scenarios" / "chen2006" / "association-csmp.yaml"
TARGETS = {5: 33, 10: 114, 20: 419, 40: 1603}
"""Targets for each side of the grid: 33 times the area of the union of the discs over that of the 5 x 5 grid."""

GRID_M = np.array([[5.0 * x, 5.0 * y] for x in range(5) for y in range(5)])


def measure(job):
    """Of one problem: its largest sensor, its demand, seconds and the peak of memory."""
    targets, seed, rounds = job
    base = peak_mb()
    instance = build(
        AssociationParameters(targets=UniformTargets(count=targets)), GRID_M, range(25), Streams(seed)
    ).instance
    demand, states = largest(instance), max(sensor_states(instance))
    try:
        require_reach(instance)
    except ScenarioError:
        return states, demand.entries, None, None, base
    begun = time.process_time()
    vertices = instance_vertices(instance)
    run_synchronous(vertices, Semiring.MAX, rounds, stop_when_converged=False)
    return states, demand.entries, time.process_time() - begun, peak_mb(), base


def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def reach(targets, seeds, rounds):
    print("targets  problems  refused  largest sensor  median s  worst s  median MB  worst MB")
    context = multiprocessing.get_context("spawn")
    for count in targets:
        with context.Pool(1, maxtasksperchild=1) as pool:
            found = pool.map(measure, [(count, seed, rounds) for seed in range(seeds)], chunksize=1)
        seconds = [each[2] for each in found if each[2] is not None]
        memory = [each[3] for each in found if each[3] is not None]
        print(
            f"{count:7}  {seeds:8}  {seeds - len(seconds):7}  {max(each[0] for each in found):14.2e}"
            f"  {np.median(seconds):8.2f}  {max(seconds):7.2f}  {np.median(memory):9.0f}  {max(memory):8.0f}",
            flush=True,
        )


def scale(sides, seed):
    print("sensors  targets  algorithm      cpu s  ms a sensor  messages a sensor  peak MB")
    for side in sides:
        for name in ("csmp", "max-product"):
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                cpu_s, messages, memory = pool.apply(simulate, (side, name, seed))
            print(
                f"{side * side:7}  {TARGETS[side]:7}  {name:11}  {cpu_s:7.2f}  {1e3 * cpu_s / side**2:11.2f}"
                f"  {messages:17.2f}  {memory:7.0f}",
                flush=True,
            )


def simulate(side, algorithm, seed):
    """Processor seconds, graph messages per sensor and peak memory of one run on ideal links."""
    plain = {"tolerance": 0.1, "first_round": "init"} if algorithm == "csmp" else {}
    record = {"type": algorithm, "rounds": 15, "round_s": 2, "spread_s": 1.5, "setup_s": 6, **plain}
    overrides = [
        f"nodes[0].placement={{type: grid, rows: {side}, columns: {side}, spacing_m: 5}}",
        f"problem.targets.count={TARGETS[side]}",
        f"field={{width_m: {5 * side + 5}, height_m: {5 * side + 5}}}",
        "medium={type: ideal, delay_s: 0.001, range_m: 10.1}",
        "mac={type: ideal}",
        "network={type: one-hop}",
        f"seed={seed}",
        "algorithm={" + ", ".join(f"{key}: {value}" for key, value in record.items()) + "}",
    ]
    loaded, traffic = load(SCENARIO, overrides), GraphTraffic()
    begun = time.process_time()
    simulation = build_scenario(loaded, [traffic]).simulation
    simulation.run()
    simulation.conclude()
    return time.process_time() - begun, traffic.figures()["graph_messages_per_sensor"], peak_mb()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["reach", "scale"])
    parser.add_argument("--targets", type=int, nargs="+", default=[17, 33, 54, 70])
    parser.add_argument("--seeds", type=int, default=10, help="reach: how many problems")
    parser.add_argument("--seed", type=int, default=1, help="scale: of the runs")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--side", type=int, nargs="+", default=[5, 10, 20, 40], choices=list(TARGETS))
    chosen = parser.parse_args()
    if chosen.what == "reach":
        reach(chosen.targets, chosen.seeds, chosen.rounds)
    else:
        scale(chosen.side, chosen.seed)


if __name__ == "__main__":
    main()

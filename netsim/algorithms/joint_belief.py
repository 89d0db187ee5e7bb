"""One step of a group's belief: motion, readings, estimates (Liu et al. 2004, eq 1)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from netsim.algorithms.joint_groups import named
from netsim.algorithms.joint_messages import Held, Reading
from netsim.algorithms.joint_station import Station
from netsim.kernels.energy_sensing import likelihood_operations
from netsim.kernels.logical_targets import separate_operations
from netsim.kernels.particle_resolution import resolution_m2, spread_m
from netsim.kernels.particles import (
    ParticleBelief,
    condition,
    condition_operations,
    predict,
    predict_operations,
    resample,
    resample_operations,
    uniform_disc,
)
from netsim.kernels.semiring import FloatArray
from netsim.kernels.spare_targets import spare_operations, spare_target
from netsim.trace.events import AlgorithmRecord, Estimate, Group, Identity, Particles

JOINT = "joint"
"""Kind of the record of a reading in which a group tracks several targets jointly."""
_MOST_TOLD = 1000
"""Particles of a belief that go into the trace: enough to see it, whatever it has."""


def particles_of(station: Station, targets: int) -> int:
    """How many particles a belief about so many targets has."""
    return station.parameters.particles if targets == 1 else station.parameters.joint_particles


def operations(readings: int, belief: ParticleBelief) -> int:
    """Elementary operations of `updated` for so many readings.

    Of several targets those of naming them are among it: for the estimates, and of the drawn particles for the next call
    and to see whether they have parted.
    """
    particles, targets = belief.count, belief.targets
    naming = 2 * separate_operations(particles, targets) if targets > 1 else 0
    return (
        predict_operations(particles, targets)
        + likelihood_operations(readings, particles, targets)
        + condition_operations(particles)
        + resample_operations(particles, particles)
        + naming
        + spare_operations(readings, particles, targets)
    )


def updated(station: Station, held: Held, step: int, readings: Mapping[int, Reading]) -> Held:
    """A group after motion and readings, its particles drawn to equal weights; its estimates go into the trace.

    Estimates are taken before the particles are drawn, which adds nothing but noise to them.
    """
    model, nodes = station.knowledge.model, sorted(readings)
    energies = np.array([readings[node].energy for node in nodes])
    most_m = station.knowledge.max_speed_m_per_s * station.knowledge.reading_s * (step - held.step)
    belief = predict(held.belief, most_m, station.rng)
    before, spare = named(belief), None
    between_m2 = resolution_m2(belief.count, belief.targets, spread_m(before))
    is_quiet = not (energies > station.loud).any()
    if nodes:
        sensors_m = station.knowledge.places_m(nodes)
        likelihood = model.log_likelihood(energies, sensors_m, belief.positions_m)
        try:
            belief = condition(belief, likelihood)
            if not is_quiet and not held.is_blank:
                spare = spare_target(model, energies, sensors_m, before, likelihood)
        except ValueError:
            belief = _restarted(station, held, energies, sensors_m)
    if len(held.tracks) > 1:
        station.node.record(AlgorithmRecord(station.node.id, JOINT, json.dumps({"tracks": held.tracks})))
    _tell(station, held, belief, between_m2)
    _tell_particles(station, held.tracks, step, belief)
    station.node.record(Group(station.node.id, step, list(held.tracks), nodes))
    count = particles_of(station, len(held.tracks))
    return replace(
        held,
        step=step,
        belief=resample(belief, count, station.rng),
        quiet=held.quiet + 1 if is_quiet or spare is not None else 0,
        spare=None if spare is None else held.tracks[spare],
        is_blank=held.is_blank and not nodes,
    )


def _restarted(station: Station, held: Held, energies: FloatArray, sensors_m: FloatArray) -> ParticleBelief:
    """No particle explains the readings: the targets are somewhere around the member that reads most."""
    loudest = int(np.argmax(np.where(np.isfinite(energies), energies, -np.inf)))
    x_m, y_m = sensors_m[loudest].tolist()
    station.node.log(f"{held.label} lost, no particle explains the readings: anew around {x_m:.0f}, {y_m:.0f} m")
    centres_m = np.repeat(sensors_m[loudest][None], len(held.tracks), axis=0)
    return uniform_disc(centres_m, station.knowledge.sensing_range_m, held.belief.count, station.rng)


def _tell(station: Station, held: Held, belief: ParticleBelief, between_m2: float) -> None:
    """Where each track is believed to be, and whom it follows.

    Args:
        station: Of the leader.
        held: The group.
        belief: Where its targets are, not yet drawn to equal weights.
        between_m2: Variance on account of the distance between particles, of each coordinate.
    """
    node = station.node
    told = named(belief)
    for index, track in enumerate(held.tracks):
        spread = told.covariance_m2(index)
        covariance = [float(spread[0, 0]) + between_m2, float(spread[0, 1]), float(spread[1, 1]) + between_m2]
        x_m, y_m = told.estimate_m[index].tolist()
        node.record(Estimate(node.id, track, x_m, y_m, covariance))
        node.record(Identity(node.id, track, held.rows[index].tolist()))


def _tell_particles(station: Station, tracks: Sequence[int], step: int, belief: ParticleBelief) -> None:
    """Of many particles an even choice: they are in no order but that copies of one, moved since, stand side by side."""
    told = named(belief)
    chosen = slice(None, None, -(-belief.count // _MOST_TOLD))
    x_m, y_m = (told.positions_m[chosen, :, axis].T.ravel().tolist() for axis in (0, 1))
    weights = told.weights[chosen].tolist()
    station.node.record(Particles(station.node.id, step, list(tracks), belief.count, weights, x_m, y_m))

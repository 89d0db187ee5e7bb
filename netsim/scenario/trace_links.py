"""Links from files: gains of TOSSIM's topology generator, or delivery ratios that were measured on a testbed."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from netsim.errors import ScenarioError
from netsim.models.delivery import ReplayedRatios, rounds_of
from netsim.models.gain_file import GainFile, read_gains
from netsim.models.k7 import K7, read_k7
from netsim.models.media import TraceMediumParameters
from netsim.models.noise import Background, background, gaussian_background
from netsim.models.path_loss import Links, sorted_links
from netsim.rng import Streams
from netsim.scenario.link_quality import Array, Quality, Receivers
from netsim.scenario.link_sources import LinkSource
from netsim.scenario.load import LoadedScenario
from netsim.scenario.places import Place, positions_m

Ints = NDArray[np.int64]

NOISE_STEP_S = 1e-3
"""How often Gaussian noise by a gain file's lines is drawn anew: TOSSIM takes a new value every millisecond."""


def trace_links(
    places: Sequence[Place], medium: TraceMediumParameters, loaded: LoadedScenario, streams: Streams
) -> LinkSource:
    """Links by a file.

    Raises:
        ScenarioError: If the file cannot be read, or does not fit the nodes.
    """
    if medium.format == "tossim":
        return _gains(places, medium, loaded, streams)
    return _measured(places, medium, loaded, streams)


def _gains(
    places: Sequence[Place], medium: TraceMediumParameters, loaded: LoadedScenario, streams: Streams
) -> LinkSource:
    gains = read_gains(loaded.folder / medium.file)
    _check_ids(places, medium, loaded, gains.nodes)
    noise = _noise(places, medium, loaded, streams, gains)
    receivers = Receivers(places, noise, medium.fading)

    def links() -> Links:
        found = _by_index(places, gains.source, gains.destination, gains.gain_db)
        power_dbm = receivers.tx_power_dbm[found.source] + found.gain_db
        return found.only(power_dbm >= receivers.floor_dbm[found.destination])

    return LinkSource(positions_m(places), links, receivers.quality, noise, medium.fading)


def _noise(
    places: Sequence[Place],
    medium: TraceMediumParameters,
    loaded: LoadedScenario,
    streams: Streams,
    gains: GainFile | None = None,
) -> Background:
    """The file's noise, `noise_dbm` where it has none; how it varies is as the scenario says, else as the file does."""
    ids = [place.id for place in places]
    said = {} if gains is None else gains.noise
    floors = np.array([said.get(node, (medium.noise_dbm, 0.0)) for node in ids]).reshape(-1, 2)
    if medium.noise is None:
        return gaussian_background(floors[:, 0], floors[:, 1], NOISE_STEP_S, ids, streams)
    replayed = medium.noise.type == "replayed"
    offset_db = np.zeros(len(ids)) if replayed else floors[:, 0] - medium.noise_dbm
    return background(medium.noise, medium.noise_dbm, offset_db, ids, streams, loaded.folder)


def _measured(
    places: Sequence[Place], medium: TraceMediumParameters, loaded: LoadedScenario, streams: Streams
) -> LinkSource:
    k7 = read_k7(loaded.folder / medium.file)
    channel = int(k7.channel.min()) if medium.channel is None else medium.channel
    _check_recording(places, medium, loaded, k7, channel)
    rounds = rounds_of(k7, channel, [place.id for place in places])
    loop_s = k7.duration_s if medium.at_end == "loop" else None
    delivery = ReplayedRatios(rounds, medium.start_s, medium.speed, loop_s)
    noise = _noise(places, medium, loaded, streams)
    receivers = Receivers(places, noise, None)

    def links() -> Links:
        senders = np.repeat(np.array(list(rounds), np.int64), [len(each.listeners) for each in rounds.values()])
        listeners = np.concatenate([np.empty(0, np.int64), *(each.listeners for each in rounds.values())])
        rssi_dbm = np.concatenate([np.empty(0), *(each.rssi_dbm for each in rounds.values())])
        return _by_index(places, senders, listeners, rssi_dbm - medium.transmit_power_dbm)

    def quality(links: Links) -> Quality:
        """Every link whole, in the order in which the recording has them: senders, then listeners, ascending."""
        prr = np.concatenate([np.empty(0), *(delivery.ratios(sender, 0) for sender in sorted(rounds))])
        return receivers.quality(links)._replace(decodable=np.ones(len(prr), bool), prr=prr)

    return LinkSource(positions_m(places), links, quality, noise, delivery=delivery)


def _by_index(places: Sequence[Place], source: Ints, destination: Ints, gain_db: Array) -> Links:
    """Links between node ids as links between nodes of the scenario, without those of other nodes."""
    ids = np.array([place.id for place in places])
    known = np.isin(source, ids) & np.isin(destination, ids)
    return sorted_links(
        [Links(np.searchsorted(ids, source[known]), np.searchsorted(ids, destination[known]), gain_db[known])]
    )


def _check_ids(
    places: Sequence[Place], medium: TraceMediumParameters, loaded: LoadedScenario, known: Iterable[int]
) -> None:
    """Refuse nodes that the file does not know: they would be mute for no stated reason."""
    ids = sorted(known)
    strangers = sorted({place.id for place in places}.difference(ids))
    if not strangers:
        return
    expected = (
        f"a file that knows every node of the scenario; {medium.file} knows {len(ids)}, ids {ids[0]} to {ids[-1]}"
    )
    named = ", ".join(map(str, strangers[:5])) + (", ..." if len(strangers) > 5 else "")
    remedy = "give fewer nodes, or number them as in the file with a placement of type csv"
    finding = loaded.document.finding(("medium", "file"), expected, f"no line about node {named}", remedy)
    raise ScenarioError([finding])


def _check_recording(
    places: Sequence[Place], medium: TraceMediumParameters, loaded: LoadedScenario, k7: K7, channel: int
) -> None:
    """Refuse what the recording cannot answer: another channel, other nodes, other transmit powers, a time after its end."""
    finding, file = loaded.document.finding, medium.file
    channels = np.unique(k7.channel).tolist()
    if channel not in channels:
        listed = ", ".join(map(str, channels))
        raise ScenarioError([finding(("medium", "channel"), f"a channel in {file}: {listed}", str(channel))])
    if medium.start_s >= k7.duration_s:
        expected = f"a time within the recording, which lasts {k7.duration_s:g} s"
        raise ScenarioError([finding(("medium", "start_s"), expected, f"{medium.start_s:g}")])
    _check_ids(places, medium, loaded, {*k7.source.tolist(), *k7.destination.tolist()})
    power_dbm = medium.transmit_power_dbm
    other = {place.group_index: place for place in places if place.group.tx_power_dbm != power_dbm}
    if other:
        expected = f"{power_dbm:g} dBm, at which {file} was recorded: its delivery ratios hold for no other power"
        remedy = f"set it to {power_dbm:g}, or medium.transmit_power_dbm to what the recording was made with"
        raise ScenarioError(
            [
                finding(("nodes", index, "tx_power_dbm"), expected, f"{place.group.tx_power_dbm:g} dBm", remedy)
                for index, place in sorted(other.items())
            ]
        )

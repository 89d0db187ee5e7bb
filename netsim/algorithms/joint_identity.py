"""A leader's part in who is who: evidence of its sensor, and words with the leaders it is acquainted with.

Words go to the leaders of the acquaintance group alone, and hold all that the sender knows. Who changes its copy tells all
others; who knows of more tracks or later starts than a sender tells it in turn. What is lost is sent again, and what never
arrives comes with the next word; meanwhile every copy is consistent by itself (see `joint_acquaintances`).
"""

import json
from collections.abc import Collection
from dataclasses import replace

from netsim.algorithms.charging import charge
from netsim.algorithms.joint_acquaintances import Acquaintances, of_tracks
from netsim.algorithms.joint_changes import Place
from netsim.algorithms.joint_evidence import Evidence
from netsim.algorithms.joint_identity_messages import Word, decode_heard, decode_word, encode_heard, encode_word
from netsim.algorithms.joint_location import Whereabouts, ask
from netsim.algorithms.joint_messages import Held
from netsim.algorithms.joint_station import Station
from netsim.api import Message, Op
from netsim.kernels import identity
from netsim.kernels.semiring import FloatArray
from netsim.trace.events import AlgorithmRecord

WORD, HEARD = "word", "heard"
IDENTITY = "identity"
"""Kind of the records of what becomes of identities: their `event` is one of those below."""
MET, EVIDENCE, REFUSED, HEARD_OF, RECOVERED, UNANSWERED, CONTRADICTED = (
    "met",
    "evidence",
    "refused",
    "heard",
    "recovered",
    "unanswered",
    "contradicted",
)
_MOST_PASSED = 64
_MANY_CHANGES = 16


class Identities:
    """What a node knows of the identities of the tracks it leads."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self.whereabouts = Whereabouts(station)
        self._copies: list[Acquaintances] = []
        """Of different groups; together they hold every track led here."""
        self._led: dict[int, int] = {}
        """Tracks led here, with their turns."""
        self.evidence = Evidence(station, self._known_of_led, self._apply, self._refuse)
        self._due: set[int] = set()
        """Tracks whose leaders are to be told."""
        self._telling: set[int] = set()
        self._silent: set[int] = set()
        """Tracks whose leaders were given up, and have not been heard of since: perhaps the track has ended."""
        self._shared: dict[int, Acquaintances] = {}
        """What was told to a track's leader, or by it."""
        self._number = 0

    def fresh(self, held: Held) -> Held:
        """A group with what is known of its identities now."""
        copy = of_tracks(self._copies, held.tracks[0])
        return held if copy is None else replace(held, known=copy)

    def lead(self, held: Held) -> None:
        """This node leads a group from now on."""
        self._absorb(held.known)
        for track in held.tracks:
            self._led[track] = held.turn
            copy = self._copy(track)
            self._put(copy.located(track, Place(held.turn, self._station.node.id)))
            self.whereabouts.took(track, held.turn)

    def recover(self, held: Held) -> None:
        """Lead a group that nobody gave, perhaps of a leader that has fallen silent, and tell its acquaintances."""
        self.lead(held)
        if held.turn > 0:
            self._tell_record(RECOVERED, held.tracks, self._copy(held.tracks[0]))
        self._shared.clear()
        self._tell_all(self._copy(held.tracks[0]))

    def meet(self, held: Held) -> None:
        """Tracks led here have met and part: what `parts_of` has made of what is known."""
        self._absorb(held.known)
        copy = self._copy(held.tracks[0])
        self._tell_record(MET, copy.tracks, copy)
        self._tell_all(copy)

    def leave(self, tracks: Collection[int], place: Place | None = None, given: Acquaintances | None = None) -> None:
        """Another node leads some tracks, or nobody.

        Args:
            tracks: Which.
            place: To whom they were given; None where they have ended.
            given: What it was given; what has become known since is sent after it.
        """
        for track in tracks:
            self._led.pop(track, None)
            self.evidence.forget(track)
            if place is not None:
                self.whereabouts.left(track, place)
                copy = of_tracks(self._copies, track)
                if copy is not None:
                    self._put(copy.located(track, place))
        copy = of_tracks(self._copies, min(tracks))
        if given is not None and copy is not None:
            self._shared |= dict.fromkeys(tracks, given)
            self._tell(min(tracks))
        if not self._telling:
            self._copies = [copy for copy in self._copies if set(copy.tracks) & set(self._led)]

    def hear(self, message: Message) -> None:
        """A word for the leader of a track: this node, or one to whom it has given the track."""
        word = decode_word(message.payload)
        node = self._station.node
        if word.track not in self._led:
            receiver = self.whereabouts.next_of(word.track)
            if receiver is not None and word.passed < _MOST_PASSED:
                payload = encode_word(replace(word, passed=word.passed + 1))
                node.send(receiver, WORD, payload, causes=[message])
            return
        if word.origin != node.id:
            heard = encode_heard(word.number, word.track, self._led[word.track])
            node.send(word.origin, HEARD, heard, causes=[message])
        self._take_in(word)

    def _take_in(self, word: Word) -> None:
        own = self._copy(word.track)
        both = own.merged(word.known)
        if both is None:
            self._choose(own, word)
            return
        self._absorb(word.known)
        self._share(both, word)
        if both.state != own.state:
            self._station.node.spawn(self._charged(both))
            self._tell_record(HEARD_OF, (word.track,), self._copy(word.track))
        if (both.tracks, both.epochs) == (word.known.tracks, word.known.epochs):
            return  # changes that the sender does not know are on their way to it from their authors
        if both.tracks != own.tracks:
            self._tell_all(both)
        else:
            for track in both.tracks:
                if both.place(track).leader == word.origin:
                    self._tell(track)

    def _share(self, both: Acquaintances, word: Word) -> None:
        """The sender knows what it says, and what it was told: it need not be told again."""
        for track in both.tracks:
            if both.place(track).leader == word.origin:
                self._silent.discard(track)
                told = self._shared.get(track, word.known).merged(word.known)
                self._shared[track] = word.known if told is None else told

    def _choose(self, own: Acquaintances, word: Word) -> None:
        """Of two copies that contradict each other the later, larger one goes on, if it has all that is led here."""
        self._tell_record(CONTRADICTED, (word.track,), own)
        ours = set(self._led).intersection(own.tracks)
        if ours.issubset(word.known.tracks) and word.known.rank > own.rank:
            self._copies = [word.known if copy is own else copy for copy in self._copies]

    def _charged(self, copy: Acquaintances) -> Op[None]:
        """Working out a copy's rows takes what one piece of evidence takes, for each change since the start."""
        count = max(1, len(copy.changes))
        yield from charge(self._station.node, count * identity.evidence_operations(*copy.rows.shape))

    def _known_of_led(self, track: int) -> Acquaintances | None:
        return self._copy(track) if track in self._led else None

    def _refuse(self, track: int) -> None:
        self._tell_record(REFUSED, (track,), self._copy(track))

    def _apply(self, track: int, likelihood: FloatArray) -> None:
        """Make evidence part of what is known."""
        try:
            changed = self._copy(track).learned(track, likelihood.tolist())
        except ValueError:
            self._refuse(track)
            return
        if changed.changes[-1].number in changed.refused:
            self._refuse(track)
            return
        self._put(changed)
        self._tell_record(EVIDENCE, (track,), changed)
        self._tell_all(changed)
        self._settle(changed.tracks[0])

    def _tell_all(self, copy: Acquaintances) -> None:
        for track in copy.tracks:
            self._tell(track)

    def _tell(self, track: int) -> None:
        """Tell a track's leader what is known here."""
        copy, shared = of_tracks(self._copies, track), self._shared.get(track)
        if track in self._led or (copy is not None and shared is not None and shared.knows(copy)):
            return
        self._due.add(track)
        if track not in self._telling:
            self._telling.add(track)
            self._station.node.spawn(self._told(track))

    def _told(self, track: int) -> Op[None]:
        """Words to a track's leader until it knows all that is known here, or is given up; then one row for each news."""
        station = self._station
        rounds = station.parameters.tell_rounds - 1 if track in self._silent else 0
        while track in self._due and rounds < station.parameters.tell_rounds and track not in self._led:
            self._due.discard(track)
            copy = of_tracks(self._copies, track)
            if copy is None:
                break
            if (yield from self._is_told(track, copy)):
                rounds = 0
                continue
            rounds += 1
            self._due.add(track)
            yield from station.node.pause(station.step_ns)
        self._telling.discard(track)
        if track in self._due and track not in self._led and (known := of_tracks(self._copies, track)) is not None:
            self._tell_record(UNANSWERED, (track,), known)
            self._shared.pop(track, None)
            self._silent.add(track)
        self._due.discard(track)

    def _is_told(self, track: int, copy: Acquaintances) -> Op[bool]:
        """Whether a track's leader has confirmed a word."""
        station = self._station
        self._number = number = (self._number + 1) % 2**16
        leader = yield from self.whereabouts.find(track, copy.place(track))
        if track in self._led:
            return True
        if leader == station.node.id:
            return False
        self._shared[track] = copy
        payload = encode_word(Word(number, station.node.id, track, 0, copy))

        def fits(message: Message) -> bool:
            return decode_heard(message.payload)[:2] == (number, track)

        answer = yield from ask(station, leader, WORD, payload, HEARD, fits)
        if answer is None:
            return track in self._led
        self._silent.discard(track)
        known = of_tracks(self._copies, track)
        if known is not None:
            self._put(known.located(track, Place(decode_heard(answer.payload)[2], answer.source)))
            self._settle(known.tracks[0])
        return True

    def _settle(self, track: int) -> None:
        """Many changes that all know become the start of a new era, at the leader of the lowest track.

        What another leader adds between its confirmation and the word of that is lost.
        """
        copy = of_tracks(self._copies, track)
        if copy is None or track not in self._led or len(copy.changes) < _MANY_CHANGES:
            return
        others = [self._shared.get(other) for other in copy.tracks if other not in self._led]
        if all(other is not None and other.knows(copy) for other in others):
            self._put(copy.renewed())
            self._tell_all(copy)

    def _copy(self, track: int) -> Acquaintances:
        """The copy of a track that is led here."""
        return next(copy for copy in self._copies if track in copy.tracks)

    def _absorb(self, known: Acquaintances) -> None:
        """Add what is known to the copies that share tracks with it; those that contradict it make room or a compromise."""
        apart = [copy for copy in self._copies if not set(copy.tracks) & set(known.tracks)]
        for copy in self._copies:
            if copy in apart:
                continue
            both = known.merged(copy)
            if both is None and set(copy.tracks) & set(self._led):
                both = known.reconciled(copy)
                self._tell_record(CONTRADICTED, known.tracks, both)
            known = known if both is None else both
        self._copies = [*apart, known]

    def _put(self, copy: Acquaintances) -> None:
        """Replace the copy that this one was made of."""
        self._copies = [each for each in self._copies if not set(each.tracks) & set(copy.tracks)] + [copy]

    def _tell_record(self, event: str, tracks: Collection[int], copy: Acquaintances) -> None:
        fields = {
            "event": event,
            "tracks": list(tracks),
            "group": list(copy.tracks),
            "rows": copy.rows.tolist(),
            "leaders": [place.leader for place in copy.places],
        }
        self._station.node.record(AlgorithmRecord(self._station.node.id, IDENTITY, json.dumps(fields)))

"""Parameters of joint and factored tracking."""

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from netsim.codec import FloatWidth
from netsim.parameters import NonNegative, Positive, PositiveInt, Probability, parameters

Share = Annotated[float, Gt(0), Le(1)]
Particles = Annotated[int, Ge(1), Le(0xFFFF)]
"""Two bytes of a belief that is given away say how many it names."""


@parameters
class JointTrackingParameters:
    """Groups of sensors around targets track them, each group for itself or, where targets are near each other, jointly.

    The leader of a group collects the readings within the sensing range of its targets, holds their belief as particles, and
    hands it on to the sensor nearest to them. Leaders whose groups collide merge them; a leader whose targets part splits.
    """

    type: Literal["joint-tracking"] = "joint-tracking"
    particles: Particles = 100
    """Particles of the belief of one target."""
    joint_particles: Particles = 200
    """Particles of the belief of several."""
    begin: Literal["told", "detected"] = "told"
    """How tracks begin. `told`: the problem tells a node where its target enters. `detected`: a sensor that reads a target
    and that no group has called leads it; tracks are then numbered by when and where they began, and their identity is
    open."""
    fresh_steps: Annotated[int, Ge(1)] = 3
    """For so many readings a detected track may turn out to be the double of an earlier one, and is not joined to any."""
    same_m: Positive = 45.0
    """A fresh track within this distance of an earlier one is its double, and ends."""
    switch: Literal["distance", "latched", "never", "always"] = "distance"
    """When groups track jointly. `distance`: while they collide and the estimates are at most `separate_m` apart. `latched`:
    from the collision on until the estimates are farther than that, and not again before the groups have been apart.
    `never`: each target for itself. `always`: from the first meeting on for good; groups that begin on one node have met."""
    separate_m: Positive = 140.0
    """Distance of estimates beyond which targets are tracked separately (R_separate)."""
    mixing: Literal["even", "particles"] = "even"
    """How identities mix when targets part: evenly, or by the particles' share of exchanged places, which goes to 0 or 1."""
    collect_share: Share = 0.5
    """Share of the time between readings in which readings are collected."""
    spread_share: Annotated[float, Ge(0), Le(1)] = 0.2
    """Members answer at random moments within this share of that time."""
    give_attempts: PositiveInt = 3
    """How often a belief is given to a node that does not confirm it."""
    give_s: Positive = 0.2
    """How long a confirmation is waited for; beliefs take several frames."""
    migrate_m: NonNegative = 15.0
    """The belief moves on when another sensor is nearer to the targets by more than this."""
    silence_steps: Annotated[int, Ge(1)] = 2
    """After so many readings without a word from the leader, a member near the last estimate asks it whether it still is."""
    ask_s: Positive = 0.3
    """A member takes the track over if it has no answer after so long."""
    watch_share: Share = 0.5
    """Members within this share of the sensing range take over: they are still in range when the target has gone on."""
    quiet_steps: Annotated[int, Ge(1)] = 3
    """A track ends when for so many readings no member reads a target or, of a joint group, the readings are explained
    better by one target less."""
    quiet_sd: Positive = 6.0
    """A reading above so many standard deviations of the assumed noise shows that a target is near."""
    payload: FloatWidth = "float32"
    """Precision of particles and readings on the air."""
    classify_above: Probability = 0.8
    """Confidence from which on a classification counts as evidence of identity."""
    classify_every_steps: Annotated[int, Ge(0)] = 1
    """A leader whose track is not sure who it is looks at what its sensor tells of classes every so many readings; 0: never.
    That takes a reading of its own. Only sensors of a problem with `spectrum_bins` or `labels` tell anything."""
    tell_change: Probability = 0.01
    """Evidence is collected until it changes the track's identity by so much; then the track's acquaintances are told."""
    location: Literal["forwarding", "rendezvous"] = "forwarding"
    """How leaders that are acquainted find each other after tracks have changed hands. `forwarding`: a former leader passes
    words on to whom it gave the track. `rendezvous`: the sensor nearest to a place that follows from the track's number
    is told of every new leader, and asked."""
    tell_attempts: PositiveInt = 3
    """How often in a row a word on identities is sent to a leader that does not confirm it."""
    tell_s: Positive = 0.3
    """How long its confirmation is waited for."""
    tell_rounds: PositiveInt = 5
    """After so many rows of attempts, one a reading, the leader is given up; until it is heard of, it gets one row for each
    news."""

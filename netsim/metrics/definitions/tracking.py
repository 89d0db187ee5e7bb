"""Position, set and identity errors of tracks."""

from netsim.metrics.metric import grouped

MADE_OF = "Estimate, TruthTargets"
OSPA = "Schuhmacher, Vo, Vo 2008"
GOSPA = "Rahmathullah, Garcia-Fernandez, Svensson 2017"
CLEAR_MOT = "Bernardin, Stiefelhagen 2008"
LIU = "Liu, Reich, Zhao 2002, Tables 4 and 5"

METRICS = (
    *grouped(
        "tracking: single estimates",
        (
            "estimates",
            "1",
            "",
            "Position estimates recorded by all nodes. An estimate belongs to the track that it names, one number "
            "for the whole network. The figures on tracking are missing where nobody estimated a position, or "
            "nothing is said of true targets; estimates that are not finite are left out of all.",
            MADE_OF,
        ),
        (
            "estimates_unassigned",
            "1",
            "lower",
            "Estimates of tracks that follow no target. At the instant of an estimate, all tracks with an "
            "estimate in the last 5 s are assigned to targets, one to one, so that the sum of min(error, c)^2 "
            "is least; each estimate is compared with the truth at its own instant (on a straight line between "
            "two records of the truth), and at c or more a track follows none. The cut-off c is the `cut_off_m` of a "
            "tracking problem, 10 m for any other.",
            MADE_OF,
        ),
        (
            "position_error_mean_m",
            "m",
            "lower",
            "Distance of an estimate from the target that its track follows, mean over all estimates that are "
            "assigned; null if none is. Each is below the cut-off: look at `estimates_unassigned` or at OSPA beside it.",
            MADE_OF,
        ),
        ("position_error_rms_m", "m", "lower", "Root mean square of the same.", MADE_OF),
        ("position_error_max_m", "m", "lower", "The largest of the same.", MADE_OF),
        (
            "nees_estimates",
            "1",
            "",
            "Assigned estimates that came with a positive definite covariance.",
            MADE_OF,
        ),
        (
            "nees_mean",
            "1",
            "",
            "Normalised estimation error squared e' P^-1 e of these, mean; 2 for covariances as large as the "
            "errors, more for an overconfident estimator, less too where targets are so close that the assignment "
            "finds a nearer one than the right one. Null without such estimates.",
            f"{MADE_OF}; Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2",
        ),
        (
            "nees_mean_low",
            "1",
            "",
            "Lower end of the interval in which `nees_mean` lies with probability 0.95 if the estimator is "
            "consistent and its estimates are independent: a quantile of chi-squared with 2 n degrees of freedom, "
            "over n. Successive estimates of one track are not independent; then the interval is too narrow.",
            f"{MADE_OF}; Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2",
        ),
        ("nees_mean_high", "1", "", "Its upper end.", MADE_OF),
    ),
    *grouped(
        "tracking: sets",
        (
            "ospa_mean_m",
            "m",
            "lower",
            "OSPA distance between the targets and the tracks, p = 2, c the cut-off, mean over samples. Samples are "
            "taken every second after the first estimate, and at the last instant at which a target or an "
            "estimate is recorded. A track is where its last estimate was, for 5 s at most.",
            f"{MADE_OF}; {OSPA}",
        ),
        ("ospa_last_m", "m", "lower", "The same at the last sample.", f"{MADE_OF}; {OSPA}"),
        (
            "gospa_rms_m",
            "m",
            "lower",
            "GOSPA distance between the targets and the tracks, p = 2, c the cut-off, alpha = 2, root mean square over "
            "the same samples.",
            f"{MADE_OF}; {GOSPA}, proposition 1",
        ),
        (
            "gospa_localisation_rms_m",
            "m",
            "lower",
            "Its part from tracks that are off their targets. The squares of the three parts add up to that of "
            "`gospa_rms_m`.",
            f"{MADE_OF}; {GOSPA}",
        ),
        ("gospa_missed_rms_m", "m", "lower", "Its part from targets without a track.", f"{MADE_OF}; {GOSPA}"),
        ("gospa_false_rms_m", "m", "lower", "Its part from tracks without a target.", f"{MADE_OF}; {GOSPA}"),
        ("targets_mean", "1", "", "Number of targets, mean over the samples.", MADE_OF),
        (
            "targets_missed_mean",
            "1",
            "lower",
            "Number of targets that no track follows, mean over the samples. From sample to sample a track keeps "
            "its target while it is nearer than the cut-off; the other tracks and targets are assigned as above.",
            f"{MADE_OF}; {CLEAR_MOT}",
        ),
        (
            "tracks_false_mean",
            "1",
            "lower",
            "Number of tracks that follow no target, mean over the samples.",
            f"{MADE_OF}; {CLEAR_MOT}",
        ),
        (
            "targets_followed_share",
            "1",
            "higher",
            "Share of targets that a track follows, over all samples and the targets there at each; null where "
            "none ever is.",
            f"{MADE_OF}; {CLEAR_MOT}",
        ),
        (
            "track_switches",
            "1",
            "lower",
            "How often a target is followed by another track than the last one that followed it.",
            f"{MADE_OF}; {CLEAR_MOT}",
        ),
        (
            "track_losses",
            "1",
            "lower",
            "How often a target that was followed is not for 5 s or longer; it may be found and lost again. A "
            "target that leaves is not lost.",
            MADE_OF,
        ),
    ),
    *grouped(
        "tracking: all estimates and beliefs",
        (
            "estimate_error_mean_m",
            "m",
            "lower",
            "Distance of an estimate from the nearest target there at its instant, however far, mean over all "
            "estimates at whose instant there is one: of a single target and track the error that the paper prints.",
            f"{MADE_OF}; {LIU}",
        ),
        (
            "estimate_error_mean_after_start_m",
            "m",
            "lower",
            "The same without the first estimate of each track.",
            MADE_OF,
        ),
        ("estimate_error_max_m", "m", "lower", "The largest of the former.", MADE_OF),
        (
            "estimates_lost_share",
            "1",
            "lower",
            "Share of them that are at the cut-off or farther; `targets_followed_share` tells the share of time.",
            f"{MADE_OF}, Problem",
        ),
        (
            "beliefs",
            "1",
            "",
            "Grid beliefs that nodes recorded; the figures below are missing without any.",
            "Belief",
        ),
        (
            "belief_variance_mean_m2",
            "m2",
            "lower",
            "Squared distance of a belief's cells from its mean, weighted by their probability, mean over the beliefs.",
            f"Belief; {LIU}",
        ),
        (
            "belief_variance_mean_after_start_m2",
            "m2",
            "lower",
            "The same without the first belief of each track.",
            "Belief",
        ),
        (
            "belief_cells_mean",
            "1",
            "",
            "Cells of nonzero probability of a belief, mean over the beliefs.",
            f"Belief; {LIU}",
        ),
        ("belief_cells_mean_after_start", "1", "", "The same without the first belief of each track.", "Belief"),
        (
            "belief_error_mean_after_start_m",
            "m",
            "lower",
            "Distance of a belief's mean from the nearest target at the instant of its last reading, which is its step "
            "times the problem's time between readings: without what the target moved until the belief was there. Mean "
            "over the beliefs but the first of each track; missing for another problem than tracking.",
            "Belief, TruthTargets, Problem",
        ),
        (
            "belief_age_mean_s",
            "s",
            "lower",
            "From that instant until the belief is there, for sensing, messages and computing, mean over the beliefs.",
            "Belief, Problem",
        ),
        ("belief_age_max_s", "s", "lower", "The longest such time.", "Belief, Problem"),
    ),
    *grouped(
        "tracking: identity",
        (
            "identities",
            "1",
            "",
            "Beliefs about the identity of a track, recorded by all nodes; the figures of this group are missing "
            "without any.",
            "Identity",
        ),
        (
            "identity_accuracy",
            "1",
            "higher",
            "Share of them whose most probable target (of equals the lowest number) is the one that the track "
            "follows at that instant, over those of tracks that follow one; null where none does.",
            f"Identity, {MADE_OF}",
        ),
        (
            "identity_probability_mean",
            "1",
            "higher",
            "Probability that they give to that target, mean over the same.",
            f"Identity, {MADE_OF}",
        ),
        (
            "identity_probability_last",
            "1",
            "higher",
            "The same of the last of them of each track, mean over the tracks.",
            f"Identity, {MADE_OF}",
        ),
    ),
)

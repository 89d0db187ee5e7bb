"""Graph messages, rounds, and how far the answer is from the truth and from the exact one."""

from netsim.metrics.metric import grouped

CHEN_2006 = "Chen, Wainwright, Cetin, Willsky 2006"

METRICS = (
    *grouped(
        "graph messages",
        (
            "graph_messages",
            "1",
            "lower",
            "Messages between vertices of the graphical model, whether they cross the air or stay on a node. The "
            "figures of this group are missing where no algorithm records any.",
            f"GraphMessages; {CHEN_2006}, section VI",
        ),
        (
            "graph_messages_per_sensor",
            "1",
            "lower",
            "Graph messages over the number of nodes that host variables.",
            f"GraphMessages, VariablePlacement; {CHEN_2006}, Table I",
        ),
        (
            "graph_messages_over_air",
            "1",
            "lower",
            "Graph messages whose two vertices live on different nodes.",
            "GraphMessages",
        ),
        ("graph_messages_computed", "1", "lower", "Graph messages computed, sent or not.", "GraphMessages"),
        (
            "last_news_s",
            "s",
            "lower",
            "When a graph message was last sent that differed from the one it is compared with (divergence above "
            "1e-12); 0 if none did.",
            "GraphMessages",
        ),
        (
            "graph_messages_by_round",
            "1",
            "",
            "List: graph messages sent in each round, from round 0 (the start messages) on. Figures by round are "
            "missing where rounds are not the same instant on all nodes.",
            "GraphMessages",
        ),
        (
            "senders_by_round",
            "1",
            "",
            "List: vertices that sent at least one graph message in each round, from round 0 on.",
            f"GraphMessages; {CHEN_2006}, Fig. 10",
        ),
        (
            "vertices_woken",
            "1",
            "",
            "How often a vertex sent again after one round or more of silence.",
            f"GraphMessages; {CHEN_2006}, Fig. 10",
        ),
        ("rounds", "1", "", "Number of the last round.", "GraphMessages"),
        (
            "converged_round",
            "1",
            "lower",
            "First round, 1 or later, from which on no node sent a message with a divergence above 1e-12; null "
            "when the last round still brought news.",
            "GraphMessages",
        ),
        (
            "graph_messages_until_convergence_per_sensor",
            "1",
            "lower",
            "Graph messages up to and with `converged_round` (all, where that is null or there are no common rounds), "
            "over the number of nodes that host variables.",
            "GraphMessages, VariablePlacement",
        ),
        (
            "inference_messages_until_convergence_per_sensor",
            "1",
            "lower",
            "The same without messages that carry nothing computed by the inference itself: those by which `trmp` grows its "
            "trees, votes and tells verdicts. Max-product and its kin have none such, nor do they find out that they "
            "converged.",
            f"GraphMessages, VariablePlacement; {CHEN_2006}, Table I",
        ),
        (
            "rounds_begun_late",
            "1",
            "lower",
            "How often a node began a round later than scheduled: a slow processor, a short allowance, a reboot.",
            "GraphMessages",
        ),
        ("round_lateness_max_s", "s", "lower", "By how much at most; 0 if never.", "GraphMessages"),
    ),
    *grouped(
        "loss and re-hosting",
        (
            "notices_missed",
            "1",
            "lower",
            "How often, over nodes, partners and rounds, a node did not know at the end of a round all that a partner "
            "had sent by then. These three are missing where no notices are given (`algorithm.silence`).",
            "AlgorithmRecord",
        ),
        ("repeats_asked", "1", "lower", "Requests for what was missed.", "AlgorithmRecord"),
        ("repeats_sent", "1", "lower", "Answers to such requests.", "AlgorithmRecord"),
        (
            "rehostings",
            "1",
            "",
            "How often a node took over a variable whose host it believed dead. These two are missing where no "
            "variable moved.",
            "AlgorithmRecord",
        ),
        (
            "hosts_stepped_down",
            "1",
            "",
            "How often a host gave a variable up for another that had taken it over: the first was alive after all.",
            "AlgorithmRecord",
        ),
    ),
    *grouped(
        "association",
        (
            "measurements",
            "1",
            "",
            "Measurements of all sensors, false alarms included. The figures of this group belong to the problem "
            "`association` and are missing elsewhere.",
            "TruthOrigins",
        ),
        ("sensors_that_decided", "1", "higher", "Sensors that decided at least once.", "Association"),
        (
            "association_error",
            "1",
            "lower",
            "Share of all measurements, false alarms included, that the last decision of their sensor gives to "
            "the wrong target, or wrongly calls a false alarm; those of a sensor that never decided, or decided "
            "about another number of measurements, count as wrong. Null when no sensor decided.",
            f"Association, TruthOrigins; {CHEN_2006}, section VI-A",
        ),
        (
            "association_error_target_originated",
            "1",
            "lower",
            "The same, of the measurements that come from a target.",
            "Association, TruthOrigins",
        ),
        (
            "association_error_exact_map",
            "1",
            "lower",
            "The same error of the most probable joint association, found by integer programming; null above 600 "
            "measurements and where no association is possible.",
            f"Problem, TruthOrigins; {CHEN_2006}, eq 6",
        ),
        (
            "association_error_independent",
            "1",
            "lower",
            "The same error if every sensor decided by its own measurements alone.",
            f"Problem, TruthOrigins; {CHEN_2006}, section VI-A",
        ),
        (
            "association_differs_from_exact_map",
            "1",
            "lower",
            "Share of measurements about which the last decision differs from the exact one, over the sensors "
            "that decided; null where the exact one is out of reach.",
            "Association, Problem",
        ),
        (
            "association_error_by_round",
            "1",
            "lower",
            "List: `association_error` of the decisions up to each round in which any sensor decided; a sensor "
            "that fell silent is taken at its last word.",
            "Association, TruthOrigins",
        ),
    ),
    *grouped(
        "marginals",
        (
            "marginals",
            "1",
            "",
            "By variable of a factor graph: the last recorded probability of each of its states, a list; for "
            "max-product the max-marginal, scaled to sum to one. By sensor for `association` with sum-product: "
            "after the last round, for each measurement the probability that it came from each covered target, "
            "ascending, and that it is a false alarm. The figures of this group are missing elsewhere.",
            "Marginals",
        ),
        (
            "marginals_exact",
            "1",
            "",
            "The same of the exact answer, by variable elimination; missing where that is out of reach: a table "
            "of more than 2,000,000 entries for a factor graph, 5,000,000 for `association`.",
            "Problem",
        ),
        (
            "marginal_error_linf",
            "1",
            "lower",
            "Largest absolute difference between a recorded and an exact marginal probability, over all of "
            "`marginals`; null where the exact answer is out of reach.",
            "Marginals, Problem",
        ),
        (
            "marginal_error_kl_nat",
            "nat",
            "lower",
            "Kullback-Leibler divergence D(exact || recorded), mean over the recorded variables, or over the "
            "measurements; null where it is infinite or the exact answer is out of reach.",
            "Marginals, Problem; Kullback, Leibler 1951",
        ),
    ),
)

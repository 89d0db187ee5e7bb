"""Algorithms by name: the shipped ones, and a user's own as `module:Class`."""

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, is_dataclass, make_dataclass
from pathlib import Path
from typing import Any, Literal

from netsim.algorithms.central_bayes import CentralBayes
from netsim.algorithms.central_bayes_parameters import CentralBayesParameters
from netsim.algorithms.central_map import CentralMap, CentralMapParameters
from netsim.algorithms.collect_readings import CollectReadings, CollectReadingsParameters
from netsim.algorithms.correlation_decay import CorrelationDecay
from netsim.algorithms.correlation_decay_parameters import CorrelationDecayParameters
from netsim.algorithms.idsq import Idsq
from netsim.algorithms.idsq_parameters import IdsqParameters
from netsim.algorithms.independent import Independent, IndependentParameters
from netsim.algorithms.joint_parameters import JointTrackingParameters
from netsim.algorithms.joint_tracking import JointTracking
from netsim.algorithms.message_passing import MessagePassing
from netsim.algorithms.message_passing_parameters import (
    CsmpParameters,
    CsspParameters,
    MaxProductParameters,
    SumProductParameters,
)
from netsim.algorithms.neighbour_traffic import NeighbourTraffic, NeighbourTrafficParameters
from netsim.algorithms.own_modules import forget_others, own_files, remember
from netsim.algorithms.trmp import Trmp
from netsim.algorithms.trmp_parameters import TrmpParameters
from netsim.api import Algorithm
from netsim.errors import ScenarioError
from netsim.kernels.semiring import Semiring
from netsim.parameters import parameters

GRAPHICAL = ("association", "factor-graph", "target-distribution")
"""Problems with a graphical model."""

LIU_2002 = "Liu, Reich, Zhao, EURASIP J. Applied Signal Processing 2003:4 (2003) 378-391, manuscript of 2002"
LIU_2004 = (
    "Liu, Chu, Liu, Reich, Zhao, Distributed state representation for tracking problems in sensor networks, IPSN 2004"
)
OH_2010 = "Oh, A distributed deterministic approximation algorithm for data association, 2010"
CHEN_2006 = "Chen, Wainwright, Cetin, Willsky, Mathematical and Computer Modelling 43 (2006) 1114-1135"


@dataclass(frozen=True, slots=True)
class Entry:
    """An algorithm that scenarios can name.

    Attributes:
        name: What stands under `type`.
        record: Its parameters, with a field `type`.
        make: From its parameters to what a node runs.
        summary: What it does, in one line.
        citation: Where it comes from.
        problems: Kinds of problem it can solve; empty for an algorithm that needs none.
        needs_sink: Whether it sends to a node of the role `sink`.
        roles: What roles its nodes tell the trace that they take; None where that is not known.
    """

    name: str
    record: type[Any]
    make: Callable[[Any], Algorithm]
    summary: str
    citation: str = ""
    problems: tuple[str, ...] = ()
    needs_sink: bool = False
    roles: tuple[str, ...] | None = ()


def _message_passing(semiring: Semiring) -> Callable[[Any], Algorithm]:
    return lambda record: MessagePassing(record, semiring)


SHIPPED: Mapping[str, Entry] = {
    entry.name: entry
    for entry in (
        Entry(
            "max-product",
            MaxProductParameters,
            _message_passing(Semiring.MAX),
            "loopy max-product, every message in every round",
            f"{CHEN_2006}, eq 5",
            GRAPHICAL,
        ),
        Entry(
            "sum-product",
            SumProductParameters,
            _message_passing(Semiring.SUM),
            "loopy sum-product (belief propagation), every message in every round",
            f"{CHEN_2006}, eqs 3 and 4",
            GRAPHICAL,
        ),
        Entry(
            "csmp",
            CsmpParameters,
            _message_passing(Semiring.MAX),
            "communication-sensitive max-product: messages that tell too little are kept",
            f"{CHEN_2006}, section 5",
            GRAPHICAL,
        ),
        Entry(
            "cssp",
            CsspParameters,
            _message_passing(Semiring.SUM),
            "communication-sensitive sum-product: messages that tell too little are kept",
            f"{CHEN_2006}, section 5",
            GRAPHICAL,
        ),
        Entry(
            "trmp",
            TrmpParameters,
            Trmp,
            "tree-reweighted max-product: the MAP state with proof, or an honest 'not proved'",
            f"{CHEN_2006}, section 2.3; Wainwright, Jaakkola, Willsky, IEEE Trans. Information Theory 51 (2005) 3697-3717",
            ("association", "factor-graph"),
        ),
        Entry(
            "independent",
            IndependentParameters,
            Independent,
            "every sensor decides by its own measurements alone; no messages",
            f"{CHEN_2006}, section 6.1",
            ("association",),
        ),
        Entry(
            "central-map",
            CentralMapParameters,
            CentralMap,
            "all measurements to one node, which solves the whole association exactly and tells each its part",
            f"{CHEN_2006}, eq 6; solved by HiGHS (Huangfu and Hall 2018)",
            ("association",),
            roles=("centre",),
        ),
        Entry(
            "idsq",
            IdsqParameters,
            Idsq,
            "information-driven tracking: the belief is handed from leader to leader over the air",
            f"{LIU_2002}, Table 1",
            ("tracking",),
            roles=("leader", "guard"),
        ),
        Entry(
            "central-bayes",
            CentralBayesParameters,
            CentralBayes,
            "every reading to a sink, which tracks with all of them",
            f"{LIU_2002}, section 2.2, eq 4",
            ("tracking",),
            needs_sink=True,
            roles=("centre",),
        ),
        Entry(
            "joint-tracking",
            JointTrackingParameters,
            JointTracking,
            "groups around targets, joint where these are near each other; identities apart from places",
            LIU_2004,
            ("energy-tracking",),
        ),
        Entry(
            "correlation-decay",
            CorrelationDecayParameters,
            CorrelationDecay,
            "association probabilities with certified intervals, each sensor for its own measurements",
            f"{OH_2010}, Algorithms 1 to 4",
            ("event-association",),
        ),
        Entry(
            "neighbour-traffic",
            NeighbourTrafficParameters,
            NeighbourTraffic,
            "plain traffic to the nearest neighbours, for radio and battery studies",
        ),
        Entry(
            "collect-readings",
            CollectReadingsParameters,
            CollectReadings,
            "every node senses regularly and sends its readings to a sink",
            needs_sink=True,
        ),
    )
}


@parameters
class NoParameters:
    """For an algorithm of your own that declares no `Parameters`."""


def load_own(name: str, folder: Path) -> Entry:
    """A user's algorithm, from `module:Class`. This imports the module: it runs the user's code.

    Args:
        name: As it stands under `type`.
        folder: Where the scenario lies; modules are found there or on the Python path.

    Raises:
        ScenarioError: If the module cannot be imported or the class is not an algorithm; the message says why.
    """
    module_name, _, class_name = name.partition(":")
    cls = getattr(_imported(module_name, folder), class_name, None)
    if not isinstance(cls, type) or not callable(getattr(cls, "run", None)):
        text = f"module {module_name} has no class {class_name} with a method run(node)"
        raise ScenarioError(text)
    record = getattr(cls, "Parameters", NoParameters)
    if not is_dataclass(record) or not isinstance(record, type):
        text = f"{name}: Parameters is not a record; declare it with @netsim.parameters.parameters"
        raise ScenarioError(text)
    takes_parameters = record is not NoParameters
    tagged = make_dataclass(
        record.__name__,
        [("type", Literal[name], name)],
        bases=(record,),
        frozen=True,
        kw_only=True,
        namespace={"__doc__": record.__doc__, "__module__": record.__module__},
    )
    summary = (cls.__doc__ or "no description").strip().splitlines()[0]
    return Entry(name, tagged, cls if takes_parameters else lambda _: cls(), summary, roles=None)


def _imported(module_name: str, folder: Path) -> Any:
    """Import a module with the scenario's folder first on the path."""
    where = str(folder.resolve())
    files = own_files(module_name, folder)
    forget_others(files, folder)
    sys.path.insert(0, where)
    try:
        importlib.invalidate_caches()
        module = importlib.import_module(module_name)
        remember(files, folder)
        return module
    except Exception as error:  # whatever the user's module raises while it is imported
        text = f"cannot import {module_name}: {error!r} (looked in {where} and on the Python path)"
        raise ScenarioError(text) from error
    finally:
        sys.path.remove(where)

"""What an algorithm's settings need of the problem's graphical model, as findings before anything runs."""

from collections.abc import Iterator
from typing import Any

from netsim.algorithms.message_passing_parameters import MessagePassingParameters
from netsim.errors import Finding
from netsim.problems.association import AssociationParameters
from netsim.reading import Document
from netsim.reading import Path as ValuePath
from netsim.scenario.schema import Scenario


def model_findings(scenario: Scenario, document: Document) -> Iterator[Finding]:
    """Re-hosting moves the variables of targets that sensors cover: the hybrid model alone has such beside the sensors'."""
    records: list[tuple[ValuePath, Any]] = [(("algorithm",), scenario.algorithm)]
    records += [(("nodes", index, "algorithm"), group.algorithm) for index, group in enumerate(scenario.nodes)]
    problem = scenario.problem
    if isinstance(problem, AssociationParameters) and problem.model == "hybrid":
        return
    got = f"model: {problem.model}" if isinstance(problem, AssociationParameters) else f"the problem `{problem.type}`"
    for path, record in records:
        if isinstance(record, MessagePassingParameters) and record.rehost:
            yield document.finding(
                (*path, "rehost"),
                "false, or a problem of the type association with model: hybrid, whose hosts of targets can be replaced",
                f"rehost: true with {got}",
                "leave rehost out, or choose that model",
            )

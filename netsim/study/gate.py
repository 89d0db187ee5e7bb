"""Conditions under which a comparison fails: a small language, read by Python's parser but never evaluated by it.

    error_rel > 0.02
    energy_j > 1.05 * energy_j_first and not converged_round <= 20

Names are metrics of the later run; with `_first` those of the first run; with `_diff` the later less the first; with `_rel`
that over the magnitude of the first. `error` stands for the metric of the problem's error. Entries of dictionaries have
dotted names: `energy_by_state_j.radio.listen_rel`. As in Python, what `and` and `or` do not need is not looked up: of
`deaths > 0 and first_death_s < 3`, the second part asks for a first death only where a node died.
"""

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Final

from netsim.errors import ScenarioError
from netsim.metrics.catalogue import CATALOGUE, ERROR_METRICS

MOST_CHARACTERS = 1000
ERROR: Final = "error"
SUFFIXES: Final = ("_first", "_diff", "_rel")

_ARITHMETIC: Final[Mapping[type[ast.AST], Callable[[float, float], float]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_COMPARISONS: Final[Mapping[type[ast.AST], Callable[[float, float], bool]]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}

Figures = Mapping[str, Any]
"""Scalar figures by name."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """What a gate says of a run.

    Attributes:
        expression: The gate.
        failed: Whether its condition holds.
        values: The names that decided it with their values, in order.
        metrics: The metrics that these names are of.
        unjudged: Why it could not be judged on all that the first study was; empty if it could.
    """

    expression: str
    failed: bool
    values: Mapping[str, float]
    metrics: tuple[str, ...] = ()
    unjudged: str = ""

    @property
    def passes(self) -> bool:
        """Whether it was judged on everything, and its condition does not hold."""
        return not self.failed and not self.unjudged


@dataclass(frozen=True, slots=True)
class Gate:
    """A condition under which a comparison fails: see `parse_gate`.

    Attributes:
        expression: As written.
        tree: As read.
    """

    expression: str
    tree: ast.expr

    def judge(self, later: Figures, first: Figures) -> Judgement:
        """Whether the condition holds between two runs.

        Args:
            later: Figures of the run judged.
            first: Those of the run it is held against.

        Raises:
            ScenarioError: If a name is none of a metric, a metric that is needed has no value in one of the runs, or
                something is divided by zero.
        """
        for name in _names(self.tree):  # a slip of the pen is told whether the name is needed or not
            if not _is_metric(name):
                _metric_of(self.expression, name, later, first)
        found = _Lookup(self.expression, later, first)
        try:
            failed = _holds(self.tree, found)
        except ZeroDivisionError as error:
            message = f"--fail-if '{self.expression}': it divides by zero; compare products instead, or use NAME_rel"
            raise ScenarioError(message) from error
        return Judgement(self.expression, failed, found.values, tuple(dict.fromkeys(found.metrics)))


class _Lookup:
    """Values of names, each found when it is first asked for."""

    def __init__(self, expression: str, later: Figures, first: Figures) -> None:
        self._expression, self._later, self._first = expression, later, first
        self.values: dict[str, float] = {}
        self.metrics: list[str] = []

    def __call__(self, name: str) -> float:
        if name not in self.values:
            metric, suffix = _metric_of(self._expression, name, self._later, self._first)
            self.values[name] = _value(self._expression, metric, suffix, self._later, self._first)
            self.metrics.append(metric)
        return self.values[name]


def parse_gate(expression: str) -> Gate:
    """Read a condition: comparisons joined by `and`, `or` and `not`, of sums and products of numbers and names.

    Raises:
        ScenarioError: If it is anything else.
    """
    if len(expression) > MOST_CHARACTERS:
        raise _refused(expression[:40] + "...", f"expected at most {MOST_CHARACTERS} characters, got {len(expression)}")
    try:
        tree = ast.parse(expression.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else str(error)
        raise _refused(expression, f"expected a comparison such as error_rel > 0.02: {reason}") from error
    _check_condition(expression, tree)
    return Gate(expression, tree)


def difference(later: float, first: float) -> float:
    """The later figure less the first."""
    return later - first


def relative(later: float, first: float) -> float:
    """The difference over the magnitude of the first figure; 0 where both are 0, infinite where only the first is."""
    if first == 0:
        return 0.0 if later == 0 else math.copysign(math.inf, later)
    return (later - first) / abs(first)


def error_metric(figures: Figures) -> str | None:
    """The metric of the problem's error, by name; None where the problem has none."""
    return next((name for name in ERROR_METRICS if name in figures), None)


def is_number(value: object) -> bool:
    """Whether a figure can be reckoned with; truth values can, as 0 and 1."""
    return isinstance(value, int | float) and math.isfinite(value)


def _check_condition(expression: str, tree: ast.expr) -> None:
    if isinstance(tree, ast.BoolOp):
        for part in tree.values:
            _check_condition(expression, part)
    elif isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.Not):
        _check_condition(expression, tree.operand)
    elif isinstance(tree, ast.Compare) and all(type(op) in _COMPARISONS for op in tree.ops):
        for part in (tree.left, *tree.comparators):
            _check_term(expression, part)
    else:
        got = ast.unparse(tree)
        raise _refused(expression, f"expected a comparison by < <= > >= == or !=, got `{got}`")


def _check_term(expression: str, tree: ast.expr) -> None:
    if isinstance(tree, ast.BinOp) and type(tree.op) in _ARITHMETIC:
        _check_term(expression, tree.left)
        _check_term(expression, tree.right)
    elif isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub | ast.UAdd):
        _check_term(expression, tree.operand)
    elif _name_of(tree) is None and not (isinstance(tree, ast.Constant) and type(tree.value) in (int, float)):
        raise _refused(expression, f"expected numbers, names and + - * /, got `{ast.unparse(tree)}`")


def _name_of(tree: ast.expr) -> str | None:
    """The dotted name that an expression is; None if it is something else."""
    if isinstance(tree, ast.Name):
        return tree.id
    if isinstance(tree, ast.Attribute) and (above := _name_of(tree.value)) is not None:
        return f"{above}.{tree.attr}"
    return None


def _names(tree: ast.expr) -> Iterator[str]:
    name = _name_of(tree)
    if name is not None:
        yield name
        return
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.expr):
            yield from _names(child)


def _holds(tree: ast.expr, value_of: _Lookup) -> bool:
    if isinstance(tree, ast.BoolOp):
        parts = (_holds(part, value_of) for part in tree.values)
        return all(parts) if isinstance(tree.op, ast.And) else any(parts)
    if isinstance(tree, ast.UnaryOp):
        return not _holds(tree.operand, value_of)
    if not isinstance(tree, ast.Compare):  # which `parse_gate` does not let through
        raise _refused(ast.unparse(tree), "expected a comparison")
    terms = [_reckoned(part, value_of) for part in (tree.left, *tree.comparators)]
    return all(_COMPARISONS[type(op)](a, b) for op, a, b in zip(tree.ops, terms, terms[1:], strict=False))


def _reckoned(tree: ast.expr, value_of: _Lookup) -> float:
    name = _name_of(tree)
    if name is not None:
        return value_of(name)
    if isinstance(tree, ast.BinOp):
        return _ARITHMETIC[type(tree.op)](_reckoned(tree.left, value_of), _reckoned(tree.right, value_of))
    if isinstance(tree, ast.UnaryOp):
        inner = _reckoned(tree.operand, value_of)
        return -inner if isinstance(tree.op, ast.USub) else inner
    return float(ast.literal_eval(tree))


def _value(expression: str, metric: str, suffix: str, later: Figures, first: Figures) -> float:
    if suffix == "_first":
        return _number(expression, metric, first, "the first run")
    value = _number(expression, metric, later, "the later run")
    if not suffix:
        return value
    base = _number(expression, metric, first, "the first run")
    return difference(value, base) if suffix == "_diff" else relative(value, base)


def _is_metric(name: str) -> bool:
    """Whether a name is of a metric that any run may have, or of an entry of one."""
    stems = {name, *(name.removesuffix(suffix) for suffix in SUFFIXES)}
    return any(stem in CATALOGUE or stem == ERROR for stem in stems)


def _metric_of(expression: str, name: str, later: Figures, first: Figures) -> tuple[str, str]:
    """The metric that a name is of, and the suffix that says what of it."""
    known = {**first, **later}
    for suffix in ("", *SUFFIXES):
        if name.endswith(suffix):
            stem = name.removesuffix(suffix)
            metric = error_metric(known) if stem == ERROR and ERROR not in known else stem
            if metric is None:
                raise _refused(expression, "`error` stands for the problem's error, but the runs have no such metric")
            if metric in known:
                return metric, suffix
    stem, suffix = next(((name.removesuffix(each), each) for each in SUFFIXES if name.endswith(each)), (name, ""))
    near = [f"{each}{suffix}" for each in get_close_matches(stem, [*known, ERROR], n=3)]
    remedy = f"did you mean {' or '.join(near)}?" if near else "metrics.json names the metrics"
    raise _refused(expression, f"expected the name of a metric, got `{name}`; {remedy}")


def _number(expression: str, metric: str, figures: Figures, whose: str) -> float:
    value = figures.get(metric)
    if not is_number(value):
        got = "no value" if value is None else repr(value)
        raise _refused(expression, f"expected {metric} to be a number, but in {whose} it is {got}")
    return float(figures[metric])


def _refused(expression: str, why: str) -> ScenarioError:
    return ScenarioError(f"--fail-if '{expression}': {why}")

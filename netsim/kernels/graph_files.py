"""Factor graphs from text: the UAI format for Markov networks and the factor-graph format of libDAI.

Both are whitespace-separated numbers. UAI: `MARKOV`, number of variables, their cardinalities, number of factors, a
scope each, then a table each with the last variable fastest. libDAI: number of factors, then for each one the number of
variables, their labels, their cardinalities, the number of non-zero entries, and those as index and value with the
first variable fastest; `#` starts a comment.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from netsim.errors import Finding, ScenarioError
from netsim.kernels.factor_graph import Factor, FactorGraph
from netsim.kernels.injections import STATE_LIMIT
from netsim.kernels.semiring import FloatArray


@dataclass(slots=True)
class _Words:
    """The words of a file one by one, with the line of the last one for error messages."""

    name: str
    words: Iterator[tuple[int, str]]
    line: int = field(default=1)

    def next(self, path: str, expected: str) -> str:
        """The next word; `path` says what it is for."""
        found = next(self.words, None)
        if found is None:
            self.refuse(path, expected, "the end of the file")
        self.line, word = found
        return word

    def integer(self, path: str, low: int, high: int | None = None) -> int:
        """The next word as a whole number in [low, high]."""
        expected = f"a whole number of {low} or more" if high is None else f"a whole number from {low} to {high}"
        word = self.next(path, expected)
        if not (word.isascii() and word.isdigit() and low <= int(word) and (high is None or int(word) <= high)):
            self.refuse(path, expected, repr(word))
        return int(word)

    def value(self, path: str) -> float:
        """The next word as a finite number of 0 or more."""
        word = self.next(path, "a number of 0 or more")
        try:
            number = float(word)
        except ValueError:
            number = float("nan")
        if not 0.0 <= number < float("inf"):
            self.refuse(path, "a number of 0 or more", repr(word))
        return number

    def end(self) -> None:
        """Nothing may follow."""
        found = next(self.words, None)
        if found is not None:
            self.line = found[0]
            self.refuse("", "the end of the file", repr(found[1]))

    def refuse(self, path: str, expected: str, got: str) -> NoReturn:
        """Stop here: the last word was not what it should be."""
        raise ScenarioError([Finding(self.name, self.line, path, expected, got)])

    def check_scope(self, path: str, scope: tuple[int, ...], sizes: tuple[int, ...]) -> None:
        """Refuse repeated variables and tables that would fill the memory."""
        if len(set(scope)) != len(scope):
            self.refuse(path, "each variable once", str(scope))
        if np.prod([float(size) for size in sizes]) > STATE_LIMIT:
            self.refuse(path, f"a table of at most {STATE_LIMIT} entries", "x".join(map(str, sizes)))


def _words(text: str, name: str, comment: str = "") -> _Words:
    def split() -> Iterator[tuple[int, str]]:
        for number, line in enumerate(text.splitlines(), start=1):
            for word in (line.split(comment)[0] if comment else line).split():
                yield number, word

    return _Words(name, split())


def parse_uai(text: str, name: str) -> FactorGraph:
    """Read a Markov network in UAI format.

    Args:
        text: The file's content.
        name: Its name, for error messages.

    Raises:
        ScenarioError: With file, line, what was expected and what was found.
    """
    words = _words(text, name)
    head = words.next("type", "MARKOV")
    if head != "MARKOV":
        words.refuse("type", "MARKOV", repr(head))
    count = words.integer("number of variables", 0)
    cards = tuple(words.integer(f"cardinality of variable {variable}", 1) for variable in range(count))
    scopes = [_uai_scope(words, index, cards) for index in range(words.integer("number of factors", 0))]
    factors = tuple(Factor(scope, _uai_table(words, index, scope, cards)) for index, scope in enumerate(scopes))
    words.end()
    return FactorGraph(cards, factors)


def _uai_scope(words: _Words, index: int, cards: tuple[int, ...]) -> tuple[int, ...]:
    path = f"variables of factor {index}"
    scope = tuple(words.integer(path, 0, len(cards) - 1) for _ in range(words.integer(path, 0, len(cards))))
    words.check_scope(path, scope, tuple(cards[variable] for variable in scope))
    return scope


def _uai_table(words: _Words, index: int, scope: tuple[int, ...], cards: tuple[int, ...]) -> FloatArray:
    path, shape = f"table of factor {index}", tuple(cards[variable] for variable in scope)
    size = int(np.prod(shape, dtype=np.int64))
    words.integer(f"size of the {path}", size, size)
    return np.array([words.value(path) for _ in range(size)]).reshape(shape)


def parse_libdai(text: str, name: str) -> FactorGraph:
    """Read a factor graph in libDAI's format. Labels that occur in no factor become variables with one state.

    Args:
        text: The file's content.
        name: Its name, for error messages.

    Raises:
        ScenarioError: With file, line, what was expected and what was found.
    """
    words = _words(text, name, "#")
    cards: dict[int, int] = {}
    factors = tuple(_libdai_factor(words, index, cards) for index in range(words.integer("number of factors", 0)))
    words.end()
    return FactorGraph(tuple(cards.get(label, 1) for label in range(max(cards, default=-1) + 1)), factors)


def _libdai_factor(words: _Words, index: int, cards: dict[int, int]) -> Factor:
    path = f"factor {index}"
    count = words.integer(f"number of variables of {path}", 0)
    scope = tuple(words.integer(f"variables of {path}", 0, STATE_LIMIT) for _ in range(count))
    sizes = tuple(words.integer(f"cardinalities of {path}", 1) for _ in range(count))
    words.check_scope(f"variables of {path}", scope, sizes)
    for label, size in zip(scope, sizes, strict=True):
        if cards.setdefault(label, size) != size:
            words.refuse(f"cardinalities of {path}", f"{cards[label]} states of variable {label}", str(size))
    flat = np.zeros(int(np.prod(sizes, dtype=np.int64)))
    for _ in range(words.integer(f"number of entries of {path}", 0, len(flat))):
        entry = words.integer(f"index of an entry of {path}", 0, len(flat) - 1)
        flat[entry] = words.value(f"value of entry {entry} of {path}")
    return Factor(scope, flat.reshape(sizes, order="F"))

"""Words for YAML syntax errors: the parser's own, turned into what was expected and what to do."""

from ruamel.yaml.error import MarkedYAMLError

from netsim.errors import Finding
from netsim.reading.scalars import show

# What the parser says, what it would have needed, what usually helps. The first line that
# matches counts; no advice means `_INDENT`.
_ADVICE = (
    ("character '\\t'", "spaces for indentation", "replace each tab by spaces"),
    ("could not find expected ':'", "`key: value`", "put a colon and a space after the key"),
    ("mapping values are not allowed", "one `key: value` a line", ""),
    ("expected ',' or ']'", "`,` or `]` in a list", "close the list with `]`"),
    ("expected ',' or '}'", "`,` or `}` in a mapping", "close the mapping with `}`"),
    ("found unexpected end of stream", "a closing quote", "close the quote that is still open"),
    ("but found ']'", "an opening bracket before `]`", "remove the bracket, or put the text in quotes"),
    ("found ']'", "a value", "remove the bracket, or put the text in quotes"),
    ("but found '}'", "an opening brace before `}`", "remove the brace, or put the text in quotes"),
    ("found '}'", "a value", "remove the brace, or put the text in quotes"),
    ("but found '<scalar>'", "the end of the value", "put a value that contains quotes in quotes of the other kind"),
    ("expected <block end>", "keys of one mapping, or items of one list, in the same column", ""),
    ("cannot start any token", "a value", "put a value that begins with a special character in quotes"),
)
_INDENT = (
    "align the line with its neighbours; a value that contains `: ` needs quotes; a key ends with a colon and a space"
)


def syntax_finding(file: str, text: str, error: MarkedYAMLError) -> Finding:
    """The one finding for a text that is no YAML.

    Args:
        file: Name of the file.
        text: Its content, to show the line in question.
        error: What the parser raised.

    Returns:
        A finding at the line where the parser stopped.
    """
    mark = error.problem_mark or error.context_mark
    line = 0 if mark is None else mark.line
    problem = error.problem or "malformed YAML"
    for pattern, expected, remedy in _ADVICE:
        if pattern in problem:
            return Finding(file, line + 1, "", expected, _shown(text, line), remedy or _INDENT)
    return Finding(file, line + 1, "", "YAML", _shown(text, line), str(problem))


def _shown(text: str, line: int) -> str:
    lines = text.splitlines()
    return show(lines[line].expandtabs(4).strip()) if line < len(lines) else "the end of the file"

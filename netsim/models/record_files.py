"""Reading of a YAML file into a parameter record."""

from pathlib import Path
from typing import TypeVar

from pydantic import TypeAdapter, ValidationError
from ruamel.yaml import YAML

from netsim.errors import Finding, ScenarioError

T = TypeVar("T")


def read_record(path: Path, record_type: type[T]) -> T:
    """The record in a file; raises ScenarioError with every finding."""
    content = YAML(typ="safe").load(path)
    try:
        return TypeAdapter(record_type).validate_python(content, strict=False)
    except ValidationError as error:
        raise ScenarioError([_finding(path, detail) for detail in error.errors()]) from error


def _finding(path: Path, detail: object) -> Finding:
    return Finding(file=str(path), line=1, path=str(detail), expected="a valid table", got="another")

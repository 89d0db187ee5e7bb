"""From files to parameter records: YAML with line numbers, `extends`, overrides, and every error at once.

    document = read_document("scenario.yaml", overrides=["medium.exponent=3.5"])
    scenario = validate(document, Scenario)

Records are declared with `netsim.parameters.parameters`; nothing here knows a concrete one.
"""

from netsim.reading.checks import Resolver, Resolvers, Unknown, check_document, findings, validate
from netsim.reading.document import OVERRIDE, Document, Node, Path, path_text
from netsim.reading.dump import Namers, dump_yaml, to_plain
from netsim.reading.files import read_document, read_record
from netsim.reading.overlays import apply_override, assign, is_assignable, keys_of, overlay
from netsim.reading.parse import parse
from netsim.reading.reference import FieldRow, field_reference
from netsim.reading.schema import OpenTypes, json_schema

__all__ = [
    "OVERRIDE",
    "Document",
    "FieldRow",
    "Namers",
    "Node",
    "OpenTypes",
    "Path",
    "Resolver",
    "Resolvers",
    "Unknown",
    "apply_override",
    "assign",
    "check_document",
    "dump_yaml",
    "field_reference",
    "findings",
    "is_assignable",
    "json_schema",
    "keys_of",
    "overlay",
    "parse",
    "path_text",
    "read_document",
    "read_record",
    "to_plain",
    "validate",
]

"""Levels of one label are told before anything runs, by the rule by which tables match levels."""

import json

import pytest

from netsim.reading import check_document, parse
from netsim.study.findings import study_findings
from netsim.study.schema import Study

HEAD = {"kind": "study", "schema_version": 1, "name": "s", "question": "?", "scenario": "base.yaml"}


def findings_of(values):
    text = json.dumps({**HEAD, "sweep": [{"path": "algorithm.tolerance", "values": values}]})
    document = parse(text, "study.yaml")
    study, findings = check_document(document, Study)
    assert findings == []
    return study_findings(study, document)


@pytest.mark.parametrize(
    ("values", "label"), [([1, 1.0], "1"), ([True, "true"], "true"), ([None, "null"], "null"), (["a", "a"], "a")]
)
def test_levels_that_no_table_could_tell_apart_are_refused(values, label):
    (finding,) = findings_of(values)
    assert (finding.expected, finding.got) == ("settings that are called differently", f"`{label}` twice")


@pytest.mark.parametrize("values", [[1, 2.5, "1.0"], [True, 1], [0, False, None]])
def test_levels_of_different_labels_are_accepted(values):
    assert findings_of(values) == []

"""The sections of `netsim list`."""

from typing import Literal

Section = Literal[
    "algorithms",
    "problems",
    "media",
    "macs",
    "networks",
    "nodes",
    "batteries",
    "devices",
    "radios",
    "processors",
    "faults",
    "scenarios",
    "studies",
    "metrics",
]

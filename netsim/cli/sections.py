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
    "faults",
    "scenarios",
    "studies",
    "metrics",
]

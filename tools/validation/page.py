"""What the sections share: the look of the plots, Markdown tables, where things lie."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "validation"
DATA = Path(os.environ.get("NETSIM_DATA", ROOT.parent / "shared" / "data"))

BLUE, ORANGE, GREEN, GREY, RED = "#2166ac", "#e08214", "#1b7837", "#737373", "#b2182b"

mpl.rcParams.update(
    {
        "figure.dpi": 110,
        "savefig.dpi": 150,
        "font.size": 10,
        "axes.grid": True,
        "grid.alpha": 0.25,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "legend.frameon": False,
        "axes.titlesize": 11,
        "axes.titlelocation": "left",
        "svg.hashsalt": "netsim",
    }
)


def axes(columns: int = 1, width: float = 7.2, height: float = 4.2) -> tuple[Any, Any]:
    """A figure and its axes side by side."""
    return plt.subplots(1, columns, figsize=(width, height), layout="constrained")


def save(figure: Any, name: str, alternative: str) -> str:
    """Write a picture; returns the Markdown that shows it. No date or version goes into the file."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURES / f"{name}.png", metadata={"Software": None})
    plt.close(figure)
    return f"![{alternative}](validation/{name}.png)\n"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; all columns but the first are aligned right."""
    lines = ["| " + " | ".join(header) + " |", "| --- |" + " ---: |" * (len(header) - 1)]
    lines += ["| " + " | ".join(map(str, row)) + " |" for row in rows]
    return "\n".join(lines) + "\n"

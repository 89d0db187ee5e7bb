"""Make docs/validation.md and its plots: one command, some minutes.

    python tools/validate.py [--only SECTION ...] [--ns3 PYTHON]

Needs netsim with its `test` extra. Measurements are looked for in NETSIM_DATA (default `../shared/data`); a section whose
data are missing says so. The figures of ns-3 are read from tools/ns3_reference.json; `--ns3` computes them anew first, with
the interpreter of an environment that has the `ns3` wheel (see tools/ns3_reference.py).
"""

import argparse
import json
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

PAGE = HERE.parent / "docs" / "validation.md"
SECTIONS = ("reception", "csma", "energy", "battery", "measured", "limits")
HEAD = """\
# Validation

What netsim's figures rest on: published values, ns-3 {ns3} and measurements beside what netsim gives. This page and its
plots are made by `python tools/validate.py`; the plain tests hold the same claims. Each section ends with what it does not
show.

"""


def main() -> None:
    """Make the sections asked for and put the page together; sections not asked for are kept."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=SECTIONS, help="make only these sections anew")
    parser.add_argument("--ns3", metavar="PYTHON", help="compute the figures of ns-3 anew with this interpreter")
    arguments = parser.parse_args()
    if arguments.ns3:
        subprocess.run([arguments.ns3, str(HERE / "ns3_reference.py")], check=True)
    parts = _sections_of(PAGE.read_text(encoding="utf-8")) if PAGE.is_file() else {}
    for name in arguments.only:
        begun = time.perf_counter()
        parts[name] = __import__(f"validation.{name}", fromlist=["section"]).section()
        print(f"{name}: {time.perf_counter() - begun:.1f} s", flush=True)
    ns3 = json.loads((HERE / "ns3_reference.json").read_text(encoding="utf-8"))["made_with"]["ns3"]
    body = "\n".join(f"<!-- {name} -->\n\n{parts[name].strip()}\n" for name in SECTIONS if name in parts)
    PAGE.write_text(HEAD.format(ns3=ns3) + body, encoding="utf-8")
    print(PAGE)


def _sections_of(text: str) -> dict[str, str]:
    """The page's sections by name."""
    parts = {}
    for chunk in text.split("<!-- ")[1:]:
        name, _, content = chunk.partition(" -->")
        parts[name] = content
    return parts


if __name__ == "__main__":
    main()

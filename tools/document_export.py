"""Write the tables of docs/export.md anew, from the definitions in the code; what stands above them is kept.

python tools/document_export.py
"""

from pathlib import Path

from netsim.export.sheet_document import markdown_tables

DOCUMENT = Path(__file__).parents[1] / "docs" / "export.md"
HEADING = "## Tables and their columns"

if __name__ == "__main__":
    head = DOCUMENT.read_text(encoding="utf-8").partition(f"\n{HEADING}")[0].rstrip()
    intro = "Every table but `metrics` begins with `time_s`, the simulated time at which the row was recorded."
    DOCUMENT.write_text(f"{head}\n\n{HEADING}\n\n{intro}\n\n{markdown_tables()}", encoding="utf-8")

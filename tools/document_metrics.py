"""Write the tables of docs/metrics.md anew, from the definitions in the code; what stands above them is kept.

python tools/document_metrics.py
"""

from pathlib import Path

from netsim.metrics.catalogue import markdown_table

DOCUMENT = Path(__file__).parents[1] / "docs" / "metrics.md"

if __name__ == "__main__":
    head = DOCUMENT.read_text(encoding="utf-8").partition("\n## ")[0].rstrip()
    DOCUMENT.write_text(f"{head}\n\n{markdown_table()}", encoding="utf-8")

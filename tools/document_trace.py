"""Write the topics of docs/trace-format.md anew, from the event classes; what stands above them is kept.

python tools/document_trace.py
"""

from pathlib import Path

from netsim.trace.description import markdown_topics

DOCUMENT = Path(__file__).parents[1] / "docs" / "trace-format.md"
HEADING = "\n## Topics\n"

if __name__ == "__main__":
    head = DOCUMENT.read_text(encoding="utf-8").partition(HEADING)[0].rstrip()
    DOCUMENT.write_text(f"{head}\n{HEADING}\n{markdown_topics()}", encoding="utf-8")

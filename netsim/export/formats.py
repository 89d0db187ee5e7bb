"""The formats that a trace can be exported to: one line each, and a module each that is loaded when it is asked for."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from netsim.export.job import Job, Sink

Make = Callable[[Path, Job], Sink]
"""Opens an output: where to write, and what."""


@dataclass(frozen=True, slots=True)
class Format:
    """A way to export.

    Attributes:
        module: Module of `netsim.export` that writes it.
        maker: What in the module opens an output, a `Make`.
        ending: How the name of the file, or of the files in the folder, ends.
        is_folder: Whether the output is a folder.
    """

    module: str
    maker: str
    ending: str
    is_folder: bool = False

    def load(self) -> Make:
        """What opens an output of this format.

        Raises:
            NetsimError: If a library is missing that the format needs.
        """
        make: Make = getattr(import_module(f"netsim.export.{self.module}"), self.maker)
        return make


FORMATS: dict[str, Format] = {
    "pcap": Format("pcap", "Capture", ".pcap"),
    "csv": Format("csv_tables", "csv_tables", ".csv", is_folder=True),
    "parquet": Format("parquet_tables", "parquet_tables", ".parquet", is_folder=True),
}
"""By the name of the option."""

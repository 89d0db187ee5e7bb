"""The formats that a trace can be exported to: one line each, and a module each that is loaded when it is asked for."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from netsim.errors import NetsimError
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
        opening: How to open the output, with `{path}` for its name, of a folder with `{table}` for one of its tables.
        is_folder: Whether the output is a folder.
        needs: A package that is no part of netsim's own dependencies.
        extra: The extra of netsim that brings it.
    """

    module: str
    maker: str
    ending: str
    opening: str
    is_folder: bool = False
    needs: str = ""
    extra: str = ""

    def load(self) -> Make:
        """What opens an output of this format.

        Raises:
            NetsimError: If a library is missing that the format needs.
        """
        try:
            if self.needs:
                import_module(self.needs)
        except ImportError as error:
            msg = (
                f"--{self.extra}: expected the package {self.needs.replace('_', '-')}, got none that can be imported "
                f"({error}); install it, in a checkout of netsim, with: pip install -e '.[{self.extra}]'"
            )
            raise NetsimError(msg) from error
        make: Make = getattr(import_module(f"netsim.export.{self.module}"), self.maker)
        return make


FORMATS: dict[str, Format] = {
    "pcap": Format("pcap", "Capture", ".pcap", "open it with: wireshark {path}"),
    "csv": Format(
        "csv_tables", "csv_tables", ".csv", "read it with: pandas.read_csv('{path}/{table}.csv')", is_folder=True
    ),
    "parquet": Format(
        "parquet_tables",
        "parquet_tables",
        ".parquet",
        "read it with: pandas.read_parquet('{path}/{table}.parquet')",
        is_folder=True,
    ),
    "foxglove": Format(
        "foxglove.sink",
        "FoxgloveScene",
        ".mcap",
        "open it in Foxglove or Lichtblick: 3D panel, display frame `map`",
        needs="foxglove_schemas_protobuf",
        extra="foxglove",
    ),
}
"""By the name of the option."""

"""Tables as CSV (RFC 4180): a line of names, commas, texts in quotation marks, nothing where a value is missing."""

from pathlib import Path

import pyarrow as pa
import pyarrow.csv as pc

from netsim.export.job import Job
from netsim.export.tables import Tables


def csv_tables(folder: Path, job: Job) -> Tables:
    """Opens a folder of CSV files."""
    return Tables(folder, job, _CsvFile)


class _CsvFile:
    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self._stream = path.with_suffix(".csv").open("wb")
        self._writer = pc.CSVWriter(self._stream, schema)

    def write(self, table: pa.Table) -> None:
        self._writer.write_table(table)

    def close(self) -> None:
        with self._stream:
            self._writer.close()

"""Tables as Parquet, compressed; what a column means goes with it, as metadata of its field."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from netsim.export.job import Job
from netsim.export.tables import Tables


def parquet_tables(folder: Path, job: Job) -> Tables:
    """Opens a folder of Parquet files."""
    return Tables(folder, job, _ParquetFile)


class _ParquetFile:
    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self._stream = path.with_suffix(".parquet").open("wb")
        self._writer = pq.ParquetWriter(self._stream, schema, compression="zstd")

    def write(self, table: pa.Table) -> None:
        self._writer.write_table(table)

    def close(self) -> None:
        with self._stream:
            self._writer.close()

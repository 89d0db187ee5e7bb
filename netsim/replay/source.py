"""The trace as arrays: Rerun's own reader decodes it, one batch a topic and chunk of the file."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from rerun.chunk import McapReader

from netsim.errors import TraceError
from netsim.trace.mending import mended

_DECODERS = ["ros2_reflection"]
_TIME = "message_log_time"


@dataclass(frozen=True)
class Batch:
    """Events of one topic, in order, as columns.

    Attributes:
        topic: Such as `/frames`.
        time_ns: When each was recorded.
        fields: The events' fields, an Arrow struct array.
    """

    topic: str
    time_ns: NDArray[np.int64]
    fields: pa.StructArray

    def numbers(self, name: str) -> NDArray[Any]:
        """A field of numbers, one an event."""
        return np.asarray(self.fields.field(name).to_numpy(zero_copy_only=False))

    def flags(self, name: str) -> NDArray[np.bool_]:
        """A yes-or-no field; no where the trace, made by another version, has no such field."""
        if self.fields.type.get_field_index(name) < 0:
            return np.zeros(len(self.time_ns), bool)
        return np.asarray(self.numbers(name) != 0)

    def texts(self, name: str) -> list[str]:
        """A text field."""
        return list(self.fields.field(name).to_pylist())

    def words(self, name: str) -> tuple[NDArray[np.int32], list[str]]:
        """A text field with few different values: position in the list of values, and that list."""
        encoded = pc.dictionary_encode(self.fields.field(name))
        return np.asarray(encoded.indices.to_numpy()), list(encoded.dictionary.to_pylist())

    def rows(self, name: str) -> tuple[NDArray[Any], NDArray[np.int64]]:
        """A field of sequences: all elements in a row, and the length of each sequence."""
        column = self.fields.field(name)
        lengths = pc.list_value_length(column).to_numpy(zero_copy_only=False).astype(np.int64)
        return np.asarray(column.flatten().to_numpy(zero_copy_only=False)), lengths

    def where(self, mask: NDArray[np.bool_]) -> "Batch":
        """The events that a mask picks."""
        return Batch(self.topic, self.time_ns[mask], self.fields.filter(pa.array(mask)))

    def since(self, start_ns: int) -> "Batch":
        """The events from an instant on, and the last one before it."""
        before = self.time_ns < start_ns
        return self.where(~before | ~np.append(before[1:], False))

    def from_start(self, start_ns: int) -> "Batch":
        """The events from an instant on, and the last one before it as if it had happened just then."""
        kept = self.since(start_ns)
        return Batch(self.topic, np.maximum(kept.time_ns, start_ns), kept.fields)


def batches(path: Path, topics: Sequence[str], start_ns: int, end_ns: int) -> Iterator[Batch]:
    """The events of some topics recorded in [start, end); of a trace that was cut short those that are there.

    Raises:
        TraceError: If the file is damaged.
    """
    try:
        with mended(path, warns=False) as file:
            reader = McapReader(
                file,
                timeline_type="duration",
                decoders=_DECODERS,
                include_topic_regex=[f"^{re.escape(topic)}$" for topic in topics],
                start_time_ns=start_ns,
                end_time_ns=end_ns,
            )
            for chunk in reader.stream():
                batch = chunk.to_record_batch()
                name = next((name for name in batch.schema.names if name.endswith(":message")), None)
                if name is not None and batch.num_rows:
                    times = batch.column(batch.schema.get_field_index(_TIME)).cast(pa.int64()).to_numpy()
                    rows = batch.column(batch.schema.get_field_index(name)).flatten()
                    yield Batch(str(chunk.entity_path), times, rows)
    except (RuntimeError, ValueError, OSError) as error:
        msg = f"{path}: cannot read the trace: {str(error).splitlines()[0]}"
        raise TraceError(msg) from error

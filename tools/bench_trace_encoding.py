"""Measure the two encodings that both Rerun and Foxglove decode: CDR with ROS 2 schemas, and protobuf.

The same made-up stream of frames and messages is encoded, and written into MCAP files with equal settings, by turns; the
table gives the median of CPU times. Protobuf's descriptors are made at run time from the same event classes.

    python tools/bench_trace_encoding.py --frames 20000 --listeners 8 --pairs 5
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import CompressionType, Writer

from netsim.trace import cdr
from netsim.trace.events import Event, Frame, MessageDelivered, MessageSent

EVENTS: tuple[type[Event], ...] = (Frame, MessageSent, MessageDelivered)
CHUNK_SIZE_BYTE = 4 * 1024 * 1024
Encode = Callable[[Any], bytes]
Schemas = Callable[[type[Event]], tuple[str, str, str, bytes]]


def stream(frames: int, listeners: int, seed: int) -> list[Event]:
    """Unicast frames with their listeners, one message each, as lists of plain numbers as a medium makes them."""
    rng = np.random.default_rng(seed)
    events: list[Event] = []
    for number in range(frames):
        source, destination = (int(node) for node in rng.integers(0, 50, 2))
        start_ns = 5_000_000 * number + int(rng.integers(0, 1_000_000))
        heard = rng.choice(50, listeners, replace=False).tolist()
        outcome = rng.choice([0, 1, 1, 1, 2, 3], listeners).tolist()
        rssi, sinr = rng.normal(-75, 8, (2, listeners)).tolist()
        events += [
            MessageSent(number, source, destination, "belief", 48, 1, [max(0, number - 1)]),
            Frame(
                number, start_ns, start_ns + 2_000_000, source, destination, "belief", 0, 60, 0, number, 0.0,
                heard, outcome, rssi, sinr,
            ),
            MessageDelivered(number, source, destination, "belief", 48, 1, 2_100_000),
        ]  # fmt: skip
    return events


def protobuf_classes() -> tuple[dict[type[Event], Any], bytes]:
    """A protobuf class for each event class, and the serialised descriptors."""
    kinds = descriptor_pb2.FieldDescriptorProto
    types = {
        "int64": kinds.TYPE_SFIXED64,
        "uint32": kinds.TYPE_UINT32,
        "uint8": kinds.TYPE_UINT32,
        "int32": kinds.TYPE_INT32,
        "float32": kinds.TYPE_FLOAT,
        "float64": kinds.TYPE_DOUBLE,
        "string": kinds.TYPE_STRING,
    }
    file = descriptor_pb2.FileDescriptorProto(name="netsim.proto", package="netsim", syntax="proto3")
    for event_type in EVENTS:
        message = file.message_type.add(name=event_type.__name__)
        for number, (name, wire) in enumerate(cdr.wire_types(event_type).items(), start=1):
            label = kinds.LABEL_REPEATED if wire.endswith("[]") else kinds.LABEL_OPTIONAL
            message.field.add(name=name, number=number, label=label, type=types[wire.removesuffix("[]")])
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    classes = {
        event_type: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"netsim.{event_type.__name__}"))
        for event_type in EVENTS
    }
    return classes, descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()


def protobuf_encoder(classes: dict[type[Event], Any]) -> Encode:
    """Event to protobuf bytes."""
    names = {event_type: tuple(cdr.wire_types(event_type)) for event_type in EVENTS}

    def encode(event: Any) -> bytes:
        event_type = type(event)
        values = {name: getattr(event, name) for name in names[event_type]}
        return bytes(classes[event_type](**values).SerializeToString())

    return encode


def encode_all(events: list[Event], encode: Encode) -> float:
    """CPU seconds to encode."""
    begin = time.process_time()
    for event in events:
        encode(event)
    return time.process_time() - begin


def write_all(events: list[Event], encode: Encode, schemas: Schemas, path: Path) -> float:
    """CPU seconds to encode and write a whole file."""
    begin = time.process_time()
    with path.open("wb") as out:
        writer = Writer(out, chunk_size=CHUNK_SIZE_BYTE, compression=CompressionType.ZSTD)
        writer.start()
        channels = {}
        for event_type in EVENTS:
            name, schema_encoding, message_encoding, data = schemas(event_type)
            schema = writer.register_schema(name, schema_encoding, data)
            channels[event_type] = writer.register_channel(event_type.topic, message_encoding, schema)
        for number, event in enumerate(events):
            writer.add_message(channels[type(event)], number, encode(event), number, number)
        writer.finish()
    return time.process_time() - begin


def rows(frames: int, listeners: int, pairs: int) -> Iterator[tuple[str, float, float, float, float]]:
    """Name, microseconds to encode and to write an event, bytes an event raw and in the file."""
    events = stream(frames, listeners, seed=1)
    classes, descriptors = protobuf_classes()
    rivals: dict[str, tuple[Encode, Schemas]] = {
        "CDR": (cdr.encode, lambda t: (cdr.schema_name(t), "ros2msg", "cdr", cdr.schema_text(t).encode())),
        "protobuf": (
            protobuf_encoder(classes),
            lambda t: (f"netsim.{t.__name__}", "protobuf", "protobuf", descriptors),
        ),
    }
    encoding: dict[str, list[float]] = {name: [] for name in rivals}
    writing: dict[str, list[float]] = {name: [] for name in rivals}
    sizes: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(pairs):
            for name, (encode, schemas) in rivals.items():
                path = Path(folder) / name
                encoding[name].append(encode_all(events, encode))
                writing[name].append(write_all(events, encode, schemas, path))
                sizes[name] = path.stat().st_size
    for name, (encode, _) in rivals.items():
        raw = sum(len(encode(event)) for event in events)
        scale = 1e6 / len(events)
        yield (
            name,
            statistics.median(encoding[name]) * scale,
            statistics.median(writing[name]) * scale,
            raw / len(events),
            sizes[name] / len(events),
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=20_000)
    parser.add_argument("--listeners", type=int, default=8)
    parser.add_argument("--pairs", type=int, default=5)
    options = parser.parse_args()
    print(f"{3 * options.frames} events, {options.listeners} listeners a frame, median of {options.pairs} pairs")
    print(f"{'':10}{'encode us':>12}{'write us':>12}{'raw byte':>12}{'file byte':>12}")
    for name, *numbers in rows(options.frames, options.listeners, options.pairs):
        print(f"{name:10}" + "".join(f"{number:12.2f}" for number in numbers))


if __name__ == "__main__":
    main()

"""Animated GIF: one palette for all pictures, and of each picture only what differs from the one before."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import GifImagePlugin, Image
from scipy.spatial import cKDTree

from netsim.movie.painter import Pixels

_COLOURS = 255  # one more stands for "as before"
_AS_BEFORE = 255
_BITS = 6  # of each channel that count in looking up the nearest colour
_UNCHANGED = 48  # commonest colours of the signs, and of all, that stay as they are
_WEIGHT = 0.4
_LAST_MS = 1500  # how long the last picture stays before the movie begins anew
_LOOP = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"

Indices = NDArray[np.uint8]


class Palette:
    """Up to 255 colours, and the nearest of them for every colour.

    Args:
        samples: Pictures that have the colours of all.
        signs: Small but important: part of a picture whose commonest colours stay as they are.
    """

    def __init__(self, samples: Sequence[Pixels], signs: Pixels) -> None:
        colours, counts = _counted([*samples, signs])
        if len(colours) > _COLOURS:
            kept = np.unique(np.concatenate([_commonest(*_counted([signs])), _commonest(colours, counts)]), axis=0)
            colours = _reduced(colours, counts, kept)
        self.colours: NDArray[np.uint8] = colours
        self._tree = cKDTree(colours.astype(float))
        self._nearest = np.full(1 << 3 * _BITS, -1, np.int16)  # by cell of the colour cube, filled when met

    def indices(self, pixels: Pixels) -> Indices:
        """The nearest colour of each pixel, up to two bits a channel; shape (height, width)."""
        wide = (pixels >> (8 - _BITS)).astype(np.int32)
        codes = (wide[..., 0] << 2 * _BITS) | (wide[..., 1] << _BITS) | wide[..., 2]
        found = self._nearest[codes]
        if (found < 0).any():
            self._look_up(np.unique(codes[found < 0]))
            found = self._nearest[codes]
        return np.asarray(found, np.uint8)

    def _look_up(self, codes: NDArray[np.int32]) -> None:
        """Note the colours nearest to the middles of some cells of the colour cube."""
        highest = (1 << _BITS) - 1
        cells = np.stack([codes >> 2 * _BITS, (codes >> _BITS) & highest, codes & highest], axis=1)
        middles = (cells + 0.5) * (1 << (8 - _BITS)) - 0.5
        self._nearest[codes] = self._tree.query(middles)[1]


def _counted(samples: Sequence[Pixels]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """The colours of some pictures, and how many pixels each has."""
    found = [np.unique(_packed(sample), return_counts=True) for sample in samples]
    codes, place = np.unique(np.concatenate([code for code, _ in found]), return_inverse=True)
    counts = np.zeros(len(codes), np.int64)
    np.add.at(counts, place, np.concatenate([count for _, count in found]))
    return np.stack([codes >> 16, (codes >> 8) & 255, codes & 255], axis=1).astype(np.uint8), counts


def _packed(pixels: Pixels) -> NDArray[np.int32]:
    """Each colour as one number."""
    red, green, blue = np.moveaxis(pixels.reshape(-1, 3).astype(np.int32), -1, 0)
    return np.asarray((red << 16) | (green << 8) | blue)


def _commonest(colours: NDArray[np.uint8], counts: NDArray[np.int64]) -> NDArray[np.uint8]:
    return colours[np.argsort(-counts, kind="stable")[:_UNCHANGED]]


def _reduced(colours: NDArray[np.uint8], counts: NDArray[np.int64], kept: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """At most 255 colours that stand for all, some of them unchanged.

    All weigh by a root of their area, or large areas would take the colours of small signs.
    """
    copies = np.ceil(counts**_WEIGHT).astype(np.int64)
    image = Image.fromarray(np.repeat(colours, copies, axis=0)[None])
    room = _COLOURS - len(kept)
    found = image.quantize(room, Image.Quantize.MEDIANCUT, kmeans=2).getpalette() or []
    return np.concatenate([kept, np.array(found, np.uint8).reshape(-1, 3)[:room]])


def write_gif(
    path: Path, pictures: Iterable[Pixels], samples: Sequence[Pixels], fps: float, *, signs: Pixels | None = None
) -> None:
    """Write a movie that begins anew when it is over.

    Args:
        path: Where.
        pictures: The pictures, all of one size.
        samples: Some of them, or others, that have the colours of all.
        fps: Pictures a second; GIF counts hundredths of a second, so that delays differ by one to keep the pace.
        signs: Part of a picture whose colours matter though it is small, such as the legend; None for a whole sample.
    """
    palette = Palette(samples, samples[0] if signs is None else signs)
    with path.open("wb") as stream:
        _write_pictures(stream, pictures, palette, fps)


def _write_pictures(stream: BinaryIO, pictures: Iterable[Pixels], palette: Palette, fps: float) -> None:
    before: Indices | None = None
    waiting: tuple[Indices, Indices | None] | None = None
    number = 0
    for pixels in pictures:
        now = palette.indices(pixels)
        if before is None:
            _write_header(stream, now.shape, palette)
        if waiting is not None:
            _write_picture(stream, *waiting, palette, _delay_ms(number, fps))
            number += 1
        waiting, before = (now, before), now
    if waiting is not None:
        _write_picture(stream, *waiting, palette, _LAST_MS)
        stream.write(b";")


def _delay_ms(number: int, fps: float) -> int:
    """How long a picture stays, a multiple of 10 ms, so that no error builds up."""
    begin, end = (round(100 * edge / fps) for edge in (number, number + 1))
    return 10 * (end - begin)


def _write_header(stream: BinaryIO, shape: tuple[int, ...], palette: Palette) -> None:
    height, width = shape
    table = np.zeros((256, 3), np.uint8)
    table[: len(palette.colours)] = palette.colours
    stream.write(b"GIF89a" + width.to_bytes(2, "little") + height.to_bytes(2, "little") + b"\xf7\x00\x00")
    stream.write(table.tobytes() + _LOOP)


def _write_picture(stream: BinaryIO, now: Indices, before: Indices | None, palette: Palette, delay_ms: int) -> None:
    """What changed, in the smallest rectangle that holds it."""
    if before is None:
        part, corner = now, (0, 0)
    else:
        changed = now != before
        rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
        top, bottom = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 1)
        left, right = (int(columns[0]), int(columns[-1]) + 1) if len(columns) else (0, 1)
        part = np.where(changed, now, _AS_BEFORE).astype(np.uint8)[top:bottom, left:right]
        corner = (left, top)
    image = Image.fromarray(np.ascontiguousarray(part), "P")
    image.putpalette(palette.colours.tobytes())
    for block in GifImagePlugin.getdata(image, corner, duration=delay_ms, disposal=1, transparency=_AS_BEFORE):
        stream.write(block)

"""MP4 with H.264, as players and slide programs take it; PyAV brings the encoder."""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

from netsim.errors import NetsimError
from netsim.movie.painter import Pixels

_PIXELS = "yuv420p"
# Colours as in high definition (ITU-R BT.709, limited range), and told in the file: players guess otherwise.
_BT_709, _LIMITED = 1, 1
_OPTIONS = {"crf": "20", "preset": "medium", "threads": "1", "tune": "animation"}


def check_mp4() -> None:
    """Make sure that there is an encoder.

    Raises:
        NetsimError: If there is none.
    """
    try:
        import av  # noqa: F401
    except ImportError as error:
        msg = (
            f"--mp4: expected the package av, got none that can be imported ({error}); install it, in a checkout of "
            "netsim, with: pip install -e '.[movie]', or write a --gif"
        )
        raise NetsimError(msg) from error


def write_mp4(path: Path, pictures: Iterable[Pixels], size: tuple[int, int], fps: float) -> None:
    """Write a movie: H.264, yuv420p, so the size must be even.

    Args:
        path: Where.
        pictures: The pictures.
        size: Their width and height in pixels.
        fps: Pictures a second.

    Raises:
        NetsimError: If there is no encoder.
        OSError: If it fails, or the file cannot be written.
    """
    check_mp4()
    import av

    try:
        with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
            stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1000), options=_OPTIONS)
            stream.width, stream.height, stream.pix_fmt = *size, _PIXELS
            context = stream.codec_context
            context.colorspace = context.color_primaries = context.color_trc = _BT_709
            context.color_range = _LIMITED
            for pixels in pictures:
                frame = av.VideoFrame.from_ndarray(pixels, format="rgb24")
                told = frame.reformat(format=_PIXELS, dst_colorspace=_BT_709, dst_color_range=_LIMITED)
                container.mux(stream.encode(told))
            container.mux(stream.encode())
    except av.error.FFmpegError as error:
        raise OSError(error.errno, error.strerror) from error  # to be told with the file's own name

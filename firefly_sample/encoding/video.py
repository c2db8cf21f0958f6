"""MP4 and WebM by PyAV, which brings FFmpeg's libraries: written frame by frame, and read back.

Pictures are converted with BT.709's matrix to 4:2:0, in the range 16 to 235, and the file is tagged with the
same, so that players show the colours that were drawn. Without loss (`crf` 0) the codes stay RGB and are
tagged as sRGB. The number of threads is fixed, because H.264's bytes depend on it, and no file holds a date:
the same frames give the same bytes on every machine with the same libraries.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from firefly_sample.encoding.film import Pixels
from firefly_sample.errors import FireflyError

if TYPE_CHECKING:
    from av import VideoFrame
    from av.video.stream import VideoStream

THREADS = 4
"""Threads of an encoder."""


class Codec(NamedTuple):
    """The encoders of a container.

    Attributes
    ----------
    container : str
        FFmpeg's name.
    lossy, lossless : (str, str, dict)
        An encoder, its pixel format and its options.
    crf : int
        The quality if none is chosen.
    """

    container: str
    lossy: tuple[str, str, dict[str, str]]
    lossless: tuple[str, str, dict[str, str]]
    crf: int


# mode 3 of the adaptive quantiser spends more bits on dark areas; x264 chooses algorithms by the processor
# unless it is told not to
_X264 = {"preset": "medium", "aq-mode": "3", "x264-params": "cpu-independent=1"}
_VP9 = {"deadline": "good", "cpu-used": "4", "row-mt": "1", "b": "0"}

CODECS = {
    ".mp4": Codec("mp4", ("libx264", "yuv420p", _X264), ("libx264rgb", "rgb24", _X264 | {"crf": "0"}), 18),
    ".webm": Codec(
        "webm", ("libvpx-vp9", "yuv420p", _VP9), ("libvpx-vp9", "gbrp", _VP9 | {"lossless": "1"}), 22
    ),
}
"""By suffix."""


def write_video(
    path: Path, suffix: str, frames: Iterable[Pixels], size: tuple[int, int], rate: Fraction, crf: int | None
) -> None:
    """Write frames of shape (height, width, 3) as a video; `crf` None is the default quality."""
    import av

    codec = CODECS[suffix]
    encoder, pixels, options = codec.lossless if crf == 0 else codec.lossy
    if crf != 0:
        options = options | {"crf": str(codec.crf if crf is None else crf)}
    # bitexact leaves out the names of libraries, random numbers and dates
    header = {"fflags": "bitexact"} | ({"movflags": "faststart"} if codec.container == "mp4" else {})
    try:
        with av.open(_url(path), "w", format=codec.container, container_options=header) as container:
            stream = container.add_stream(
                encoder,
                rate=rate,
                options=options | {"threads": str(THREADS), "flags": "bitexact"},
                width=size[0],
                height=size[1],
                time_base=1 / rate,
            )
            assert isinstance(stream, av.VideoStream)
            stream.pix_fmt = pixels
            _tag(stream, is_rgb=crf == 0)
            for number, image in enumerate(frames):
                picture = _as_picture(image, pixels)
                picture.pts, picture.time_base = number, 1 / rate
                container.mux(stream.encode(picture))
            container.mux(stream.encode())
    except av.FFmpegError as error:
        if isinstance(error, OSError):
            raise
        raise FireflyError(f"cannot encode {size[0]}x{size[1]} pixels as {suffix}: {error}") from error


def read_video(path: Path) -> Iterator[Pixels]:
    """Yield the frames of a video, uint8, shape (height, width, 3)."""
    import av

    number = 0
    with av.open(_url(path)) as container:
        stream = container.streams.video[0]
        for picture in container.decode(stream):
            yield _as_image(picture)
            number += 1
        if number == 0 or (stream.frames and number != stream.frames):
            raise ValueError(f"it has {number} frames that can be read, and {stream.frames} by its header")


def video_facts(path: Path) -> tuple[int, tuple[int, int], Fraction, str]:
    """Return the number of frames, the size, the frames per second and the codec of a video."""
    import av

    with av.open(_url(path)) as container:
        stream = container.streams.video[0]
        number = sum(packet.size > 0 for packet in container.demux(stream))
        rate = stream.average_rate or Fraction(0)
        return number, (stream.width, stream.height), rate, stream.codec_context.name


def _url(path: Path) -> str:
    """Return a path as FFmpeg takes it: it would read "a:b.mp4" as a file of the protocol "a"."""
    return f"file:{path}"


def _tag(stream: VideoStream, is_rgb: bool) -> None:
    """Write into the stream what its numbers mean."""
    from av.video.reformatter import ColorPrimaries, ColorRange, ColorTrc

    context = stream.codec_context
    context.color_primaries = ColorPrimaries.BT709
    context.color_trc = ColorTrc.IEC61966_2_1 if is_rgb else ColorTrc.BT709
    context.color_range = ColorRange.JPEG if is_rgb else ColorRange.MPEG
    context.colorspace = _RGB if is_rgb else _BT709


_RGB, _BT709 = 0, 1
"""FFmpeg's numbers of matrices (ITU-T H.273, matrix coefficients)."""


def _as_picture(image: Pixels, pixels: str) -> VideoFrame:
    from av import VideoFrame
    from av.video.reformatter import ColorRange, Colorspace

    picture = VideoFrame.from_ndarray(image, format="rgb24")
    if pixels != "yuv420p":
        return picture.reformat(format=pixels, threads=1)
    return picture.reformat(
        format=pixels,
        dst_colorspace=Colorspace.ITU709,
        src_color_range=ColorRange.JPEG,
        dst_color_range=ColorRange.MPEG,
        interpolation=_careful(),
        threads=1,
    )


def _as_image(picture: VideoFrame) -> Pixels:
    from av.video.reformatter import ColorRange

    # its colour tags say which matrix it has
    made = picture.reformat(
        format="rgb24", dst_color_range=ColorRange.JPEG, interpolation=_careful(), threads=1
    )
    return np.asarray(made.to_ndarray(), np.uint8)


def _careful() -> int:
    """Return how colours are converted: rounded, with all of the chroma. The default is off by 3 codes."""
    from av.video.reformatter import Interpolation as Way

    return Way.BICUBIC | Way.ACCURATE_RND | Way.FULL_CHR_H_INT | Way.FULL_CHR_H_INP | Way.BITEXACT

"""All formats of films, and the functions that check, write and read them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import IO, NamedTuple

import numpy as np

from firefly_sample.encoding.film import FINEST_RATE, Film, FilmChoices, Pixels
from firefly_sample.errors import FireflyError, MissingPackageError, OutputError, did_you_mean
from firefly_sample.extras import install_command
from firefly_sample.frame import OUTPUTS, Image

EXTRA = "video"
"""The extra of the packages that MP4 and WebM need."""


class FilmFacts(NamedTuple):
    """Facts about a film, read from its file.

    Attributes
    ----------
    frames : int
    size : (int, int)
        Width and height in pixels.
    fps : Fraction
        Frames per second, as exactly as the file's clock has them: see `Film.clock`.
    codec : str
        "h264", "vp9", "webp", "apng" or "gif".
    """

    frames: int
    size: tuple[int, int]
    fps: Fraction
    codec: str


_OF_BROWSERS = "browsers show a picture of {} for a tenth of a second"

FILMS: dict[str, Film] = {
    film.suffix: film
    for film in (
        Film(
            ".mp4",
            "H.264",
            channels=(3,),
            largest=16384,
            fastest=1000,
            why_fastest="a millisecond a frame",
            clock="exact",
            even=True,
            largest_crf=51,
            encoders=("libx264", "libx264rgb"),
        ),
        Film(
            ".webm",
            "VP9",
            channels=(3,),
            largest=16384,
            fastest=1000,
            why_fastest="it counts milliseconds",
            clock="rounded to milliseconds",
            largest_crf=63,
            encoders=("libvpx-vp9",),
        ),
        Film(
            ".webp",
            "animated WebP",
            channels=(3, 4),
            largest=16383,
            fastest=90,
            why_fastest=_OF_BROWSERS.format("10 milliseconds or less"),
            clock="rounded to milliseconds",
            has_quality=True,
        ),
        Film(
            ".apng",
            "APNG",
            channels=(3, 4),
            largest=2**20,
            fastest=90,
            why_fastest=_OF_BROWSERS.format("10 milliseconds or less"),
            clock="exact",
            always_exact=True,
        ),
        Film(
            ".gif",
            "GIF",
            channels=(3,),
            largest=65535,
            fastest=50,
            why_fastest=_OF_BROWSERS.format("less than two hundredths of a second"),
            clock="rounded to hundredths of a second",
        ),
    )
}
"""Every format of films by its suffix."""


def find_film(suffix: str) -> Film:
    """Return the format of a suffix such as ".mp4", or raise an OutputError."""
    film = FILMS.get(suffix.lower())
    if film is None:
        hint = did_you_mean(suffix.lower(), FILMS)
        raise OutputError(f"there is no film format {suffix!r}{hint}: choose from {', '.join(FILMS)}")
    return film


def check_film(suffix: str, output: str, size: tuple[int, int], count: int, choices: FilmChoices) -> None:
    """Raise an error, before anything is drawn, if `write_film` would refuse a film of `count` frames.

    OutputError names the output, the size or the choice; MissingPackageError says how to install PyAV.
    """
    film = find_film(suffix)
    _check_output(film, output)
    _check_choices(film, choices)
    film.check_size(size, choices)
    if count < 1:
        raise OutputError(f"a {film.suffix} needs at least one frame, got {count}")
    _check_package(film)


def _check_output(film: Film, output: str) -> None:
    """Raise an OutputError if a film cannot hold an output."""
    info = OUTPUTS.get(output)
    if info is None:
        raise OutputError(f"there is no output {output!r}{did_you_mean(output, OUTPUTS)}")
    able = [name for name, one in OUTPUTS.items() if one.dtype == "uint8" and one.channels in film.channels]
    if output in able:
        return
    if info.dtype == "uint8":
        why = "has one bit of alpha" if film.suffix == ".gif" else "has no alpha"
        others = " and ".join(suffix for suffix, other in FILMS.items() if info.channels in other.channels)
        fix = f"{others} have alpha; or choose from {', '.join(able)}"
    else:
        why, fix = "shows 8-bit pictures", f"choose from {', '.join(able)}, or capture into a folder"
    raise OutputError(f"a {film.suffix} {why} and cannot hold the output {output!r}: {fix}")


def _check_choices(film: Film, choices: FilmChoices) -> None:
    """Raise an OutputError that names the choice which a film does not have."""
    film.check_rate(choices)
    crf = range(film.largest_crf + 1) if film.largest_crf else None
    quality = range(1, 101) if film.has_quality else None
    for name, value, allowed in (("crf", choices.crf, crf), ("quality", choices.quality, quality)):
        if value is None:
            continue
        if allowed is None:
            takers = [
                one.suffix
                for one in FILMS.values()
                if (one.largest_crf if name == "crf" else one.has_quality)
            ]
            raise OutputError(f"{name} is for {' and '.join(takers)}, not for {film.suffix}: leave it out")
        if isinstance(value, bool) or not isinstance(value, int) or value not in allowed:
            raise OutputError(
                f"{name} must be a whole number from {allowed[0]} to {allowed[-1]} for {film.suffix}, "
                f"got {value!r}"
            )


def _check_package(film: Film) -> None:
    """Raise a MissingPackageError or an OutputError if a film cannot be written on this machine."""
    if not film.encoders:
        return
    av = import_av(film.suffix)
    for encoder in film.encoders:
        if encoder not in av.codecs_available:
            raise OutputError(
                f"the installed PyAV {av.__version__} lacks the encoder {encoder} of {film.suffix}: "
                f"run {install_command(EXTRA)}"
            )


def write_film(
    file: Path | IO[bytes],
    suffix: str,
    frames: Iterable[Image],
    size: tuple[int, int],
    choices: FilmChoices,
    progress: Callable[[int], None] | None = None,
) -> int:
    """Write frames as one film, frame by frame, and return their number.

    Parameters
    ----------
    file : Path or file
        A path, or an empty file that is open for writing and has a name in the file system. It is incomplete
        after an error: give it a temporary name, and rename it when it is whole.
    suffix : str
        The format: a key of `FILMS`.
    frames : iterable of ndarray
        uint8, shape (height, width, 3 or 4), all of the same shape.
    size : (int, int)
        Width and height of the frames.
    choices : FilmChoices
    progress : callable
        It is called after each frame, with the number of frames so far.

    Raises
    ------
    OSError
        If the file cannot be written.
    FireflyError
        If the format cannot hold the frames, or its library refuses them.
    """
    film = find_film(suffix)
    _check_choices(film, choices)
    film.check_size(size, choices)
    _check_package(film)
    given = _Given(film, size, choices, progress)
    if film.encoders:
        from firefly_sample.encoding.video import write_video

        path = file if isinstance(file, Path) else Path(file.name)
        stored = film.stored_size(size, choices)
        write_video(path, film.suffix, given.checked(frames), stored, choices.rate, choices.crf)
    else:
        from firefly_sample.encoding.animation import write_animation

        with file.open("wb") if isinstance(file, Path) else nullcontext(file) as opened:
            write_animation(opened, film.suffix, given.checked(frames), size, choices.rate, choices.quality)
    if given.number == 0:
        raise OutputError(f"a {film.suffix} needs at least one frame, got 0")
    return given.number


class _Given:
    """The frames that are given for a film: checked, padded and counted as they are taken."""

    def __init__(
        self,
        film: Film,
        size: tuple[int, int],
        choices: FilmChoices,
        progress: Callable[[int], None] | None,
    ) -> None:
        self.number = 0
        self._film, self._size, self._progress = film, size, progress
        width, height = film.stored_size(size, choices)
        self._padding = (0, height - size[1]), (0, width - size[0]), (0, 0)

    def checked(self, frames: Iterable[Image]) -> Iterator[Pixels]:
        """Yield the frames, or raise an OutputError that names the one which does not fit."""
        width, height = self._size
        channels: int | None = None
        for frame in frames:
            channels = channels or frame.shape[-1]
            expected = (height, width, channels)
            if frame.dtype != np.uint8 or frame.shape != expected or channels not in self._film.channels:
                wanted = " or ".join(map(str, self._film.channels))
                raise OutputError(
                    f"frame {self.number} of a {self._film.suffix} must be uint8 of shape ({height}, "
                    f"{width}, {wanted}), as the others are; it is {frame.dtype} of shape {frame.shape}"
                )
            # an edge that is repeated is hardly seen and takes few bytes; a black one would be seen
            padded = np.pad(frame, self._padding, mode="edge") if any(map(any, self._padding)) else frame
            yield np.ascontiguousarray(padded, np.uint8)
            self.number += 1
            if self._progress is not None:
                self._progress(self.number)


def read_film(path: Path, suffix: str | None = None, channels: int | None = None) -> Iterator[Pixels]:
    """Yield the frames of a film, uint8, shape (height, width, 3 or 4).

    Parameters
    ----------
    path : Path
    suffix : str, optional
        The format, if the file's name does not say it.
    channels : int, optional
        3 or 4 for every frame. When absent, a frame has 4 where it is not opaque, and else 3.

    Raises
    ------
    FireflyError
        If the file is damaged, or is not opaque and shall have 3 channels.
    """
    film = find_film(path.suffix if suffix is None else suffix)
    with _readable(path, film):
        if film.encoders:
            from firefly_sample.encoding.video import read_video as read
        else:
            from firefly_sample.encoding.animation import read_animation as read
        for number, frame in enumerate(read(path)):
            if channels == 4 and frame.shape[2] == 3:
                yield np.dstack([frame, np.full_like(frame[..., 0], 255)])
            elif channels == 3 and frame.shape[2] == 4:
                raise ValueError(f"its frame {number} is not opaque")
            else:
                yield frame


def film_facts(path: Path, suffix: str | None = None) -> FilmFacts:
    """Return the number of frames, the size, the rate and the codec of a film.

    `suffix` is the format if the file's name does not say it. A damaged file raises a FireflyError.
    """
    film = find_film(path.suffix if suffix is None else suffix)
    with _readable(path, film):
        if film.encoders:
            from firefly_sample.encoding.video import video_facts

            count, size, rate, codec = video_facts(path)
        else:
            from firefly_sample.encoding.animation import animation_facts

            count, size, rate, codec = animation_facts(path)
    return FilmFacts(count, size, rate.limit_denominator(FINEST_RATE), codec)


@contextmanager
def _readable(path: Path, film: Film) -> Iterator[None]:
    """Turn an error of a library into a FireflyError that names the file."""
    if film.encoders:
        import_av(film.suffix)
    try:
        yield
    except (FireflyError, MemoryError):
        raise
    except Exception as error:  # a decoder may raise anything
        raise FireflyError(f"cannot read {path} as {film.suffix}: {error}") from error


def import_av(suffix: str) -> ModuleType:
    """Return PyAV, or raise a MissingPackageError that says which films need it."""
    try:
        import av
    except ImportError as error:
        raise MissingPackageError(
            f"a {suffix} needs the package av ({error}): run {install_command(EXTRA)}, or choose "
            f"{', '.join(suffix for suffix, film in FILMS.items() if not film.encoders)}"
        ) from error
    return av

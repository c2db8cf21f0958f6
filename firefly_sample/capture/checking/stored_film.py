"""Captures that are one film: checked by the file's hash, and read as the frames of its manifest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain, count
from pathlib import Path

import numpy as np

from firefly_sample.capture.checking.report import Report
from firefly_sample.capture.checking.stored import FilmImage, StoredCapture, StoredFrame, is_film
from firefly_sample.capture.files import hash_file, pixel_hash
from firefly_sample.encoding.film import FilmChoices
from firefly_sample.encoding.films import FILMS, read_film
from firefly_sample.errors import FireflyError, MissingPackageError
from firefly_sample.frame import OUTPUTS, Image


def film_of(capture: StoredCapture) -> Path | None:
    """Return the film that a capture is; None if each of its frames has files."""
    if not is_film(capture.keys):
        return None
    return capture.root / Path(str(capture.keys["file"].get("name"))).name


def check_film(capture: StoredCapture, report: Report) -> bool:
    """Report whether a film is there, and as it was written; return whether its frames can be read.

    If its frames are those of its manifest, bit for bit, and only the file differs, that is a note.
    """
    film = film_of(capture)
    assert film is not None
    report.files += 1
    if film.exists() and not film.is_file():  # reading from a pipe would wait for ever
        report.add("missing", f"{film} is not a file", file=str(film))
        return False
    digest = hash_file(film)
    if digest is None:
        report.add("missing", f"{film} is missing", file=str(film))
        return False
    if digest == capture.keys["file"].get("sha256"):
        return True
    hashes = list[str]()
    try:
        hashes += [image.pixels for frame in film_frames(capture) for image in frame.files.values()]
    except MissingPackageError:
        raise
    except FireflyError as error:
        report.add("damaged", f"{film} is damaged: {error}", file=str(film))
        return False
    expected = [digest for entry in capture.keys["frames"] for digest in _hashes(entry)]
    if hashes == expected and _is_exact(film, capture.keys["file"]):
        report.note(
            "rewritten", f"{film} is written anew by another program, with the same pixels", [str(film)]
        )
        return True
    said = "it has other pixels" if len(hashes) == len(expected) else f"it has {len(hashes)} frames"
    report.add("changed", f"{film} is another file than its manifest says: {said}", file=str(film))
    return True


def are_same_films(ours: StoredCapture, theirs: StoredCapture) -> bool:
    """Return whether two captures are films with the same bytes and the same frames."""
    films = film_of(ours), film_of(theirs)
    if films[0] is None or films[1] is None or hash_file(films[0]) != hash_file(films[1]):
        return False
    numbers = [[frame.index for frame in capture.frames()] for capture in (ours, theirs)]
    return numbers[0] == numbers[1]


def film_frames(capture: StoredCapture) -> Iterator[StoredFrame]:
    """Decode a film, frame by frame, with the numbers that its manifest has for them.

    Raises a FireflyError where the film is damaged.
    """
    film = film_of(capture)
    assert film is not None
    output, (width, height) = _shape(capture)
    last = -1
    numbers = chain((frame.index for frame in capture.frames()), count())
    for index, picture in zip(numbers, read_film(film), strict=False):
        last = max(last + 1, index)  # a film that has been changed may have more frames than its manifest
        image = _with_channels(picture[:height, :width], OUTPUTS[output].channels)
        yield StoredFrame(last, {output: FilmImage(film, pixel_hash(image), image)}, [])


def _hashes(entry: object) -> list[object]:
    """Return the hashes of pixels in the entry of a frame."""
    found = entry.get("sha256") if isinstance(entry, dict) else None
    return list(found.values()) if isinstance(found, dict) else []


def _shape(capture: StoredCapture) -> tuple[str, tuple[int, int]]:
    """Return the output that a film shows, and its size."""
    try:
        (output,) = capture.keys["outputs"]
        width, height = map(int, capture.keys["size"])
        OUTPUTS[output]
    except (KeyError, TypeError, ValueError) as error:
        what = f"{type(error).__name__}: {error}"
        raise FireflyError(f"the manifest of {film_of(capture)} is damaged: {what}") from error
    return output, (width, height)


def _with_channels(image: Image, channels: int) -> Image:
    """Return an image with alpha where there has to be one: readers leave out an alpha that is opaque."""
    if image.shape[2] == 3 and channels == 4:
        rgba = np.full((*image.shape[:2], 4), 255, np.uint8)
        rgba[..., :3] = image
        return rgba
    return image


def _is_exact(film: Path, about: Mapping[str, object]) -> bool:
    """Return whether a film that was written like this has the bits of its frames."""
    crf, quality = (
        value if isinstance(value := about.get(name), int) else None for name in ("crf", "quality")
    )
    kind = FILMS.get(film.suffix.lower())
    return kind is not None and kind.is_exact(FilmChoices(crf=crf, quality=quality))

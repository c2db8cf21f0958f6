"""Captures that are one film: checked by the file's hash, and compared by their decoded frames."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path

from firefly_sample.capture.comparing import Limits
from firefly_sample.capture.files import hash_file
from firefly_sample.capture.pairs import Different, compare_images
from firefly_sample.capture.report import Report
from firefly_sample.capture.stored import StoredCapture
from firefly_sample.encoding.films import read_film
from firefly_sample.errors import FireflyError
from firefly_sample.frame import Image, known_output


def film_of(capture: StoredCapture) -> Path | None:
    """Return the film that a capture is; None if each of its frames has files."""
    about = capture.keys.get("file")
    entries = capture.keys["frames"]
    if not isinstance(about, dict) or not len(entries) or entries[0]["files"]:
        return None
    return capture.root / Path(str(about.get("name"))).name


def check_film(capture: StoredCapture, report: Report) -> None:
    """Report whether a film is there, and as it was written."""
    film = film_of(capture)
    if film is None:
        return
    report.files += 1
    digest = hash_file(film)
    if digest is None:
        report.add("missing", f"{film} is missing", file=str(film))
    elif digest != capture.keys["file"].get("sha256"):
        try:
            count = sum(1 for _ in read_film(film))
        except FireflyError as error:
            report.add("damaged", f"{film} is damaged: {error}", file=str(film))
            return
        said = f"it has {count} frames, now" if count != len(capture) else "it has been written anew"
        report.add("changed", f"{film} is another file than its manifest says: {said}", file=str(film))


def compare_films(
    ours: StoredCapture, theirs: StoredCapture, limits: Limits, pictures: Path | None, report: Report
) -> None:
    """Compare two captures, of which one or both are films, by what their frames show."""
    films = [film_of(one) for one in (ours, theirs)]
    if None not in films and hash_file(films[0]) == hash_file(films[1]):  # type: ignore[arg-type]
        report.frames += len(ours)
        return
    for place, (first, second) in enumerate(zip_longest(_images(ours), _images(theirs))):
        if first is None or second is None:
            lone = ours if second is None else theirs
            report.add("only", f"frames from {place} are only in {film_of(lone) or lone.root}")
            return
        report.frames += 1
        output = "color_alpha" if first.shape[-1] == second.shape[-1] == 4 else "color"
        captions = (str(films[0] or ours.root), str(films[1] or theirs.root))
        found = compare_images(output, (first, second), captions, place, limits, pictures)
        if isinstance(found, Different):
            report.add(
                found.kind,
                f"frame {place}: {output} {found.text}",
                frame=place,
                output=output,
                figures=found.figures,
                picture=found.picture,
            )


def _images(capture: StoredCapture) -> Iterator[Image]:
    """Decode the pictures of a film, or of a folder that has one picture a frame."""
    film = film_of(capture)
    if film is not None:
        yield from read_film(film, channels=_channels(capture))
        return
    for frame in capture.frames():
        if len(frame.files) != 1:
            raise FireflyError(f"{capture.root} has several images a frame, and a film has one")
        ((output, file),) = frame.files.items()
        yield file.decode(output, file.path.read_bytes())


def _channels(capture: StoredCapture) -> int:
    """Return the number of channels of the pictures that a film was made of."""
    (output,) = capture.keys["outputs"]
    return known_output(output).channels

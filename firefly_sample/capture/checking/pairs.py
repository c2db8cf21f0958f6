"""The comparison of two frames, file by file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from firefly_sample.capture.checking.comparing import Limits, by_name, measure
from firefly_sample.capture.checking.difference_picture import difference_picture, share_text
from firefly_sample.capture.checking.stored import (
    Checked,
    FilmImage,
    StoredFile,
    StoredFrame,
    check_frame,
    without_content,
)
from firefly_sample.capture.datasets.masks import image_info
from firefly_sample.errors import FireflyError, MissingPackageError
from firefly_sample.frame import Image
from firefly_sample.whole_files import open_whole


class Pair(NamedTuple):
    """Two frames with the same number."""

    expected: StoredFrame
    actual: StoredFrame


@dataclass
class Different:
    """Two images that differ; its fields are those of `firefly_sample.capture.checking.report.Problem`."""

    kind: str
    output: str
    text: str
    figures: dict[str, Any] | None = None
    picture: str | None = None


@dataclass
class Found:
    """What was found about a pair: its files against their manifests, and images that differ.

    `within` is the number of images that differ within the limits.
    """

    checked: tuple[dict[str, Checked], dict[str, Checked]]
    different: list[Different] = field(default_factory=list)
    within: int = 0


def compare_files(pair: Pair, limits: Limits, pictures: Path | None) -> tuple[Pair, Found]:
    """Compare two frames; difference pictures go into the folder `pictures`."""
    expected, actual = (check_frame(frame) for frame in pair)
    found = Found((without_content(expected), without_content(actual)))
    for output in expected:
        if output in actual:
            _compare_images(output, pair, [expected[output], actual[output]], limits, pictures, found)
    return pair, found


def _compare_images(
    output: str, pair: Pair, checked: list[Checked], limits: Limits, pictures: Path | None, found: Found
) -> None:
    expected, actual = checked
    renamed = output == "id" and pair.expected.id_names != pair.actual.id_names
    hashes = [frame.files[output].pixels for frame in pair]
    changed = any(one.kind for one in checked)
    if expected.content is None or actual.content is None:
        return
    if hashes[0] == hashes[1] and not (renamed or changed):
        return
    first, second = (
        _decoded(output, frame.files[output], one.content) for frame, one in zip(pair, checked, strict=True)
    )
    if first is None or second is None:
        text = "has other pixels, and this version cannot read it to say how many"
        found.different.append(Different("different", output, text))
        return
    if renamed and first.shape == second.shape:
        first, second = by_name(first, pair.expected.id_names, second, pair.actual.id_names)
    captions = (str(pair.expected.files[output].path), str(pair.actual.files[output].path))
    result = compare_images(output, (first, second), captions, pair.expected.index, limits, pictures)
    if isinstance(result, Different):
        found.different.append(result)
    else:
        found.within += result


def compare_images(
    output: str,
    images: tuple[Image, Image],
    captions: tuple[str, str],
    index: int,
    limits: Limits,
    pictures: Path | None,
) -> Different | bool:
    """Return how two images of a frame differ; True if they do within the limits, False if they do not.

    A picture of the difference, with these captions, goes into the folder `pictures`.
    """
    first, second = images
    if first.shape != second.shape or first.dtype != second.dtype:
        return Different("size", output, f"has {_form(first)}, now {_form(second)}")
    difference = measure(output, first, second, limits)
    if difference.is_within(limits):
        return difference.largest not in (None, 0.0) or difference.pixels > 0
    picture = None
    if pictures is not None:
        path = pictures / f"difference_{output.replace('/', '_')}_{index:06d}.png"
        _write(path, difference_picture(output, first, second, difference, captions))
        picture = str(path)
    figures = {name: getattr(difference, name) for name in ("pixels", "of", "largest", "mean", "scale")}
    text = f"differs in {difference.pixels:,} pixels ({share_text(difference)})"
    return Different("different", output, text, figures, picture)


def _decoded(output: str, file: StoredFile | FilmImage, content: bytes | None) -> Image | None:
    if content is None or image_info(output) is None:
        return None
    try:
        return file.decode(output, content)
    except MissingPackageError:
        raise
    except Exception:  # noqa: BLE001 - a decoder may raise anything; the hashes of the files are right
        return None


def _form(image: Image) -> str:
    """Return the shape of an image, for example "800x600 pixels of 3 x uint8"."""
    height, width, *channels = (*image.shape, 1, 1)[: max(3, image.ndim)]
    return f"{width}x{height} pixels of {' x '.join(map(str, channels))} x {image.dtype}"


def _write(path: Path, content: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FireflyError(f"cannot write into {path.parent}: {error.strerror or error}") from error
    with open_whole(path) as file:
        file.write(content)

"""A capture that becomes one file: a film, or a still picture.

Its frames are captured into a folder beside it, as ever, so that it can be killed and resumed. When all are
whole, they are bound into the file, its manifest is put beside it, and the folder is removed. As long as the
folder holds a capture, the file is not finished, whatever else is there.
"""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from firefly_sample.capture.files import hash_file, sync_folder
from firefly_sample.capture.folder import holds_capture, recorded_settings
from firefly_sample.capture.frames import FrameNumbers
from firefly_sample.capture.job import Driver, Job, differences
from firefly_sample.capture.layout import layout_of, names_in
from firefly_sample.capture.manifest import MANIFEST, FrameEntry, Manifest, read_manifest, write_manifest
from firefly_sample.capture.names import FileNames
from firefly_sample.encoding.film import FilmChoices
from firefly_sample.encoding.films import FILMS, check_film, write_film
from firefly_sample.encoding.formats import FORMATS, Encoding, formats_of_path
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import Image
from firefly_sample.settings import SETTINGS
from firefly_sample.whole_files import is_unfinished, open_whole

log = logging.getLogger(__name__)

STILLS = (".png", ".jpg", ".jpeg", ".exr", ".npz")
"""The endings of files that hold one frame; `FILMS` has those that hold any number."""

_OTHER_FILES = (
    *(".mov", ".m4v", ".mkv", ".avi", ".mpg", ".mpeg", ".wmv", ".flv", ".ogv", ".y4m"),
    *(".tif", ".tiff", ".bmp", ".tga", ".hdr", ".avif", ".heic", ".jxl", ".jp2", ".ppm", ".npy"),
)
"""Endings of films and pictures that captures cannot write: a folder of such a name is a mistake."""

Progress = Callable[[int, int], None]


def is_one_file(path: Path) -> bool:
    """Return whether the ending of a path names a file that a capture can become, and not a folder."""
    return path.suffix.lower() in (*STILLS, *FILMS)


def manifest_of(path: Path) -> Path:
    """Return the manifest of a file that a capture has become, ``clip.mp4.json``."""
    return path.with_name(f"{path.name}.json")


def frames_folder(path: Path) -> Path:
    """Return the folder of the frames of a file until it is whole, ``clip.mp4.frames``."""
    return path.with_name(f"{path.name}.frames")


def place_of(path: Path, is_bound: bool) -> Path:
    """Return where the frames are of a capture that is asked to be at a path."""
    return frames_folder(path) if is_one_file(path) and not is_bound else path


def earlier_settings(path: Path) -> dict[str, Any] | None:
    """Return the settings of frames that were captured before at a path; None if none can be read."""
    if not is_one_file(path):
        return recorded_settings(path)
    if holds_capture(frames_folder(path)):
        return recorded_settings(frames_folder(path))
    with suppress(FireflyError):
        settings = read_manifest(manifest_of(path)).get("settings")
        if isinstance(settings, dict):
            return {name: value for name, value in settings.items() if name in SETTINGS}
    return None


def film_choices(
    path: Path, count: int, fps: float, crf: int | None, quality: int | None, pad: bool
) -> FilmChoices | None:
    """Return how a film of `count` frames is written; None if a path names a folder or a still picture.

    Raises an OutputError if a choice makes no sense there, or nothing can be at the path.
    """
    suffix = path.suffix.lower()
    if is_one_file(path) and path.is_dir():
        raise OutputError(
            f"{path} is a folder, and a capture whose name ends in {suffix} becomes one file: move the "
            "folder away, or choose another name"
        )
    if path.name.lower() in (*STILLS, *FILMS) and not path.is_dir():
        raise OutputError(
            f"{path} is an ending without a name before it: name the file, for example clip{path.name}"
        )
    if suffix in _OTHER_FILES and not path.is_dir():
        raise OutputError(
            f"there is no format {suffix} for {path}: films are {', '.join(FILMS)}, and pictures "
            f"{', '.join(STILLS)}; a folder needs a name without such an ending"
        )
    if suffix in FILMS and not (count == 1 and formats_of_path(path)):
        return FilmChoices(fps, crf, quality, pad)
    if crf is not None or pad:
        raise OutputError(
            f"{'--crf' if crf is not None else '--pad'} is for films: name one as the output, for example "
            "-o clip.mp4"
        )
    return None


class OneFile:
    """The file that a capture becomes.

    Parameters
    ----------
    path : Path
        See `is_one_file`.
    numbers : FrameNumbers
        The frames in it.
    choices : FilmChoices, optional
        How a film is written; None for a still picture.

    Attributes
    ----------
    folder : Path
        Where the frames are until the file is whole.
    """

    def __init__(self, path: Path, numbers: FrameNumbers, choices: FilmChoices | None) -> None:
        self.path, self._numbers, self._choices = path, numbers, choices
        self.folder = frames_folder(path)
        self._manifest = manifest_of(path)
        if choices is None and len(numbers) > 1:
            raise OutputError(
                f"{path} holds one frame, and {len(numbers)} are asked for: name a folder, or a film "
                f"({', '.join(FILMS)})"
            )

    def formats(
        self, outputs: tuple[str, ...], given: str | Iterable[str] | Mapping[str, str] | None
    ) -> dict[str, str] | None:
        """Return the formats of the frames: of a film the usual ones, of a still those of its ending.

        Of several, such as exr and exr16, those that are given choose one.
        """
        if self._choices is not None:
            if given is not None:
                raise OutputError(f"{self.path} is a film, as its ending says: leave the formats out")
            return None
        kinds = [kind.name for kind in formats_of_path(self.path)]
        if given is not None:
            chosen = dict(Encoding.of(outputs, given).formats)
            if not set(kinds).issuperset(chosen.values()):
                raise OutputError(
                    f"{self.path} holds {' or '.join(kinds)}, as its ending says: choose it, or leave the "
                    "format out"
                )
            return chosen
        return {
            output: next((kind for kind in kinds if not FORMATS[kind].refusal(output)), kinds[0])
            for output in outputs
        }

    def check(self, job: Job) -> None:
        """Raise an OutputError if the file cannot hold the outputs of a job, or frames of its size."""
        held = job.encoding.files()
        if len(held) > 1:
            raise OutputError(
                f"{self.path} holds one image, and {', '.join(job.outputs)} are asked for: choose one of "
                "them, or a folder"
            )
        if self._choices is not None:
            suffix = self.path.suffix.lower()
            check_film(suffix, job.outputs[0], job.size, len(self._numbers), self._choices)

    def check_free(self) -> None:
        """Raise an OutputError if the file is there already."""
        if self.path.exists() or self._manifest.exists():
            there = self.path if self.path.exists() else self._manifest
            raise OutputError(f"{there} is there already: use --overwrite to replace it, or another name")

    def finished(self, job: Job) -> Manifest | None:
        """Return the manifest of the file if it is whole, and what a job would draw; None if it is not.

        The driver is taken to be the same: a file that is whole is not drawn again on another machine. A
        file without a manifest is nobody's capture, and an OutputError.
        """
        if holds_capture(self.folder) or not (self.path.exists() or self._manifest.exists()):
            return None
        replace = "use --overwrite to replace it, or another name"
        if not self._manifest.exists():
            raise OutputError(
                f"{self.path} is no capture that can be gone on with, because {self._manifest.name} is "
                f"missing: {replace}"
            )
        try:
            manifest = read_manifest(self._manifest)
            changed = self._differences(manifest, job)
        except FireflyError as error:
            raise OutputError(f"{error}: {replace}") from error
        except (KeyError, TypeError, AttributeError) as error:
            raise OutputError(f"{self._manifest} is not the manifest of {self.path}: {replace}") from error
        if changed:
            log.warning("%s is drawn again (%s)", self.path, "; ".join(changed))
            return None
        log.info("%s is whole already", self.path)
        self._clear()  # an earlier process may have been killed while it did so
        return manifest

    def _differences(self, manifest: Manifest, job: Job) -> list[str]:
        driver = Driver(manifest["driver"], manifest["driver_version"], manifest["software"])
        now = job.description(driver)
        before = {name: manifest[name] for name in now if name in manifest}
        changed = differences(before | {"folder": "", "values": {}}, now)
        about, facts = manifest["file"], self._film_facts()
        facts.pop("fps", None)  # as exact as the capture's own, which is compared already
        changed += differences({name: about.get(name) for name in facts}, facts)
        if [entry["index"] for entry in manifest["frames"]] != sorted(self._numbers):
            changed.append("its frames are others")
        digest = hash_file(self.path)
        if digest != about["sha256"]:
            changed.append("it is missing" if digest is None else "the file has been changed")
        return changed

    def remove_parts(self) -> None:
        """Remove what earlier processes left that were killed while they wrote the file or its manifest."""
        for start in (self.path.name, self._manifest.name):
            own = re.compile(rf"\.{re.escape(start)}\.[\d-]+\.part")
            with os.scandir(self.path.parent) as entries:
                left = [entry.path for entry in entries if own.fullmatch(entry.name)]
            for path in filter(lambda path: is_unfinished(os.path.basename(path)), left):
                with suppress(OSError):
                    os.unlink(path)

    def bind(self, frames: Manifest, progress: Progress | None) -> Manifest:
        """Make the file of frames, remove their folder's files, and return the file's own manifest.

        If one of them could not be drawn, the manifest of the frames is returned, and nothing is done.

        Raises
        ------
        FireflyError
            If the file cannot be written.
        """
        if any(failed["index"] in self._numbers for failed in frames["failed"]):
            return frames
        count = len(self._numbers)
        log.info("writing %s", self.path if count == 1 else f"{self.path} ({count:,} frames)")
        self.remove_parts()
        try:
            self._write(frames, progress)
            written = {"name": self.path.name, "sha256": hash_file(self.path), **self._film_facts()}
            head = {name: value for name, value in frames.items() if name != "frames"}
            head |= {"failed": [], "file": written}
            write_manifest(self._manifest, head, [({}, map(self._entry, self._entries(frames)))])
            sync_folder(self.path.parent)
        except BaseException:
            log.warning("%d of %d frames are whole in %s; to go on, use --resume", count, count, self.folder)
            raise
        self._clear()
        return read_manifest(self._manifest)

    def _write(self, frames: Manifest, progress: Progress | None) -> None:
        if self._choices is None:
            (entry,) = self._entries(frames)
            (name,) = set(entry["files"].values())
            content = (self.folder / name).read_bytes()
            with open_whole(self.path, sync=True) as file:
                file.write(content)
            return
        count = len(self._numbers)
        images = _images(self.folder, FileNames.of(frames), self._entries(frames))
        with open_whole(self.path, sync=True) as file:
            write_film(
                file,
                self.path.suffix.lower(),
                images,
                (frames["size"][0], frames["size"][1]),
                self._choices,
                None if progress is None else lambda done: progress(done, count),
            )

    def _entries(self, frames: Manifest) -> Iterator[FrameEntry]:
        """Yield the entries of the frames in the file: there may be others, of an earlier run."""
        return (entry for entry in frames["frames"] if entry["index"] in self._numbers)

    def _film_facts(self) -> dict[str, Any]:
        return {} if self._choices is None else self._choices.as_json()

    def _entry(self, entry: FrameEntry) -> FrameEntry:
        """Return a frame's entry in the file's own manifest."""
        changed: FrameEntry = {**entry, "files": {}, "file_sha256": {}}
        if self._choices is None:
            changed["files"] = dict.fromkeys(entry["files"], self.path.name)
            changed["file_sha256"] = entry["file_sha256"]
        return changed

    def _clear(self) -> None:
        """Remove the manifest of the frames, and then their files."""
        layout = layout_of(None)
        files = [name for name in names_in(self.folder, layout) if layout.parse(name) is not None]
        for name in (MANIFEST, *files):
            with suppress(OSError):
                os.unlink(self.folder / name)

    def remove_folder(self) -> None:
        """Remove the folder of the frames, when nobody holds it; what else is in it stays, and is named."""
        try:
            self.folder.rmdir()
        except OSError as error:
            left = sorted(os.listdir(self.folder)) if self.folder.is_dir() else []
            if left:
                log.info("%s stays, because %s is in it (%s)", self.folder, left[0], error.strerror)


def _images(folder: Path, names: FileNames, entries: Iterable[Mapping[str, Any]]) -> Iterator[Image]:
    """Read the frames one by one."""
    for entry in entries:
        ((output, name),) = entry["files"].items()
        try:
            content = (folder / name).read_bytes()
            yield names.encoding.decode(names.key_of(output), content)[output]
        except Exception as error:  # a decoder may raise anything
            raise FireflyError(f"cannot read {folder / name} ({error}): --resume draws it again") from error

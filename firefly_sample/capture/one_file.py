"""A capture that becomes one file: a film, or a still picture.

Its frames are captured into a folder beside it, as ever, so that it can be killed and resumed. When all are
whole, they are bound into the file, its manifest is put beside it, and the folder is removed.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from firefly_sample.capture.files import hash_file, sync_folder
from firefly_sample.capture.folder import journals
from firefly_sample.capture.frames import FrameNumbers
from firefly_sample.capture.job import Driver, Job, differences
from firefly_sample.capture.layout import layout_of, names_in
from firefly_sample.capture.manifest import MANIFEST, FrameEntry, Manifest, read_manifest, write_manifest
from firefly_sample.capture.names import FileNames
from firefly_sample.encoding.film import FilmChoices
from firefly_sample.encoding.films import FILMS, check_film, write_film
from firefly_sample.encoding.formats import format_of_path
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import Image
from firefly_sample.whole_files import open_whole

log = logging.getLogger(__name__)

STILLS = (".png", ".jpg", ".jpeg", ".exr", ".npz")
"""The endings of files that hold one frame; `FILMS` has those that hold any number."""


def is_one_file(path: Path) -> bool:
    """Return whether a path names a file that a capture can become, and not a folder."""
    return path.suffix.lower() in (*STILLS, *FILMS) and not path.is_dir()


def manifest_of(path: Path) -> Path:
    """Return the manifest of a file that a capture has become, ``clip.mp4.json``."""
    return path.with_name(f"{path.name}.json")


def film_choices(
    path: Path, fps: float, crf: int | None, quality: int | None, pad: bool
) -> FilmChoices | None:
    """Return how a film is written; None if a path names none.

    Raises an OutputError if a choice makes no sense there.
    """
    if is_one_file(path) and path.suffix.lower() in FILMS:
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
    count : int
        The number of frames.
    choices : FilmChoices, optional
        How a film is written.

    Attributes
    ----------
    folder : Path
        Where the frames are until the file is whole.
    """

    def __init__(self, path: Path, count: int, choices: FilmChoices | None) -> None:
        self.path, self._count, self._choices = path, count, choices
        self.folder = path.with_name(f"{path.name}.frames")
        self._manifest = manifest_of(path)
        suffix = path.suffix.lower()
        still = format_of_path(path)
        self._still = still if suffix in STILLS or (count == 1 and still is not None) else None
        if self._still is not None and count > 1:
            raise OutputError(
                f"{path} holds one frame, and {count} are asked for: name a folder, or a film "
                f"({', '.join(FILMS)})"
            )

    def formats(self, outputs: tuple[str, ...], given: object) -> dict[str, str]:
        """Return the formats of the frames: of a still its own, of a film PNG; nobody else chooses them."""
        if given is not None:
            raise OutputError(f"the ending of {self.path} says its format: leave the formats out")
        return dict.fromkeys(outputs, "png" if self._still is None else self._still.name)

    def check(self, job: Job) -> None:
        """Raise an OutputError if the file cannot hold the outputs of a job, or frames of its size."""
        held = job.encoding.files()
        if len(held) > 1:
            raise OutputError(
                f"{self.path} holds one image, and {', '.join(job.outputs)} are asked for: choose one of "
                "them, or a folder"
            )
        if self._still is None:
            assert self._choices is not None
            check_film(self.path.suffix.lower(), job.outputs[0], job.size, self._count, self._choices)

    def check_free(self) -> None:
        """Raise an OutputError if the file is there already."""
        if self.path.exists() or self._manifest.exists():
            there = self.path if self.path.exists() else self._manifest
            raise OutputError(f"{there} is there already: use --overwrite to replace it, or another name")

    def finished(self, job: Job, frames: FrameNumbers) -> Manifest | None:
        """Return the manifest of the file if it is whole, and what a job would draw; None if it is not.

        The driver is taken to be the same: a file that is whole is not drawn again on another machine.
        """
        if not (self.path.exists() and self._manifest.exists()):
            return None
        manifest = read_manifest(self._manifest)
        driver = Driver(manifest["driver"], manifest["driver_version"], manifest["software"])
        now = job.description(driver)
        before = {name: manifest[name] for name in now if name in manifest}
        changed = differences(before | {"folder": "", "values": {}}, now)
        if self._film_facts() != {name: manifest["file"].get(name) for name in self._film_facts()}:
            changed.append("how the film is written")
        if [entry["index"] for entry in manifest["frames"]] != list(frames):
            changed.append("its frames")
        if hash_file(self.path) != manifest["file"]["sha256"]:
            changed.append("the file itself has been changed")
        if changed:
            log.warning("%s is drawn again (%s)", self.path, "; ".join(changed))
            return None
        log.info("%s is whole already", self.path)
        if self.folder.exists() and not (journals(self.folder) or (self.folder / MANIFEST).exists()):
            self._clear()  # the process was killed while it did so
            self.remove_folder()
        return manifest

    def bind(self, manifest: Manifest) -> Manifest:
        """Make the file of the frames that a manifest names, and remove their folder's files.

        Raises
        ------
        FireflyError
            If the file cannot be written.
        """
        log.info("writing %s", self.path)
        if self._still is not None:
            (entry,) = manifest["frames"]
            (name,) = set(entry["files"].values())
            content = (self.folder / name).read_bytes()
            with open_whole(self.path, sync=True) as file:
                file.write(content)
        else:
            assert self._choices is not None
            names = FileNames.of(manifest)
            with open_whole(self.path, sync=True) as file:
                write_film(
                    file,
                    self.path.suffix.lower(),
                    _images(self.folder, names, manifest),
                    tuple(manifest["size"]),
                    self._choices,
                )
        written = {"name": self.path.name, "sha256": hash_file(self.path), **self._film_facts()}
        head = {name: value for name, value in manifest.items() if name != "frames"} | {"file": written}
        write_manifest(self._manifest, head, [({}, map(self._entry, manifest["frames"]))])
        sync_folder(self.path.parent)
        self._clear()
        return read_manifest(self._manifest)

    def _film_facts(self) -> dict[str, Any]:
        return {} if self._still is not None or self._choices is None else self._choices.as_json()

    def _entry(self, entry: FrameEntry) -> FrameEntry:
        """Return a frame's entry in the file's own manifest."""
        changed: FrameEntry = {**entry, "files": {}, "file_sha256": {}}
        if self._still is not None:
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
        """Remove the folder of the frames, when it is empty and nobody holds it."""
        with suppress(OSError):
            self.folder.rmdir()


def _images(folder: Path, names: FileNames, manifest: Mapping[str, Any]) -> Iterator[Image]:
    """Read the frames one by one."""
    for entry in manifest["frames"]:
        ((output, name),) = entry["files"].items()
        try:
            content = (folder / name).read_bytes()
            yield names.encoding.decode(names.key_of(output), content)[output]
        except Exception as error:  # a decoder may raise anything
            raise FireflyError(f"cannot read {folder / name} ({error}): --resume draws it again") from error

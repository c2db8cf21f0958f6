"""The two sides of a comparison: what is found in the files of each, and what only one of them has."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from firefly_sample.capture.checking.report import Report
from firefly_sample.capture.checking.stored import Checked, FilmImage, Listed, StoredCapture, StoredFrame
from firefly_sample.capture.checking.stored_film import film_frames, film_of
from firefly_sample.capture.manifest import MANIFEST
from firefly_sample.capture.one_file import manifest_of

_SHOWN_FILES = 3


def named(capture: str) -> str:
    """Return the start of a line about a capture of a sweep; "" of another capture."""
    return f"{capture}: " if capture else ""


class Side:
    """One capture while it is compared: what is found in its files goes into the report.

    With `decode`, the frames of a film are read from the film.
    """

    def __init__(self, capture: StoredCapture, report: Report, decode: bool = False) -> None:
        self.capture, self.report = capture, report
        self._decode = decode and film_of(capture) is not None
        self.folder = capture.root / capture.folder
        self.listed, self.rewritten = Listed(capture.names), list[str]()
        self.failed = capture.failed()
        for index, error in self.failed.items():
            text = f"{self.folder}: frame {index} could not be drawn: {error}"
            report.add("failed", text, capture=capture.folder, frame=index)

    def frames(self) -> Iterator[StoredFrame]:
        """Read the frames, and keep which files they have."""
        if self._decode:
            yield from film_frames(self.capture)
            return
        for frame in self.capture.frames():
            for file in frame.files.values():
                self.listed.add(os.path.relpath(file.path, self.folder))
            yield frame

    def take(self, frame: StoredFrame, checked: Mapping[str, Checked]) -> None:
        """Report what was found about the files of a frame; of one with several outputs once."""
        files: dict[Path, list[str]] = {}
        for output, file in frame.files.items():
            if not isinstance(file, FilmImage):
                files.setdefault(file.path, []).append(output)
        for path, outputs in files.items():
            self.report.files += 1
            wrong = [output for output in outputs if checked[output].kind]
            if not wrong and any(checked[output].rewritten for output in outputs):
                self.rewritten.append(str(path))
            is_whole = all(checked[output].kind in ("missing", "damaged") for output in outputs)
            for output in wrong[:1] if is_whole else wrong:
                one = checked[output]
                several = len(outputs) > 1
                self.report.add(
                    one.kind,
                    f"{path}: {output} {one.text}" if several and not is_whole else f"{path} {one.text}",
                    file=str(path),
                    capture=self.capture.folder,
                    frame=frame.index,
                    output=None if several and is_whole else output,
                )

    def finish(self) -> None:
        """Report what is known when all frames have been read."""
        film = film_of(self.capture)
        manifest = self.capture.root / MANIFEST if film is None else manifest_of(film)
        for text in dict.fromkeys(self.capture.errors):
            place = f"{manifest}: {named(self.capture.folder)}"
            self.report.add("manifest", place + text, file=str(manifest), capture=self.capture.folder)
        alone = "file" in self.capture.keys  # the other files in its folder are not its own
        stale = [] if alone else [str(self.folder / name) for name in self.listed.stale(self.folder)]
        for kind, files, text in (
            ("rewritten", self.rewritten, "written anew by another program, with the same pixels"),
            ("stale", stale, f"not in the manifest of {self.folder}"),
        ):
            if files:
                verb = "is" if len(files) == 1 else "are"
                self.report.note(kind, f"{_listed(files)} {verb} {text}", files)


def _listed(files: list[str]) -> str:
    """Return at most three files for a line, and how many more there are."""
    shown = [Path(name).name if place else name for place, name in enumerate(files[:_SHOWN_FILES])]
    more = len(files) - len(shown)
    return ", ".join(shown) + (f" and {more:,} more" if more else "")


class Only:
    """The frames and outputs that only one of two captures has."""

    def __init__(self, capture: str, folders: tuple[str, str], report: Report) -> None:
        self._capture, self._folders, self._report = capture, folders, report
        self._found: dict[tuple[int, str], list[list[int]]] = {}

    def add(self, side: int, index: int, output: str = "") -> None:
        """Add a frame that only the side 0 or 1 has, or an output of it."""
        runs = self._found.setdefault((side, output), [])
        if runs and runs[-1][1] == index - 1:
            runs[-1][1] = index
        else:
            runs.append([index, index])

    def finish(self) -> None:
        """Report them, one line for each side and output."""
        for (side, output), runs in sorted(self._found.items(), key=lambda one: one[1][0]):
            shown = ", ".join(str(a) if a == b else f"{a} to {b}" for a, b in runs[:_SHOWN_FILES])
            more = sum(b - a + 1 for a, b in runs[_SHOWN_FILES:])
            one = len(runs) == 1 and runs[0][0] == runs[0][1]
            frames = f"frame{'' if one else 's'} {shown}" + (f" and {more:,} more" if more else "")
            what = f"{output} of {frames}" if output else frames
            verb = "is" if one or output else "are"
            self._report.add(
                "only",
                f"{named(self._capture)}{what} {verb} only in {self._folders[side]}",
                capture=self._capture,
                output=output or None,
            )

"""Compare a capture with its manifest, and two captures with each other."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import groupby, repeat
from pathlib import Path
from typing import Any

from firefly_sample.capture.comparing import Limits
from firefly_sample.capture.files import hash_file, thread_count
from firefly_sample.capture.folder import journals
from firefly_sample.capture.job import differences as description_differences
from firefly_sample.capture.manifest import MANIFEST
from firefly_sample.capture.one_file import manifest_of
from firefly_sample.capture.pairs import Found, Pair, compare_files
from firefly_sample.capture.report import Report
from firefly_sample.capture.stored import (
    Checked,
    Listed,
    StoredCapture,
    StoredFile,
    StoredFrame,
    check_file,
    path_inside,
    stored_captures,
)
from firefly_sample.capture.stored_film import check_film, compare_films, film_of
from firefly_sample.errors import FireflyError

_NOT_DESCRIBED = (
    *("frames", "failed", "warnings", "id_names", "folder", "values", "captures", "sweep"),
    *("documents", "file", "categories"),
)
_SHOWN_FILES = 3

Progress = Callable[[int, int], None]


def verify_capture(folder: str | Path, progress: Progress | None = None) -> Report:
    """Compare a capture, or all of a sweep, with its manifest.

    A file whose hash differs is decoded: if its pixels are those of the manifest, because another program has
    compressed it anew, that is a note. Files with names as captures give them that are not in the manifest
    are a note, too.

    Parameters
    ----------
    folder : path
        The folder with the ``manifest.json``.
    progress : callable, optional
        Called with (frames done, frames in all).

    Returns
    -------
    Report

    Raises
    ------
    FireflyError
        If there is no capture, or its manifest cannot be read.
    """
    report = Report(str(folder))
    captures = _captures(Path(folder), report)
    total = sum(map(len, captures))
    done = 0
    for capture in captures:
        side = _Side(capture, report)
        for frame, checked in _in_threads(side.frames(), _check_frame):
            for output, file in frame.files.items():
                side.take(frame, output, file, checked[output])
            report.frames += 1
            done += 1
            if progress is not None:
                progress(done, total)
        side.finish()
        check_film(capture, report)
        _check_documents(capture, report)
    return report


def _check_documents(capture: StoredCapture, report: Report) -> None:
    """Report which documents of a data set are not as they were written. Those of others are not compared."""
    documents = capture.keys.get("documents")
    for name, digest in (documents if isinstance(documents, dict) else {}).items():
        report.files += 1
        path = path_inside(capture.root, name)
        found = hash_file(path)
        if found is None:
            report.add("missing", f"{path} is missing", file=str(path), capture=capture.folder)
        elif found != digest:
            report.add("changed", f"{path} has been changed", file=str(path), capture=capture.folder)


def _check_frame(frame: StoredFrame) -> tuple[StoredFrame, dict[str, Checked]]:
    checked = {output: check_file(output, file) for output, file in frame.files.items()}
    return frame, {output: one._replace(content=None) for output, one in checked.items()}


def compare_captures(
    folder: str | Path,
    other: str | Path,
    *,
    max_codes: float = 0.0,
    max_error: float = 0.0,
    max_share: float = 0.0,
    differences: str | Path | None = None,
    progress: Progress | None = None,
) -> Report:
    """Compare a capture, or all of a sweep, with another one, and each with its own manifest.

    Images with the same hash of pixels are the same. Others are decoded and compared. Different descriptions,
    for example of the driver or a setting, are notes.

    Parameters
    ----------
    folder, other : path
        The expected and the actual capture.
    max_codes, max_error, max_share : float
        See `firefly_sample.capture.comparing.Limits`; by default images must be equal.
    differences : path, optional
        A folder for pictures of images that differ: expected, actual and difference side by side. Pictures of
        an earlier comparison in it are removed.
    progress : callable, optional
        Called with (frames done, frames in all).

    Returns
    -------
    Report

    Raises
    ------
    FireflyError
        If there is no capture, or a manifest cannot be read, or a picture not written, or a limit is wrong.
    """
    limits = Limits(max_codes, max_error, max_share)
    report = Report(str(folder), str(other), limits)
    ours, theirs = ({one.folder: one for one in _captures(Path(path), report)} for path in (folder, other))
    total = sum(max(len(ours[name]), len(theirs[name])) for name in ours.keys() & theirs.keys())
    done = 0
    for name in dict.fromkeys((*ours, *theirs)):
        if name not in theirs or name not in ours:
            where, lone = (folder, ours[name]) if name in ours else (other, theirs[name])
            frames = "1 frame is" if len(lone) == 1 else f"{len(lone):,} frames are"
            report.add("only", f"{_named(name)}{frames} only in {where}", capture=name)
            continue
        _describe(ours[name], theirs[name], report)
        pictures = None if differences is None else _picture_folder(Path(differences) / name)
        if film_of(ours[name]) or film_of(theirs[name]):
            for one in (ours[name], theirs[name]):
                check_film(one, report)
            compare_films(ours[name], theirs[name], limits, pictures, report)
            continue
        sides = _Side(ours[name], report), _Side(theirs[name], report)
        only = _Only(name, (str(folder), str(other)), report)
        within = 0
        compare = partial(compare_files, limits=limits, pictures=pictures)
        for pair, found in _in_threads(_pairs(*sides, only), compare):
            within += _take(pair, found, sides, only, report)
            report.frames += 1
            done += 1
            if progress is not None:
                progress(min(done, total), total)
        for side in sides:
            side.finish()
            _check_documents(side.capture, report)
        only.finish()
        if within:
            differ = "image differs" if within == 1 else "images differ"
            report.note("within", f"{_named(name)}{within:,} {differ}, but within the limits")
    return report


def _captures(folder: Path, report: Report) -> list[StoredCapture]:
    """Return the captures of a folder; report that it is unfinished."""
    if not folder.is_dir() and manifest_of(folder).is_file():
        folder = manifest_of(folder)  # of a film, or another single file
    found = journals(folder)
    manifest = folder / MANIFEST if folder.is_dir() else folder
    if found:
        way = "firefly capture with the same options and --resume ends it"
        if any("-of-" in path.name for path in found):
            way = f"{way}; if all its shards are done, firefly verify --merge does"
        text = f"the capture in {folder} is not finished, as {found[0].name} shows: {way}"
        if not manifest.exists():
            raise FireflyError(text)
        report.add("unfinished", text, file=str(found[0]))
    if not manifest.exists():
        if not folder.exists():
            raise FireflyError(f"there is no folder {folder}")
        raise FireflyError(f"{folder} holds no capture: there is no {MANIFEST}")
    captures = stored_captures(folder)
    if not any(len(one) or one.failed() for one in captures):
        report.add("empty", f"{manifest} lists no frame", file=str(manifest))
    return captures


def _named(capture: str) -> str:
    return f"{capture}: " if capture else ""


def _describe(ours: StoredCapture, theirs: StoredCapture, report: Report) -> None:
    """Note how the descriptions of two captures differ."""
    before, now = (
        {key: value for key, value in side.keys.items() if key not in _NOT_DESCRIBED}
        for side in (ours, theirs)
    )
    common = {key for key in before if key in now}  # those of earlier versions have fewer
    for text in description_differences(*({key: side[key] for key in common} for side in (before, now))):
        report.note("description", f"{_named(ours.folder)}{text}")


class _Side:
    """One capture while it is compared: what is found in its files goes into the report."""

    def __init__(self, capture: StoredCapture, report: Report) -> None:
        self.capture, self.report = capture, report
        self.folder = capture.root / capture.folder
        self.listed, self.rewritten = Listed(capture.names), list[str]()
        self.failed = capture.failed()
        for index, error in self.failed.items():
            text = f"{self.folder}: frame {index} could not be drawn: {error}"
            report.add("failed", text, capture=capture.folder, frame=index)

    def frames(self) -> Iterator[StoredFrame]:
        """Read the frames, and keep which files they have."""
        for frame in self.capture.frames():
            for file in frame.files.values():
                self.listed.add(os.path.relpath(file.path, self.folder))
            yield frame

    def take(self, frame: StoredFrame, output: str, file: StoredFile, checked: Checked) -> None:
        """Report what was found about a file."""
        self.report.files += 1
        if checked.rewritten:
            self.rewritten.append(str(file.path))
        elif checked.kind:
            self.report.add(
                checked.kind,
                f"{file.path} {checked.text}",
                file=str(file.path),
                capture=self.capture.folder,
                frame=frame.index,
                output=output,
            )

    def finish(self) -> None:
        """Report what is known when all frames have been read."""
        manifest = self.capture.root / MANIFEST
        for text in self.capture.errors:
            place = f"{manifest}: {_named(self.capture.folder)}"
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


class _Only:
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
                f"{_named(self._capture)}{what} {verb} only in {self._folders[side]}",
                capture=self._capture,
                output=output or None,
            )


def _pairs(ours: _Side, theirs: _Side, only: _Only) -> Iterator[Pair]:
    """Join the frames of two captures by their numbers; a frame that failed is not missing."""
    both = _sorted_together(ours.frames(), theirs.frames())
    for index, frames in groupby(both, key=lambda one: one[1].index):
        found = dict(frames)
        if len(found) == 2:
            yield Pair(found[0], found[1])
            continue
        ((side, _),) = found.items()
        if index not in (theirs, ours)[side].failed:
            only.add(side, index)


def _sorted_together(*frames: Iterator[StoredFrame]) -> Iterator[tuple[int, StoredFrame]]:
    """Merge sorted frames; each with the number of the iterator that it is from."""
    import heapq

    numbered = [zip(repeat(side), one, strict=False) for side, one in enumerate(frames)]
    return heapq.merge(*numbered, key=lambda one: one[1].index)


def _take(pair: Pair, found: Found, sides: tuple[_Side, _Side], only: _Only, report: Report) -> int:
    """Report what was found about two frames; return how many images differ within the limits."""
    for place, frame in enumerate(pair):
        for output, file in frame.files.items():
            sides[place].take(frame, output, file, found.checked[place][output])
            if output not in pair[1 - place].files:
                only.add(place, frame.index, output)
    capture = sides[0].capture.folder
    for one in found.different:
        report.add(
            one.kind,
            f"{_named(capture)}frame {pair.expected.index}: {one.output} {one.text}",
            capture=capture,
            frame=pair.expected.index,
            output=one.output,
            figures=one.figures,
            picture=one.picture,
        )
    return found.within


def _picture_folder(folder: Path) -> Path:
    """Return a folder for difference pictures, without those of an earlier comparison."""
    for path in folder.glob("difference_*_[0-9]*.png"):
        try:
            path.unlink()
        except OSError as error:
            raise FireflyError(f"cannot remove {path}: {error.strerror or error}") from error
    return folder


def _in_threads(items: Iterable[Any], work: Callable[[Any], Any]) -> Iterator[Any]:
    """Yield the result of `work` for each item, in order; few items are under way at a time."""
    threads = thread_count()
    waiting: deque[Future[Any]] = deque()
    with ThreadPoolExecutor(threads, thread_name_prefix="verify") as pool:
        try:
            for item in items:
                waiting.append(pool.submit(work, item))
                if len(waiting) > threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)

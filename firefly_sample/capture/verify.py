"""Compare a capture with its manifest, and two captures with each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import groupby, repeat
from pathlib import Path
from typing import Any

from firefly_sample.capture.checking.comparing import Limits
from firefly_sample.capture.checking.pairs import Found, Pair, compare_files
from firefly_sample.capture.checking.report import Report
from firefly_sample.capture.checking.sides import Only, Side, named
from firefly_sample.capture.checking.stored import (
    Checked,
    StoredCapture,
    StoredFrame,
    check_frame,
    path_inside,
    stored_captures,
    without_content,
)
from firefly_sample.capture.checking.stored_film import are_same_films, check_film, film_of
from firefly_sample.capture.files import hash_file, thread_count
from firefly_sample.capture.folder import holds_capture, journals
from firefly_sample.capture.job import differences as description_differences
from firefly_sample.capture.manifest import MANIFEST
from firefly_sample.capture.one_file import frames_folder, is_one_file, manifest_of
from firefly_sample.errors import FireflyError

_NOT_DESCRIBED = (
    *("frames", "failed", "warnings", "id_names", "folder", "values", "captures", "sweep"),
    *("documents", "file", "categories"),
)
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
        side = Side(capture, report)
        for frame, checked in _in_threads(side.frames(), _check_frame):
            side.take(frame, checked)
            report.frames += 1
            done += 1
            if progress is not None:
                progress(done, total)
        side.finish()
        if film_of(capture) is not None:
            check_film(capture, report)
        _check_documents(capture, report)
    return report


def _check_documents(capture: StoredCapture, report: Report) -> None:
    """Report which documents of a data set are not as they were written. Those of others are not compared."""
    documents = capture.keys.get("documents")
    for name, digest in (documents if isinstance(documents, dict) else {}).items():
        report.files += 1
        try:
            path = path_inside(capture.root, name)
        except ValueError as error:
            report.add("damaged", f"one of its 'documents' is damaged: {error}", capture=capture.folder)
            continue
        found = hash_file(path)
        if found is None:
            report.add("missing", f"{path} is missing", file=str(path), capture=capture.folder)
        elif found != digest:
            report.add("changed", f"{path} has been changed", file=str(path), capture=capture.folder)


def _check_frame(frame: StoredFrame) -> tuple[StoredFrame, dict[str, Checked]]:
    return frame, without_content(check_frame(frame))


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
        See `firefly_sample.capture.checking.comparing.Limits`; by default images must be equal.
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
            report.add("only", f"{named(name)}{frames} only in {where}", capture=name)
            continue
        _describe(ours[name], theirs[name], report)
        pictures = None if differences is None else _picture_folder(Path(differences) / name)
        pair = ours[name], theirs[name]
        readable = [check_film(one, report) for one in pair if film_of(one) is not None]
        if not all(readable):
            continue
        if are_same_films(*pair):
            report.frames += len(pair[0])
            continue
        sides = Side(pair[0], report, decode=True), Side(pair[1], report, decode=True)
        only = Only(name, (str(folder), str(other)), report)
        within = 0
        compare = partial(compare_files, limits=limits, pictures=pictures)
        for frames, found in _in_threads(_pairs(*sides, only), compare):
            within += _take(frames, found, sides, only, report)
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
            report.note("within", f"{named(name)}{within:,} {differ}, but within the limits")
    return report


def _captures(folder: Path, report: Report) -> list[StoredCapture]:
    """Return the captures of a folder; report that it is unfinished."""
    if is_one_file(folder) and not folder.is_dir():
        folder = _manifest_of(folder, report)
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


def _manifest_of(path: Path, report: Report) -> Path:
    """Return the manifest of a film or another single file; report that it is unfinished."""
    manifest, frames = manifest_of(path), frames_folder(path)
    if holds_capture(frames):
        text = (
            f"the capture of {path} is not finished, as {frames} shows: firefly capture with the same "
            "options and --resume ends it"
        )
        if not manifest.exists():
            raise FireflyError(text)
        report.add("unfinished", text, file=str(frames))
    if not manifest.exists():
        if not path.exists():
            raise FireflyError(f"there is no file {path}")
        raise FireflyError(
            f"{path} is a file: give the folder of a capture, in which {MANIFEST} is; one that is one "
            f"file has {manifest.name} beside it"
        )
    return manifest


def _describe(ours: StoredCapture, theirs: StoredCapture, report: Report) -> None:
    """Note how the descriptions of two captures differ."""
    before, now = (
        {key: value for key, value in side.keys.items() if key not in _NOT_DESCRIBED}
        for side in (ours, theirs)
    )
    common = {key for key in before if key in now}  # those of earlier versions have fewer
    for text in description_differences(*({key: side[key] for key in common} for side in (before, now))):
        report.note("description", f"{named(ours.folder)}{text}")


def _pairs(ours: Side, theirs: Side, only: Only) -> Iterator[Pair]:
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


def _take(pair: Pair, found: Found, sides: tuple[Side, Side], only: Only, report: Report) -> int:
    """Report what was found about two frames; return how many images differ within the limits."""
    for place, frame in enumerate(pair):
        sides[place].take(frame, found.checked[place])
        for output in frame.files:
            if output not in pair[1 - place].files:
                only.add(place, frame.index, output)
    capture = sides[0].capture.folder
    for one in found.different:
        report.add(
            one.kind,
            f"{named(capture)}frame {pair.expected.index}: {one.output} {one.text}",
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

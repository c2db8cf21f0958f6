"""Write the manifest of a capture whose frames are all drawn, for example by several shards."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from firefly_sample.capture.closing import OWN, write_records
from firefly_sample.capture.files import as_folder
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.frames import asked_numbers
from firefly_sample.capture.job import differences
from firefly_sample.capture.manifest import MANIFEST, Manifest, read_manifest
from firefly_sample.capture.names import FileNames
from firefly_sample.capture.one_file import frames_folder, is_one_file
from firefly_sample.capture.records import Records
from firefly_sample.capture.work import fault_of
from firefly_sample.errors import FireflyError, OutputError

_LISTED = 5


def merge_capture(folder: str | Path) -> Manifest:
    """Write the manifest of a folder from its journals, and remove them; return the manifest.

    Nothing is drawn: where a frame is missing, damaged, or was drawn with other settings than the others, the
    error says so. A folder that has a manifest and no journal is left as it is.

    Raises
    ------
    FireflyError
        If the folder cannot be written, there is no capture in it, somebody is drawing into it, or it is not
        complete.
    """
    path = as_folder(folder)
    if is_one_file(path) and not path.is_dir():
        raise OutputError(
            f"{path} is one file: firefly capture with the same options and --resume writes it from "
            f"{frames_folder(path)}"
        )
    if not path.is_dir():
        raise OutputError(f"there is no folder {path}")
    with CaptureFolder(path, {"frames": (0, 0, 1), "views": 1, "jobs": 0, "shard": ""}) as place:
        records = place.records
        if not records.asked:
            if not (path / MANIFEST).exists():
                raise OutputError(f"there is no capture in {path}")
            return read_manifest(path)
        descriptions = [_description(path, records, name) for name in sorted(records.folders())]
        _check_alike(path, descriptions)
        _check_complete(path, records, descriptions)
        for description in descriptions:
            _check_files(path, records, description)
        place.remove_strays()
        write_records(path, records, descriptions)
        place.end()
    return read_manifest(path)


def _description(path: Path, records: Records, folder: str) -> Mapping[str, Any]:
    """Return the description of all frames in a folder, or raise an error if they differ in it."""
    found: dict[str, Mapping[str, Any]] = {}
    for index in records.indices(folder):
        key = records.frame(folder, index)["about"]
        found.setdefault(key, records.descriptions[key])
    first, *others = found.values()
    if others:
        changed = "; ".join(differences(first, others[0]))
        raise OutputError(
            f"the frames in {path / folder} were drawn in different ways ({changed}): capture with --resume "
            "draws again those that differ"
        )
    return first


def _check_alike(path: Path, descriptions: list[Mapping[str, Any]]) -> None:
    """Raise an error if combinations differ in what the manifest of a sweep says once for all of them."""
    for other in descriptions[1:]:
        names, others = (", ".join(one["values"]) or "nothing" for one in (descriptions[0], other))
        if names != others:
            raise OutputError(
                f"in {path} there are captures over {names} and over {others}: put each into a folder of "
                "its own"
            )
        first, second = (
            {name: value for name, value in one.items() if name not in OWN}
            for one in (descriptions[0], other)
        )
        if first != second:
            raise OutputError(
                f"the combinations in {path} were drawn in different ways "
                f"({'; '.join(differences(first, second))}): capture with --resume draws again those that "
                "differ"
            )


def _check_complete(path: Path, records: Records, descriptions: list[Mapping[str, Any]]) -> None:
    """Raise an error if frames that were asked for have no record."""
    asked = dict.fromkeys(index for run in records.asked for index in asked_numbers(run))
    jobs = max(run["jobs"] for run in records.asked)
    if len(descriptions) < jobs:
        raise OutputError(
            f"{len(descriptions)} of {jobs} combinations are drawn in {path}: draw the others by the same "
            "command with --resume"
        )
    missing = (
        f"{one['folder']}/{index}" if one["folder"] else str(index)
        for one in descriptions
        for index in asked
        if not records.has(one["folder"], index)
    )
    some = list(islice(missing, _LISTED + 1))
    if some:
        listed = ", ".join(some[:_LISTED]) + (", ..." if len(some) > _LISTED else "")
        raise OutputError(
            f"frames have yet to be drawn in {path} ({listed}): run the same command, or the shards that are "
            "not done, with --resume"
        )


def _check_files(path: Path, records: Records, description: Mapping[str, Any]) -> None:
    """Raise an error if a file is not as it was written."""
    folder, names = description["folder"], FileNames.of(description)
    for index in records.indices(folder):
        frame = records.frame(folder, index)
        fault = fault_of(path, names, frame)
        if fault is not None and "error" not in frame:
            raise FireflyError(
                f"frame {index} in {path / folder} is {fault}: the same command with --resume draws it again"
            )

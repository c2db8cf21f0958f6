"""The end of a capture: the manifest, made of the records of its frames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from firefly_sample.capture.files import hash_file, sync_folder
from firefly_sample.capture.manifest import MANIFEST, FrameEntry, write_manifest
from firefly_sample.capture.records import Records

OWN = ("folder", "values", "sources", "parameters", "settings", "exposure", "seed")
"""The members of a description that each capture of a sweep has for itself."""


def write_records(path: Path, records: Records, descriptions: Sequence[Mapping[str, Any]]) -> None:
    """Write the manifest of a folder, whole or not at all.

    Parameters
    ----------
    path : Path
        The folder.
    records : Records
    descriptions : sequence of mapping
        A `Job.description` of each folder; one with the folder "" unless it is a sweep. The captures of a
        sweep come in the order of their values, in whatever order they were drawn.
    """
    descriptions = sorted(descriptions, key=_order)
    is_sweep = bool(descriptions[0]["folder"])
    head: dict[str, Any] = {}
    if is_sweep:
        head = {name: value for name, value in descriptions[0].items() if name not in OWN}
        head["sweep"] = _axes(descriptions)
    parts = (_part(path, records, description, is_sweep) for description in descriptions)
    write_manifest(path / MANIFEST, head, parts, sweep=is_sweep)
    sync_folder(path)


def _part(
    path: Path, records: Records, description: Mapping[str, Any], is_sweep: bool
) -> tuple[dict[str, Any], Iterable[FrameEntry]]:
    folder = description["folder"]
    left_out = () if is_sweep else ("folder", "values")
    keys = {
        name: value
        for name, value in description.items()
        if name not in left_out and (name in OWN or not is_sweep)
    }
    warnings: dict[str, None] = {}
    failed, id_names = [], None
    for index in records.indices(folder):
        frame = records.frame(folder, index)
        warnings |= dict.fromkeys(frame.get("warnings", ()))
        if "error" in frame:
            failed.append({name: frame[name] for name in ("index", "time", "error")})
        elif id_names is None:
            id_names = frame.get("id_names")
    keys |= {"warnings": list(warnings)}
    if id_names is not None:
        keys["id_names"] = id_names
    keys["failed"] = failed
    frames = _Frames(records, folder, id_names)
    if description.get("dataset") is not None:
        keys["documents"] = _write_documents(path, description, frames)
    return keys, frames


class _Frames:
    """The entries of the frames of a folder, read from the records as often as they are asked for."""

    def __init__(self, records: Records, folder: str, id_names: list[str] | None) -> None:
        self._arguments = records, folder, id_names

    def __iter__(self) -> Iterator[FrameEntry]:
        return _entries(*self._arguments)


def _write_documents(
    path: Path, description: Mapping[str, Any], frames: Iterable[FrameEntry]
) -> dict[str, str]:
    """Write what makes the files of a folder a data set; return the SHA-256 of each document, by its path."""
    from firefly_sample.capture.datasets import DATASETS

    folder = description["folder"]
    names = DATASETS[description["dataset"]].write(path, description, frames)
    sync_folder(path / folder)
    return {name: hash_file(path / name) or "" for name in names}


def _entries(records: Records, folder: str, id_names: list[str] | None) -> Iterator[FrameEntry]:
    for index in records.indices(folder):
        frame = records.frame(folder, index)
        if "error" in frame:
            continue
        entry: FrameEntry = {
            "index": index,
            "time": frame["time"],
            "lights": frame["lights"],
            "camera": frame["camera"],
            "files": frame["files"],
            "sha256": frame["sha256"],
            "file_sha256": frame["file_sha256"],
        }
        if "view" in frame:
            entry["view"] = frame["view"]
        if "instances" in frame:
            entry["instances"] = frame["instances"]
        if "id_names" in frame and frame["id_names"] != id_names:
            entry["id_names"] = frame["id_names"]
        yield entry


def _order(description: Mapping[str, Any]) -> list[tuple[str, float, str]]:
    """Return what to sort by: numbers by size, other values by their text."""
    values = description["values"].values()
    return [
        ("", value, "") if isinstance(value, int | float) else (type(value).__name__, 0.0, str(value))
        for value in values
    ]


def _axes(descriptions: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Return the names that a sweep varies, with their values in order."""
    axes: dict[str, list[Any]] = {}
    for description in descriptions:
        for name, value in description["values"].items():
            if value not in axes.setdefault(name, []):
                axes[name].append(value)
    return axes

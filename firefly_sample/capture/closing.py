"""The end of a capture: the manifest, made of the records of its frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from firefly_sample.capture.files import sync_folder
from firefly_sample.capture.manifest import FrameEntry, write_manifest
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
    parts = (_part(records, description, is_sweep) for description in descriptions)
    write_manifest(path, head, parts, sweep=is_sweep)
    sync_folder(path)


def _part(
    records: Records, description: Mapping[str, Any], is_sweep: bool
) -> tuple[dict[str, Any], Iterator[FrameEntry]]:
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
    return keys, _frames(records, folder, id_names)


def _frames(records: Records, folder: str, id_names: list[str] | None) -> Iterator[FrameEntry]:
    for index in records.indices(folder):
        frame = records.frame(folder, index)
        if "error" in frame:
            continue
        entry: FrameEntry = {
            "index": index,
            "time": frame["time"],
            "lights": frame["lights"],
            "files": frame["files"],
            "sha256": frame["sha256"],
            "file_sha256": frame["file_sha256"],
        }
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

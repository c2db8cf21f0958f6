"""The end of a capture: the manifest, made of the records of its frames."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from firefly_sample.capture.datasets import find_dataset
from firefly_sample.capture.files import hash_file, sync_folder
from firefly_sample.capture.manifest import MANIFEST, FrameEntry, write_manifest
from firefly_sample.capture.records import Records
from firefly_sample.errors import FireflyError

OWN = ("folder", "values", "sources", "parameters", "settings", "exposure", "seed")
"""The members of a description that each capture of a sweep has for itself."""
_SOMETIMES: tuple[Literal["camera", "view", "instances"], ...] = ("camera", "view", "instances")
"""Members of a frame that not all have; journals of earlier versions have no cameras."""


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
    categories = _categories(records, descriptions)
    if categories is not None and is_sweep:
        head["categories"] = categories
    parts = (_part(path, records, description, categories, is_sweep) for description in descriptions)
    write_manifest(path / MANIFEST, head, parts, sweep=is_sweep)
    sync_folder(path)


def _categories(records: Records, descriptions: Sequence[Mapping[str, Any]]) -> list[str] | None:
    """Return the categories of all scenes of a data set, sorted; None where it has no instances.

    A sweep has one list, so that a category has the same number in all its folders.
    """
    dataset = descriptions[0].get("dataset")
    if dataset is None or "instances" not in find_dataset(dataset).needs:
        return None
    found: set[str] = set()
    for folder in (description["folder"] for description in descriptions):
        for index in records.indices(folder):
            found.update(records.frame(folder, index).get("categories", ()))
    return sorted(found)


def _part(
    path: Path,
    records: Records,
    description: Mapping[str, Any],
    categories: list[str] | None,
    is_sweep: bool,
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
    if categories is not None and not is_sweep:
        keys["categories"] = categories
    keys["failed"] = failed
    frames = _Frames(records, folder, id_names)
    if description.get("dataset") is not None:
        known = {**description, "categories": categories}
        keys["documents"] = _write_documents(path, known, frames)
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
    folder = description["folder"]
    try:
        names = find_dataset(description["dataset"]).write(path, description, frames)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise FireflyError(
            f"cannot describe the frames in {path / folder} as data set {description['dataset']!r}, because "
            f"what is recorded of one is damaged ({type(error).__name__}: {error}): use --overwrite"
        ) from error
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
            "files": frame["files"],
            "sha256": frame["sha256"],
            "file_sha256": frame["file_sha256"],
        }
        for name in _SOMETIMES:
            if name in frame:
                entry[name] = frame[name]
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

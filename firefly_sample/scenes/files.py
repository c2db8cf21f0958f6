"""Names of model files: which operands are files, lists of them, and what is said of one that is missing."""

from __future__ import annotations

import os
from pathlib import Path

from firefly_sample.errors import ModelError, did_you_mean
from firefly_sample.model.formats import FORMATS, PANDA3D_FORMATS, suffix_of

_SUFFIXES = {"glb", "gltf", *FORMATS, *PANDA3D_FORMATS}
"""Suffixes by which a name is that of a model file, even if there is no such file."""
_LISTED = 8


def is_file_name(name: str) -> bool:
    """Return whether a name is that of a file, and not of a scene: it exists, or looks like one."""
    return os.path.isfile(name) or has_model_suffix(name) or (os.sep in name and ":" not in name)


def has_model_suffix(name: str) -> bool:
    """Return whether a name ends as those of model files do."""
    return suffix_of(Path(name)) in _SUFFIXES


def split_files(text: str) -> list[str]:
    """Return the files of a text in which commas separate them; a file's name may itself have commas.

    Where the text up to a comma is not the name of a file, the shortest continuation that is one counts, or
    else the shortest that ends like one.
    """
    files = []
    parts = text.split(",")
    while parts:
        longer = [",".join(parts[:end]) for end in range(1, len(parts) + 1)]
        tests = (os.path.isfile, has_model_suffix)
        file = next((name for test in tests for name in longer if test(name)), parts[0])
        files.append(file)
        parts = parts[longer.index(file) + 1 :]
    return [file for file in files if file.strip()]


def check_file(name: str) -> None:
    """Raise a ModelError if there is no such file: it names similar ones, or those in a folder."""
    path = Path(name)
    try:
        os.stat(name)
    except (FileNotFoundError, NotADirectoryError):
        raise ModelError(f"model {name}: no such file{_similar(path)}") from None
    except (OSError, ValueError) as error:
        raise ModelError(f"model {name}: cannot be read ({error})") from None
    if os.path.isdir(name):
        models = _models_in(path)
        listed = ", ".join(models[:_LISTED]) + (", ..." if len(models) > _LISTED else "")
        holds = f"it holds {listed}: give one of them" if models else "and there is no model in it"
        raise ModelError(f"model {name}: it is a folder, {holds}")


def complete_files(start: str) -> list[str]:
    """Return the model files whose names begin with `start` and, if it is not empty, the folders too."""
    folder, beginning = os.path.split(start)
    try:
        entries = sorted(os.scandir(folder or "."), key=lambda entry: entry.name)
    except OSError:
        return []
    found = []
    for entry in entries:
        name = os.path.join(folder, entry.name)
        if entry.name.startswith(beginning):
            if has_model_suffix(entry.name):
                found.append(name)
            elif start and entry.is_dir():
                found.append(name + os.sep)
    return found


def files_stem(text: str) -> str:
    """Return a name for the folder of what is made of these files: their names without suffixes."""
    stems = [Path(file).stem.strip(". ") for file in split_files(text)]
    return "+".join(filter(None, stems))[:100] or "model"


def _models_in(folder: Path) -> list[str]:
    try:
        return sorted(entry.name for entry in folder.iterdir() if has_model_suffix(entry.name))
    except OSError:
        return []


def similar_file(name: str) -> str:
    """Return a hint at a model's file that has this name but for the suffix; "" if there is none."""
    path = Path(name)
    same_stem = [model for model in _models_in(path.parent) if Path(model).stem == path.stem]
    return f" (did you mean {str(path.parent / same_stem[0])!r}?)" if same_stem else ""


def _similar(path: Path) -> str:
    """Return a hint at a file beside the one that is missing."""
    folder = path.parent
    if not os.path.isdir(folder):
        return f": there is no folder {folder}"
    known = {name: str(folder / name) for name in _models_in(folder)}
    if hint := similar_file(str(path)):
        return hint
    hint = did_you_mean(path.name, known)
    for name, whole in known.items():
        hint = hint.replace(repr(name), repr(whole))
    return hint

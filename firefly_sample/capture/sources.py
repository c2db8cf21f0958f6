"""The files that a scene is made of, known by their content."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from firefly_sample.capture.files import hash_file


def hash_sources(parameters: Mapping[str, Any], known: dict[str, str]) -> dict[str, str]:
    """Return the SHA-256 of each file that a scene's parameters name, by its name as given.

    Files whose hash is `known` are not read again, and others are added to it: the combinations of a sweep
    often have the same files. A model's file may name others, such as textures; these are not read.
    """
    from firefly_sample.scenes.files import split_files

    texts = [value for value in parameters.values() if isinstance(value, str) and value]
    files = [file for text in texts for file in split_files(text) if os.path.isfile(file)]
    for file in files:
        if file not in known:
            known[file] = hash_file(Path(file)) or ""
    return {file: known[file] for file in files}

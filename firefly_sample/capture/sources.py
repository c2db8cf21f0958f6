"""The files that a scene is made of, known by their content."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from firefly_sample.capture.files import hash_file


def hash_sources(parameters: Mapping[str, Any]) -> dict[str, str]:
    """Return the SHA-256 of each file that a scene's parameters name, by its name as given.

    A model's file may name others, such as textures; these are not read.
    """
    from firefly_sample.scenes.files import split_files

    texts = [value for value in parameters.values() if isinstance(value, str) and value]
    files = [file for text in texts for file in split_files(text) if os.path.isfile(file)]
    return {file: hash_file(Path(file)) or "" for file in files}

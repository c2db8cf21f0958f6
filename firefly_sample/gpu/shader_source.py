"""Shader text: includes, blocks and defines resolved, and where each line came from."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from firefly_sample.assets import asset_dir
from firefly_sample.errors import ShaderError
from firefly_sample.gpu.blocks import BLOCKS, block_glsl
from firefly_sample.gpu.light_records import RECORDS, record_glsl
from firefly_sample.plan.variants import SHADER_CONSTANTS

_DIRECTIVE = re.compile(
    r'\s*#(?:include\s+"(?P<include>[^"]+)"|block\s+(?P<block>\w+)|record\s+(?P<record>\w+))\s*$'
)
# Mesa: 0:12(3): error; NVIDIA: 0(12) : error; macOS and Intel: ERROR: 0:12:
_ERROR_LINE = re.compile(r"\b0[:(](\d+)")

Line = tuple[str, str, int]
"""Its text, file and line number there."""


@dataclass(frozen=True)
class ShaderSource:
    """Resolved text, and for each of its lines the file and line that it came from."""

    name: str
    text: str
    origins: tuple[tuple[str, int], ...]

    def explain(self, log: str) -> str:
        """Return a compiler's first error as ``file:line: error``."""
        for line in log.splitlines():
            found = _ERROR_LINE.search(line)
            if found and 1 <= int(found.group(1)) <= len(self.origins):
                file, number = self.origins[int(found.group(1)) - 1]
                return f"{file}:{number}: " + line[found.end() :].lstrip("):( 0123456789")
        return f"{self.name}: {' '.join(log.split())}"


def load_source(name: str, defines: dict[str, int], folder: Path | None = None) -> ShaderSource:
    """Read the shader `name` and resolve it; files that are not in `folder` are the package's.

    The first ``#include "include/x.glsl"`` of each file is replaced by it, ``#block View`` by the block's
    declaration, ``#record PointLight`` by the GLSL that reads the record in this stage. `defines` follow the
    ``#version`` line, after the constants that they are compared with. It raises `ShaderError` if a file, a
    block or a record does not exist.
    """
    return resolve_source(name, _text_of(folder, name), defines, folder)


def resolve_source(name: str, text: str, defines: dict[str, int], folder: Path | None = None) -> ShaderSource:
    """Resolve `text`, which must begin with #version, as `load_source` does a file's.

    The stage is the part of `name` after the last dot.
    """
    lines: list[Line] = []
    stage = name.rsplit(".", 1)[-1]
    _read(folder, name, text, lines, {name}, lambda record: record_glsl(record, defines, stage))
    if not lines or not lines[0][0].startswith("#version"):
        raise ShaderError(f"{name}:1: a shader must begin with #version")
    given = SHADER_CONSTANTS | dict(sorted(defines.items()))
    lines[1:1] = [(f"#define {key} {value}", "<defines>", 1) for key, value in given.items()]
    text = "".join([f"{line}\n" for line, _, _ in lines])
    return ShaderSource(name, text, tuple([(file, number) for _, file, number in lines]))


def _text_of(folder: Path | None, name: str) -> str:
    """Return the text of a shader in `folder`, or else in the package."""
    if folder is None or not (folder / name).exists():
        folder = asset_dir("shaders")
    try:
        path = str(folder / name)
        now = os.stat(path)
        return _text_at(path, now.st_mtime_ns, now.st_size)
    except OSError as error:
        raise ShaderError(
            f"shader {name!r} cannot be read ({error.strerror}): reinstall firefly_sample"
        ) from None


@lru_cache(maxsize=256)
def _text_at(path: str, _changed: int, _size: int) -> str:
    """Return the text of a file, which is kept until its time or size changes: many programs include it."""
    return Path(path).read_text(encoding="utf-8")


@lru_cache(maxsize=256)
def _pieces(name: str, text: str) -> list[tuple[list[Line], re.Match[str] | None, int]]:
    """Return a file's lines up to each directive, the directive and its line number; None at the end."""
    pieces: list[tuple[list[Line], re.Match[str] | None, int]] = []
    plain: list[Line] = []
    for number, line in enumerate(text.splitlines(), 1):
        found = _DIRECTIVE.match(line) if "#" in line else None
        if found is None:
            plain.append((line, name, number))
        else:
            pieces.append((plain, found, number))
            plain = []
    return [*pieces, (plain, None, 0)]


def _read(
    folder: Path | None,
    name: str,
    text: str,
    lines: list[Line],
    seen: set[str],
    record_text: Callable[[str], str],
) -> None:
    """Add the lines of a file and of what it includes."""
    for plain, found, number in _pieces(name, text):
        lines.extend(plain)
        if found is None:
            continue
        if wanted := found["include"]:
            if wanted not in seen:
                seen.add(wanted)
                _read(folder, wanted, _text_of(folder, wanted), lines, seen, record_text)
        else:
            kind, known, text_of = (
                ("uniform block", BLOCKS, block_glsl) if found["block"] else ("record", RECORDS, record_text)
            )
            wanted = found["block"] or found["record"]
            if wanted not in known:
                raise ShaderError(f"{name}:{number}: there is no {kind} {wanted!r}")
            lines.extend((made, name, number) for made in text_of(wanted).splitlines())

"""Shader text: includes, blocks and defines resolved, and where each line came from.

A shader that loops over several sets of lights, which differ in kind and formulas, includes the code of a set
once for each: ``#light_sets "include/light_set.glsl"``. Each copy has the defines of its set, and names of
its own for what it declares (`OWN_NAMES`). A line after ``#each_light_set`` is written for each set, with its
number in place of ``@``.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from firefly_sample.assets import asset_dir
from firefly_sample.errors import ShaderError
from firefly_sample.gpu.blocks import BLOCKS, block_glsl
from firefly_sample.gpu.light_records import RECORDS, record_glsl
from firefly_sample.plan.variants import CONSTANTS, OPTIONAL, SHADER_CONSTANTS, constants_of

_DIRECTIVE = re.compile(
    r'\s*#(?:include\s+"(?P<include>[^"]+)"|light_sets\s+"(?P<sets>[^"]+)"|each_light_set\s(?P<each>.*)|block\s+(?P<block>\w+)'
    r"|record\s+(?P<record>\w+))\s*$"
)
OWN_NAMES = (
    *("Light", "fetch_light", "arrives", "in_reach", "falloff", "light_surface", "light_of_set"),
    *("Cell", "masks_at", "tile_of", "find_cell", "next_light"),
    *("u_lights", "u_light_count", "u_slices", "u_slice_count", "u_masks", "u_tiling", "u_first_lines"),
    "u_slicing",
)
"""Names that the code of a set of lights declares; in the copy of set 0, ``Light`` is ``Light_0``."""
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
    _Reader(folder, name.rsplit(".", 1)[-1], lines).read(name, text, defines, {name})
    if not lines or not lines[0][0].startswith("#version"):
        raise ShaderError(f"{name}:1: a shader must begin with #version")
    given = SHADER_CONSTANTS | dict(sorted(defines.items()))
    for field in CONSTANTS.keys() & OPTIONAL:
        if field.upper() in defines:
            given |= constants_of(field)
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


class _Reader:
    """Adds the lines of files, and of what they include, to `lines`."""

    def __init__(self, folder: Path | None, stage: str, lines: list[Line]) -> None:
        self._folder, self._stage, self._lines = folder, stage, lines

    def read(self, name: str, text: str, defines: dict[str, int], seen: set[str]) -> None:
        """Add the lines of a file; files that were `seen` are not included again."""
        for plain, found, number in _pieces(name, text):
            self._lines.extend(plain)
            if found is None:
                continue
            if wanted := found["include"]:
                if wanted not in seen:
                    seen.add(wanted)
                    self.read(wanted, _text_of(self._folder, wanted), defines, seen)
            elif wanted := found["sets"]:
                self._read_sets(name, number, wanted, defines, seen)
            elif each := found["each"]:
                sets = range(defines["LIGHT_SETS"])
                self._lines.extend((each.replace("@", str(index)), name, number) for index in sets)
            else:
                made = self._declaration(name, number, found["block"], found["record"], defines)
                self._lines.extend((part, name, number) for part in made.splitlines())

    def _read_sets(
        self, name: str, number: int, wanted: str, defines: dict[str, int], seen: set[str]
    ) -> None:
        """Add the code of a set of lights once for each set."""
        text = _text_of(self._folder, wanted)
        for index in range(defines["LIGHT_SETS"]):
            start = f"LIGHT_SET_{index}_"
            own = {key.removeprefix(start): value for key, value in defines.items() if key.startswith(start)}
            given = [(key, str(value)) for key, value in own.items()]
            given += [(called, f"{called}_{index}") for called in OWN_NAMES]
            before = [line for key, value in given for line in (f"#undef {key}", f"#define {key} {value}")]
            self._lines.extend((line, name, number) for line in before)
            self.read(wanted, text, defines | own, set(seen))
        self._lines.extend((f"#undef {called}", name, number) for called in OWN_NAMES)

    def _declaration(
        self, name: str, number: int, block: str | None, record: str | None, defines: dict[str, int]
    ) -> str:
        """Return the GLSL of a block or a record."""
        if block is not None:
            if block not in BLOCKS:
                raise ShaderError(f"{name}:{number}: there is no uniform block {block!r}")
            return block_glsl(block)
        assert record is not None
        if record not in RECORDS:
            raise ShaderError(f"{name}:{number}: there is no record {record!r}")
        return record_glsl(record, defines, self._stage)

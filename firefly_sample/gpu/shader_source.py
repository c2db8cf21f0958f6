"""Shader text: includes, blocks and defines resolved, and where each line came from."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from firefly_sample.assets import asset_dir
from firefly_sample.errors import ShaderError
from firefly_sample.gpu.blocks import BLOCKS, block_glsl

__all__ = ["ShaderSource", "load_source"]

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_BLOCK = re.compile(r"^\s*#block\s+(\w+)\s*$")
# Mesa: 0:12(3): error; NVIDIA: 0(12) : error; macOS and Intel: ERROR: 0:12:
_ERROR_LINE = re.compile(r"\b0[:(](\d+)")


@dataclass(frozen=True)
class ShaderSource:
    """Resolved text, and for each of its lines the file and line that it came from."""

    name: str
    text: str
    origins: tuple[tuple[str, int], ...]

    def explain(self, log: str) -> str:
        """A compiler's first complaint as ``file:line: what``."""
        for line in log.splitlines():
            found = _ERROR_LINE.search(line)
            if found and 1 <= int(found.group(1)) <= len(self.origins):
                file, number = self.origins[int(found.group(1)) - 1]
                what = line[found.end() :].lstrip("):( 0123456789")
                return f"{file}:{number}: {what}"
        return f"{self.name}: {' '.join(log.split())}"


def load_source(name: str, defines: dict[str, int], folder: Path | None = None) -> ShaderSource:
    """Read the shader `name` and resolve it.

    ``#include "include/x.glsl"`` is replaced once each, ``#block View`` by the block's declaration, and
    `defines` follow the ``#version`` line.

    Raises
    ------
    ShaderError
        If a file or a block does not exist.
    """
    folder = folder or asset_dir("shaders")
    lines: list[tuple[str, str, int]] = []
    _read(folder, name, lines, set())
    if not lines or not lines[0][0].startswith("#version"):
        raise ShaderError(f"{name}:1: a shader must begin with #version")
    head = [(f"#define {key} {value}", "<defines>", 1) for key, value in sorted(defines.items())]
    lines[1:1] = head
    return ShaderSource(
        name,
        "\n".join(line for line, _, _ in lines) + "\n",
        tuple((file, number) for _, file, number in lines),
    )


def _read(folder: Path, name: str, lines: list[tuple[str, str, int]], seen: set[str]) -> None:
    if name in seen:
        return
    seen.add(name)
    try:
        text = (folder / name).read_text(encoding="utf-8")
    except OSError as error:
        raise ShaderError(
            f"shader {name!r} cannot be read ({error.strerror}): reinstall firefly_sample"
        ) from None
    for number, line in enumerate(text.splitlines(), 1):
        include, block = _INCLUDE.match(line), _BLOCK.match(line)
        if include:
            _read(folder, include.group(1), lines, seen)
        elif block:
            if block.group(1) not in BLOCKS:
                raise ShaderError(f"{name}:{number}: there is no uniform block {block.group(1)!r}")
            lines.extend((text_line, name, number) for text_line in block_glsl(block.group(1)).splitlines())
        else:
            lines.append((line, name, number))

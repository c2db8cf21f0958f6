"""Compiled shaders by (stem, variant, outputs), with their uniforms checked both ways."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import moderngl
import numpy as np

from firefly_sample.errors import GpuError, ShaderError
from firefly_sample.gpu.blocks import BLOCKS, binding
from firefly_sample.gpu.raw import Pointer
from firefly_sample.gpu.shader_source import ShaderSource, load_source
from firefly_sample.plan.variants import Variant, defines


class Program:
    """A linked program that knows its uniforms, samplers and blocks."""

    def __init__(
        self, ctx: moderngl.Context, vertex: ShaderSource, fragment: ShaderSource, outputs: tuple[str, ...]
    ):
        self.name = fragment.name.removesuffix(".frag")
        self._ctx = ctx
        self._texts = (vertex.text, fragment.text)
        try:
            self.mgl = ctx.program(
                vertex_shader=vertex.text,
                fragment_shader=fragment.text,
                fragment_outputs={f"o_{name}": index for index, name in enumerate(outputs)},
            )
        except moderngl.Error as error:
            # moderngl's report is headed by the stage's name
            source = vertex if "vertex_shader" in str(error) else fragment
            raise ShaderError(source.explain(str(error))) from error
        self.attributes = frozenset(
            name for name in self.mgl if isinstance(self.mgl[name], moderngl.Attribute)
        )
        self._uniforms = frozenset(name for name in self.mgl if isinstance(self.mgl[name], moderngl.Uniform))
        for name in BLOCKS:
            block = self.mgl.get(name, None)
            if isinstance(block, moderngl.UniformBlock):
                block.binding = binding(name)
        self._units: dict[str, int] = {}
        self._values: dict[str, Any] = {}
        self._checked: set[tuple[str, ...]] = set()
        self._pointers: dict[np.dtype[Any], tuple[Pointer, ...]] = {}

    def use(
        self,
        uniforms: Mapping[str, Any] | None = None,
        textures: Mapping[str, moderngl.Texture] | None = None,
    ) -> None:
        """Set every uniform that changed, numbers or tuples of them, and bind every texture.

        It raises `GpuError` if an active uniform is not given, or a given name does not occur in the source.
        """
        uniforms, textures = uniforms or {}, textures or {}
        given = (*uniforms, *textures)
        if given not in self._checked:
            self._check(given)
        for name, value in uniforms.items():
            self._set(name, value)
        for name, texture in textures.items():
            if name in self._uniforms:
                unit = self._units.setdefault(name, len(self._units))
                self._set(name, unit)
                texture.use(unit)

    def samples(self, name: str) -> bool:
        """Return whether a sampler of this name is in use."""
        return name in self._uniforms

    def _set(self, name: str, value: Any) -> None:
        """Set a uniform, if the program has it and it has another value."""
        if name in self._uniforms and self._values.get(name) != value:
            self._values.pop(name, None)  # after an interrupt in between, its value is unknown
            self.mgl[name] = value
            self._values[name] = value

    def _check(self, given: tuple[str, ...]) -> None:
        missing = self._uniforms.difference(given)
        if missing:
            raise GpuError(f"shader {self.name!r}: uniform {min(missing)!r} is not given")
        for name in sorted(set(given) - self._uniforms):
            # an optimised-out uniform is fine, a misspelt one is not
            if not any(re.search(rf"\b{name}\b", text) for text in self._texts):
                raise GpuError(f"shader {self.name!r}: there is no uniform {name!r}")
        self._checked.add(given)

    def attributes_of(
        self, buffer: moderngl.Buffer, dtype: np.dtype[Any], per_instance: bool = False
    ) -> tuple[Any, ...] | None:
        """Return the description of a buffer of rows for a vertex array, None if the program uses no field.

        The fields of `dtype`, a row, are named as the attributes; those that the program does not use are
        skipped.
        """
        formats, names = [], []
        for name in dtype.names or ():
            field = dtype[name]
            if name in self.attributes:
                formats.append(f"{field.itemsize // 4}{field.base.kind}")
                names.append(name)
            else:
                formats.append(f"{field.itemsize}x")
        rate = "/i" if per_instance else ""
        return (buffer, " ".join(formats) + rate, *names) if names else None

    def pointers(self, dtype: np.dtype[Any]) -> tuple[Pointer, ...]:
        """Return the attributes' pointers into a row of a dtype whose fields are named as they are."""
        if dtype not in self._pointers:
            self._pointers[dtype] = tuple(
                Pointer(
                    cast(moderngl.Attribute, self.mgl[name]).location,
                    field[0].itemsize // 4,
                    field[0].base.kind == "u",
                    field[1],
                )
                for name, field in (dtype.fields or {}).items()
                if name in self.attributes
            )
        return self._pointers[dtype]

    def release(self) -> None:
        """Free the GL program."""
        self.mgl.release()


class Programs:
    """Programs by (stem, variant, outputs), compiled at first use."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[str, str, Variant, tuple[str, ...]], Program] = {}

    def get(
        self,
        stem: str,
        variant: Variant,
        outputs: tuple[str, ...],
        vertex: str | None = None,
        folder: Path | None = None,
    ) -> Program:
        """Return the program of ``<stem>.frag`` and ``<vertex or stem>.vert``.

        `outputs` are the colour targets in attachment order: the shader declares ``o_<name>``. Shaders are
        looked up in `folder` before the package's own.
        """
        vertex = vertex or stem
        key = (stem, vertex, variant, outputs)
        program = self._programs.get(key)
        if program is None:
            given = defines(variant)
            sources = load_source(f"{vertex}.vert", given, folder), load_source(f"{stem}.frag", given, folder)
            program = self._programs[key] = Program(self._ctx, *sources, outputs)
        return program

    def release(self) -> None:
        """Free all programs."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()

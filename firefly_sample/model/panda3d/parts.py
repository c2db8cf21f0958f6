"""The Geoms of Panda3D's Geoms, read once and kept as long as they are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.sprites import Facing
from firefly_sample.model.panda3d.states import Surface
from firefly_sample.model.panda3d.vertices import VertexUse, animated_data, read_geom, vertex_revision
from firefly_sample.scene.geom import Geom


class Part(NamedTuple):
    """A Geom of ours and the way in which it is drawn."""

    geom: Geom
    surface: Surface


@dataclass
class _Kept:
    """The Geoms of one of Panda3D's Geoms, which is not held: Panda3D would copy it before each change."""

    revision: Any
    geoms: list[Geom]
    used: bool = True


class GeomCache:
    """Reads Geoms of Panda3D, each once for each way in which its columns are used.

    Geoms with moved vertices are changed in place. Panda3D gives each revision of any Geom a number of its
    own, so a Geom at the address of one that is gone counts as one that has changed.
    """

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._kept: dict[tuple[int, VertexUse, Any], _Kept] = {}

    def of(
        self, source: Any, use: VertexUse, name: str, facing: Facing | None = None, owner: Any = None
    ) -> list[Geom]:
        """Return our Geoms of a Geom of Panda3D, one for each kind of primitive; see `read_geom`.

        Different owners share none: squares that face the camera differ from path to path.
        """
        key, revision = (source.this, use, owner), (vertex_revision(source), facing)
        kept = self._kept.get(key)
        if kept is None:
            geoms = read_geom(source, animated_data(source), use, name, self._losses, facing)
            kept = self._kept[key] = _Kept(revision, geoms)
        elif kept.revision != revision:
            geoms = read_geom(source, animated_data(source), use, name, self._losses, facing)
            if len(geoms) != len(kept.geoms) or not all(map(_change, kept.geoms, geoms)):
                kept.geoms = geoms
            kept.revision = revision
        kept.used = True
        return kept.geoms

    def sweep(self) -> None:
        """Forget what was not asked for since the last sweep."""
        for key in [key for key, kept in self._kept.items() if not kept.used]:
            del self._kept[key]
        for kept in self._kept.values():
            kept.used = False


def _change(kept: Geom, new: Geom) -> bool:
    """Move a Geom's vertices to those of a new one; return False if more than that differs."""
    same = (
        kept.mode == new.mode
        and np.array_equal(kept.indices, new.indices)
        and len(kept.vertices) == len(new.vertices)
        and np.array_equal(kept.texcoords, new.texcoords)
        and _equal(kept.texcoords_1, new.texcoords_1)
        and kept.tangents is new.tangents is None
    )
    if not same:
        return False
    if not np.array_equal(kept.vertices, new.vertices):
        kept.set_vertices(new.vertices)
    if not np.array_equal(kept.normals, new.normals):
        kept.set_normals(new.normals)
    if not (_equal(kept.colors, new.colors) and _equal(kept.alphas, new.alphas)):
        alphas = new.alphas
        colors = new.colors
        if colors is not None and alphas is not None:
            colors = np.column_stack([colors, alphas])
        kept.set_colors(colors)
    return True


def _equal(a: Any, b: Any) -> bool:
    return a is b or (a is not None and b is not None and np.array_equal(a, b))

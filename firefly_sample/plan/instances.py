"""Geometry to draw as arrays in world space: a `Group` for what one call draws, `Instances` of groups."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.memo import Memo
from firefly_sample.plan.factors import Factors, factors_of, join_factors
from firefly_sample.plan.surface_maps import Maps, maps_of
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.render_mode import RenderMode
from firefly_sample.scene.texture import Texture

SMOOTHEST = 1.0 / 32.0
"""Roughness below which a material is drawn as if it had this one: ``shaders/include/metallic.glsl``."""


@dataclass(eq=False)
class Group:
    """All instances of one Geom that one call can draw: the same textures and cut-out; colours differ."""

    key: tuple[Any, ...]  # hashable; distinguishes groups, and stays while a walk would find the same group
    geom: Geom
    texture: Texture | None
    cutoff: float | None  # the alpha below which nothing is drawn; None for opaque instances
    double_sided: bool
    mirrored: bool  # True if the instances' matrices turn triangles inside out
    materials: tuple[Material, ...]  # each once
    which: NDArray[np.intp]  # (n,), each instance's index into `materials`
    colors: Float64 | None  # (n, 4), flat colours, which replace vertex colours
    scales: Float64 | None  # (n, 4), colour scales
    model_to_world: Float64  # (n, 4, 4)
    render_mode: RenderMode
    depth_offset: int
    ids: NDArray[np.int32]  # (n,)
    centers: Float64  # (n, 3), of the bounding spheres, world space
    radii: Float64  # (n,)
    _factors: Memo[Factors] = field(default_factory=Memo)

    @property
    def maps(self) -> Maps:
        """The textures of the materials but that of the base colour; they are the same for all of these."""
        return maps_of(self.materials, self.geom)

    @property
    def metallic(self) -> bool:
        """True if these are metallic-roughness materials."""
        return self.materials[0].metallic is not None and not self.unlit

    @property
    def blended(self) -> bool:
        """True if the materials are marked for blending, and something of the instances is not opaque."""
        return self.geom.mode == "triangles" and self.clear

    @property
    def clear(self) -> bool:
        """True where `blended` is, and for points and lines of which the same is true: they stay opaque."""
        if self.materials[0].alpha_mode != "blend":
            return False
        own = self.geom.alphas is not None and self.colors is None
        if own or any(texture.least_alpha() < 1.0 for texture in self.base_textures()):
            return True
        return bool((self.factors().base_colors[:, 3] < 1.0).any())

    def base_textures(self) -> Iterator[Texture]:
        """Yield the textures whose colours and alphas multiply the base colour."""
        modulate = self.materials[0].modulate_texture
        yield from (texture for texture in (self.texture, modulate) if texture is not None)

    @property
    def local_viewer(self) -> bool:
        """True if these have highlights that see the eye where it is, also in the look "panda3d"."""
        return self.materials[0].local_viewer and not (self.metallic or self.unlit)

    @property
    def unlit(self) -> bool:
        """True if no light meets the surfaces."""
        return self.materials[0].unlit

    @property
    def vertex_alpha(self) -> bool:
        """True if the alpha of vertex colours takes part in the cut-out."""
        return self.cutoff is not None and self.geom.alphas is not None and self.colors is None

    def factors(self) -> Factors:
        """Return the factors of all instances, remade when a material has changed."""
        return self._factors.get(
            tuple(material.revision for material in self.materials),
            lambda: factors_of(self.materials, self.which, self.colors, self.scales),
        )


class Instances:
    """The instances of some groups as columns, group by group.

    Attributes
    ----------
    groups : tuple of Group
    starts : ndarray of int, shape (groups + 1,)
        Index of each group's first instance.
    which : ndarray of int, shape (n,)
        Each instance's group.
    model_to_world, ids, centers, radii : ndarray
        As of a `Group`, of all n instances.
    """

    def __init__(self, groups: Sequence[Group]) -> None:
        self.groups = tuple(groups)
        counts = [len(group.ids) for group in groups]
        self.starts = np.concatenate([[0], np.cumsum(counts, dtype=np.intp)])
        self.which = np.repeat(np.arange(len(counts)), counts)
        self.model_to_world = _joined([group.model_to_world for group in groups], (4, 4))
        self.ids = _joined([group.ids for group in groups], (), np.int32)
        self.centers = _joined([group.centers for group in groups], (3,))
        self.radii = _joined([group.radii for group in groups], ())
        self._identity = [
            (group.key, group.geom.revision, group.mirrored, *map(id, group.materials)) for group in groups
        ]
        self._materials = tuple(material for group in groups for material in group.materials)
        self._factors: Memo[Factors] = Memo()
        self._highlights: Memo[tuple[bool, float]] = Memo()

    def draws_as(self, other: Instances) -> bool:
        """Return whether the instances of a different walk would be drawn alike."""
        return (
            self._identity == other._identity
            and self.revisions() == other.revisions()
            and np.array_equal(self.model_to_world, other.model_to_world)
            and np.array_equal(self.ids, other.ids)
            and all(
                np.array_equal(getattr(self.factors(), column.name), getattr(other.factors(), column.name))
                for column in fields(Factors)
            )
        )

    def revisions(self) -> tuple[int, ...]:
        """Return the revisions of all groups' materials."""
        return tuple(material.revision for material in self._materials)

    def factors(self) -> Factors:
        """Return the factors of all instances, remade when a material has changed."""
        return self._factors.get(
            self.revisions(), lambda: join_factors([group.factors() for group in self.groups])
        )

    def highlights(self) -> tuple[bool, float]:
        """Return whether there are Phong highlights, and the gain of metallic-roughness ones.

        The gain is the most by which they concentrate a light, seen head on: 1/(4 a^2), with a the square of
        the least roughness; 0 without such materials.
        """
        return self._highlights.get(self.revisions(), self._find_highlights)

    def _find_highlights(self) -> tuple[bool, float]:
        metals = [each for each in self._materials if each.metallic is not None and not each.unlit]
        # a texture may make any texel smoother than its factor says
        roughnesses = [0.0 if each.metallic_roughness_texture else each.roughness for each in metals]
        gain = 0.25 / max(min(roughnesses), SMOOTHEST) ** 4 if metals else 0.0
        return any(each.specular.any() and not each.unlit for each in self._materials), gain

    @cached_property
    def sphere(self) -> tuple[Float64, float]:
        """Center and radius of a sphere around all instances, world space; radius 0 if there are none."""
        if not len(self.radii):
            return np.zeros(3), 0.0
        low = (self.centers - self.radii[:, None]).min(axis=0)
        high = (self.centers + self.radii[:, None]).max(axis=0)
        return 0.5 * (low + high), float(0.5 * np.linalg.norm(high - low))


def _joined(parts: list[NDArray[Any]], shape: tuple[int, ...], dtype: Any = np.float64) -> NDArray[Any]:
    return np.concatenate([np.zeros((0, *shape), dtype=dtype), *parts])

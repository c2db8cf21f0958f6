"""Colours of instances as columns: of materials, times flat colours and colour scales of their nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.material import Material


@dataclass(frozen=True, eq=False)
class Factors:
    """Linear colours of instances at one moment, from their materials and their nodes' flat colours.

    Of their nodes' colour scales, the opacities have their share; `scaled` returns colours that have theirs.
    """

    base_colors: Float64  # (n, 4)
    ambients: Float64  # (n, 3), of a material without an ambient colour the base colour's
    emissions: Float64  # (n, 3)
    speculars: Float64  # (n, 4), the fourth is the shininess; of metallic ones metalness, roughness, 0, 0
    scales: Float64 | None = None  # (n, 3), of their colours; None if there are none

    def take(self, chosen: NDArray[Any] | slice) -> Factors:
        """Return those of the chosen instances."""
        return Factors(
            self.base_colors[chosen],
            self.ambients[chosen],
            self.emissions[chosen],
            self.speculars[chosen],
            None if self.scales is None else self.scales[chosen],
        )

    def scaled(self) -> Factors:
        """Return the same with colours multiplied by their scales."""
        if self.scales is None:
            return self
        opacity = np.ones((len(self.scales), 1))
        base = self.base_colors * np.concatenate([self.scales, opacity], axis=1)
        return Factors(base, self.ambients * self.scales, self.emissions * self.scales, self.speculars)


def factors_of(
    materials: Sequence[Material],
    which: NDArray[np.intp],
    colors: Float64 | None,
    scales: Float64 | None,
) -> Factors:
    """Return the colours of n instances.

    Parameters
    ----------
    materials, which : sequence of Material, ndarray of int, shape (n,)
        Their materials, each once, and the index of each instance's.
    colors, scales : ndarray of float64, shape (n, 4), or None
        Flat colours and colour scales.
    """

    def column(values: list[Any]) -> Float64:
        return np.array(values, dtype=np.float64)[which]

    base = column([material.base_color for material in materials])
    ambient = column([m.base_color[:3] if m.ambient is None else m.ambient for m in materials])
    if colors is not None:
        base, ambient = base * colors, ambient * colors[:, :3]
    if scales is not None:
        base[:, 3] *= scales[:, 3]
    return Factors(
        base,
        ambient,
        column([material.emission for material in materials]),
        column([_speculars(material) for material in materials]),
        None if scales is None else scales[:, :3],
    )


def _speculars(material: Material) -> tuple[float, float, float, float]:
    if material.unlit:
        return 0.0, 0.0, 0.0, 0.0
    if material.metallic is not None:
        return material.metallic, material.roughness, 0.0, 0.0
    red, green, blue = material.specular.tolist()
    return red, green, blue, material.shininess


def join_factors(parts: Sequence[Factors]) -> Factors:
    """Return the colours of all parts, one part after the other."""
    scales = None
    if any(part.scales is not None for part in parts):
        scales = np.concatenate(
            [np.ones_like(part.ambients) if part.scales is None else part.scales for part in parts]
        )
    return Factors(
        np.concatenate([np.zeros((0, 4)), *(part.base_colors for part in parts)]),
        np.concatenate([np.zeros((0, 3)), *(part.ambients for part in parts)]),
        np.concatenate([np.zeros((0, 3)), *(part.emissions for part in parts)]),
        np.concatenate([np.zeros((0, 4)), *(part.speculars for part in parts)]),
        scales,
    )

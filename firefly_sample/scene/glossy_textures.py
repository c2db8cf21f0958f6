"""Specular-glossiness materials with their textures as metallic-roughness ones, texel by texel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.specular_glossiness import to_metallic_roughness
from firefly_sample.scene.texture import Sampling, Wrap
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear

NOTICEABLE = 0.5 / 255.0
"""A reflectance, linear, that differs by more is named."""
INEXACT = "metalness and a base colour do not give all colours of specular-glossiness materials"
ONE_SAMPLER = "specular-glossiness textures are wrapped and filtered like the diffuse texture, of materials"

_BLOCK = 1 << 16
"""Texels that are converted at once."""
_SHARES = np.arange(256) / 255.0
_LINEAR = srgb_to_linear(_SHARES)

Color = tuple[float, float, float]
Color4 = tuple[float, float, float, float]
Pixels = NDArray[np.uint8]


class Image(NamedTuple):
    """A texture: uint8 (height, width, 4), sRGB with linear alpha, and its wrap modes and filters."""

    pixels: Pixels
    sampling: Sampling

    def mean(self) -> Color4:
        """Return the linear mean of all texels."""
        tables = (_LINEAR, _LINEAR, _LINEAR, _SHARES)
        counts = [np.bincount(self.pixels[..., channel].ravel(), minlength=256) for channel in range(4)]
        r, g, b, a = (np.average(table, weights=count) for table, count in zip(tables, counts, strict=True))
        return float(r), float(g), float(b), float(a)


@dataclass(frozen=True, eq=False)
class GlossyMaterial:
    """A material of KHR_materials_pbrSpecularGlossiness.

    Attributes
    ----------
    diffuse : tuple of 4 floats
        Linear colour, and opacity.
    specular : tuple of 3 floats
        Linear.
    glossiness : float
        0 to 1.
    diffuse_image, specular_image : Image, optional
        Their texels multiply these colours, and the alpha of the second multiplies `glossiness`.
    """

    diffuse: Color4 = (1.0, 1.0, 1.0, 1.0)
    specular: Color = (1.0, 1.0, 1.0)
    glossiness: float = 1.0
    diffuse_image: Image | None = None
    specular_image: Image | None = None


class MetallicMaterial(NamedTuple):
    """The same surface for a `Material`, by the names of its parameters.

    The images share a size and a sampling. `losses` say what of the surface is not kept.
    """

    base_color: Color4
    metallic: float
    roughness: float
    texture: Image | None
    metallic_roughness_texture: Image | None
    losses: list[str]


def to_metallic_material(source: GlossyMaterial) -> MetallicMaterial:
    """Return the metallic-roughness material that is nearest to a specular-glossiness one.

    Of images of two sizes, the smaller one is enlarged, in linear light and by its own filter. What comes of
    images is rounded to 8 bits. Opacity stays as it is.
    """
    red, green, blue, opacity = source.diffuse
    images = [image for image in (source.diffuse_image, source.specular_image) if image is not None]
    if not images:
        made = to_metallic_roughness((red, green, blue), source.specular, source.glossiness)
        r, g, b = made.base.tolist()
        losses = [INEXACT] if made.error > NOTICEABLE else []
        return MetallicMaterial(
            (r, g, b, opacity), float(made.metallic), float(made.roughness), None, None, losses
        )
    width = max(image.pixels.shape[1] for image in images)
    height = max(image.pixels.shape[0] for image in images)
    base, reflection = (np.full((height, width, 4), 255, dtype=np.uint8) for _ in range(2))
    worst = 0.0
    for rows in _row_blocks(height, width):
        diffuse = _texels(source.diffuse_image, rows, (width, height))
        specular = _texels(source.specular_image, rows, (width, height))
        made = to_metallic_roughness(
            diffuse[..., :3] * (red, green, blue),
            specular[..., :3] * source.specular,
            specular[..., 3] * source.glossiness,
        )
        worst = max(worst, float(made.error.max()))
        base[rows, :, :3] = _codes(linear_to_srgb(made.base))
        base[rows, :, 3] = _codes(diffuse[..., 3])
        reflection[rows, :, 1] = _codes(made.roughness)
        reflection[rows, :, 2] = _codes(made.metallic)
    sampling = images[0].sampling
    losses = [INEXACT] if worst > NOTICEABLE else []
    if images[-1].sampling != sampling:
        losses.append(ONE_SAMPLER)
    color, texture = (1.0, 1.0, 1.0, opacity), Image(base, sampling)
    if (reflection == reflection[0, 0]).all():
        _, roughness, metallic, _ = (reflection[0, 0] / 255.0).tolist()
        return MetallicMaterial(color, metallic, roughness, texture, None, losses)
    return MetallicMaterial(color, 1.0, 1.0, texture, Image(reflection, sampling), losses)


def _codes(values: Float64) -> Pixels:
    return np.rint(values * 255.0).astype(np.uint8)


def _row_blocks(height: int, width: int) -> Iterator[slice]:
    """Yield the rows of an image, some at a time."""
    step = max(_BLOCK // width, 1)
    return (slice(first, min(first + step, height)) for first in range(0, height, step))


def _texels(image: Image | None, rows: slice, size: tuple[int, int]) -> Float64:
    """Return the linear texels of some rows of an image of that (width, height), white without one."""
    if image is None:
        return np.ones((1, 1, 4))
    height, width, _ = image.pixels.shape
    nearest = image.sampling.magfilter == "nearest"
    above, below, share = _neighbours(rows, height, size[1], image.sampling.wrap_v, nearest)
    texels = _mixed(_linear(image.pixels[above]), _linear(image.pixels[below]), share[:, None, None])
    left, right, share = _neighbours(slice(size[0]), width, size[0], image.sampling.wrap_u, nearest)
    return _mixed(texels[:, left], texels[:, right], share[:, None])


def _linear(pixels: Pixels) -> Float64:
    return np.concatenate([_LINEAR[pixels[..., :3]], _SHARES[pixels[..., 3:]]], axis=-1)


def _mixed(a: Float64, b: Float64, share: Float64) -> Float64:
    return a + (b - a) * share if share.any() else a


def _neighbours(
    wanted: slice, count: int, target: int, wrap: Wrap, nearest: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp], Float64]:
    """Return the two of `count` texels around some of `target` texels each, and the share of the second."""
    place = (np.arange(target)[wanted] + 0.5) * count / target - 0.5
    first = np.floor(place + 0.5 if nearest else place).astype(np.intp)
    share = np.zeros(len(place)) if nearest else place - first
    if wrap == "repeat":
        return first % count, (first + 1) % count, share
    return np.clip(first, 0, count - 1), np.clip(first + 1, 0, count - 1), share

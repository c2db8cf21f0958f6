"""Panda3D's textures, with their samplers, as ours."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypedDict

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.texels import TextureKind, read_texels
from firefly_sample.scene.texture import MagFilter, MinFilter, Texture, Wrap

_WRAPS: dict[str, Wrap] = {"repeat": "repeat", "clamp": "clamp", "mirror": "mirror", "invalid": "repeat"}
_NEAR_WRAPS: dict[str, Wrap] = {"mirror_once": "mirror", "border_color": "clamp"}
_MINFILTERS: dict[str, MinFilter] = {
    "nearest": "nearest",
    "linear": "linear",
    "nearest_mipmap_nearest": "nearest_mipmap_nearest",
    "linear_mipmap_nearest": "linear_mipmap_nearest",
    "nearest_mipmap_linear": "nearest_mipmap_linear",
    "linear_mipmap_linear": "linear_mipmap_linear",
}
_NO_MIPMAPS_BELOW, _ALL_MIPMAPS_ABOVE = 0.0, 30.0
"""Limits of the level of detail that leave every level of a texture's mipmaps in use."""


class Sampling(TypedDict):
    """The keywords of a `Texture` that a sampler decides."""

    wrap_u: Wrap
    wrap_v: Wrap
    minfilter: MinFilter
    magfilter: MagFilter


@dataclass
class _Kept:
    """A texture of ours, and the one it is made from, which is held so that no other gets its address."""

    source: Any
    kind: TextureKind
    image: int
    texture: Texture


class ReadTexture(NamedTuple):
    """A texture of ours, made from one of Panda3D's for one surface."""

    kept: _Kept
    properties: int
    losses: Losses

    @property
    def texture(self) -> Texture:
        """The texture itself."""
        return self.kept.texture

    def is_current(self) -> bool:
        """Replace the image in place if it has changed; return False if more than that has."""
        kept = self.kept
        source = kept.source
        if source.get_properties_modified().get_seq() != self.properties:
            return False
        if source.get_image_modified().get_seq() != kept.image:
            kept.texture.set_pixels(
                read_texels(source, kept.kind, partial(self.losses.add, name=source.get_name()))
            )
            kept.image = source.get_image_modified().get_seq()  # after reading, which may have loaded it
        return True


class TextureReader:
    """Makes textures from Panda3D's, each once for each sampler and use."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._kept: dict[tuple[Any, ...], _Kept] = {}

    def read(self, source: Any, sampler: Any, kind: TextureKind) -> ReadTexture:
        """Return a texture of ours for one of Panda3D's as one of Panda3D's samplers samples it."""
        sampling = read_sampler(sampler, source.get_name(), self._losses, _is_bordered(source, sampler, kind))
        key = (source.this, kind, *sampling.values())
        kept = self._kept.get(key)
        if kept is None:
            codes = read_texels(source, kind, partial(self._losses.add, name=source.get_name()))
            texture = Texture(codes, source.get_name() or "texture", **sampling)
            kept = _Kept(source, kind, source.get_image_modified().get_seq(), texture)
            self._kept[key] = kept
        read = ReadTexture(kept, source.get_properties_modified().get_seq(), self._losses)
        read.is_current()
        return read

    def sweep(self, used: Collection[Texture]) -> None:
        """Forget all textures but those that are in use."""
        self._kept = {key: kept for key, kept in self._kept.items() if kept.texture in used}


def _is_bordered(source: Any, sampler: Any, kind: TextureKind) -> bool:
    """Return whether an image ends in its sampler's border, as those of fonts do."""
    if sampler.WM_border_color not in (sampler.get_wrap_u(), sampler.get_wrap_v()):
        return False
    codes = read_texels(source, kind, lambda loss: None)
    edges = np.concatenate([codes[0], codes[-1], codes[:, 0], codes[:, -1]])
    border = np.rint(255.0 * np.clip(tuple(sampler.get_border_color()), 0.0, 1.0))
    return bool((edges == border).all() or not (edges[:, 3].any() or border[3]))


def read_sampler(sampler: Any, name: str, losses: Losses, is_bordered: bool = False) -> Sampling:
    """Return what of a SamplerState of Panda3D a texture of ours has; name the rest by the texture's name."""
    wraps = [sampler.format_wrap_mode(wrap) for wrap in (sampler.get_wrap_u(), sampler.get_wrap_v())]
    for wrap in wraps:
        if wrap in _NEAR_WRAPS and not (wrap == "border_color" and is_bordered):
            losses.add(f"the wrap mode {wrap} of textures is drawn as {_NEAR_WRAPS[wrap]}", name)
    wrap_u, wrap_v = (_WRAPS.get(wrap) or _NEAR_WRAPS[wrap] for wrap in wraps)
    minfilter = sampler.format_filter_type(sampler.get_effective_minfilter())
    magfilter = sampler.format_filter_type(sampler.get_effective_magfilter())
    if minfilter == "shadow":
        losses.add("textures that compare depths are drawn as plain ones", name)
    if sampler.get_effective_anisotropic_degree() > 1:
        losses.add("anisotropic filters of textures are not followed", name)
    limits = sampler.get_min_lod() > _NO_MIPMAPS_BELOW or sampler.get_max_lod() < _ALL_MIPMAPS_ABOVE
    if "mipmap" in minfilter and (sampler.get_lod_bias() or limits):
        losses.add("biases and limits of textures' levels of detail are not followed", name)
    return Sampling(
        wrap_u=wrap_u,
        wrap_v=wrap_v,
        minfilter=_MINFILTERS.get(minfilter, "linear"),
        magfilter="nearest" if magfilter.startswith("nearest") else "linear",
    )

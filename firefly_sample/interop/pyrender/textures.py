"""Textures to and from pyrender's, with their samplers, which hold the numbers of glTF.

pyrender's shader reads roughness from the first channel of a metallic-roughness texture and metalness from
the second; glTF and this package have them in green and blue. Therefore red, green and blue change places.
All textures keep four channels, also where pyrender needs fewer: it skews an image if the bytes of a row are
not a multiple of four.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypedDict, get_args

import numpy as np
from numpy.typing import NDArray

from firefly_sample.losses import Losses
from firefly_sample.scene.texture import MagFilter, MinFilter, Texture, Wrap

_WRAPS: dict[str, Wrap] = {"REPEAT": "repeat", "CLAMP_TO_EDGE": "clamp", "MIRRORED_REPEAT": "mirror"}
_MAGFILTERS: tuple[MagFilter, ...] = get_args(MagFilter)
_MINFILTERS: tuple[MinFilter, ...] = get_args(MinFilter)
_BYTES = (0x0DE1, 0x1401)
"""OpenGL's numbers for a texture of two dimensions and for unsigned bytes."""
_ROUGHNESS_FIRST, _RED_FIRST = [1, 2, 0, 3], [2, 0, 1, 3]
"""A metallic-roughness texture's channels here in pyrender's order, and those of pyrender in ours."""
_OTHER_SAMPLERS = "wrap modes and filters that glTF lacks become those of plain textures"


class SamplingOptions(TypedDict, total=False):
    """The keywords of a `Texture` that a sampler decides."""

    wrap_u: Wrap
    wrap_v: Wrap
    minfilter: MinFilter
    magfilter: MagFilter


def pyrender_texture(texture: Texture, metallic_roughness: bool = False) -> Any:
    """Return a texture as a pyrender Texture with a sampler of its own.

    With `metallic_roughness`, its channels are in pyrender's order for that use.
    """
    import pyrender

    gltf = pyrender.GLTF
    wraps = {ours: getattr(gltf, theirs) for theirs, ours in _WRAPS.items()}
    sampler = pyrender.Sampler(
        magFilter=getattr(gltf, texture.magfilter.upper()),
        minFilter=getattr(gltf, texture.minfilter.upper()),
        wrapS=wraps[texture.wrap_u],
        wrapT=wraps[texture.wrap_v],
    )
    pixels = texture.pixels[..., _ROUGHNESS_FIRST] if metallic_roughness else texture.pixels
    return pyrender.Texture(name=texture.name, sampler=sampler, source=pixels, source_channels="RGBA")


Keep = Callable[[Any, bool, Callable[[], Any]], Any]
"""Returns what the last argument makes of the first, once for each value of the second."""


class TextureReader:
    """Makes textures from pyrender's, each once for each use.

    `keep` keeps them beyond the reader's own life.
    """

    def __init__(self, losses: Losses, keep: Keep | None = None) -> None:
        self._losses = losses
        self._textures: dict[tuple[int, bool], Texture | None] = {}
        self._keep = keep or self._keep_here

    def texture(self, source: Any, owner: str, metallic_roughness: bool = False) -> Texture | None:
        """Return a pyrender Texture as a texture, or None, with a loss, without a plain image of bytes.

        `owner` is the name for one without a name. With `metallic_roughness`, its first two channels, which
        are roughness and metalness, become green and blue. None is None.
        """
        if source is None:
            return None
        name = source.name or owner
        made: Texture | None = self._keep(
            source, metallic_roughness, lambda: self._new_texture(source, name, metallic_roughness)
        )
        return made

    def _keep_here(self, source: Any, use: bool, make: Callable[[], Texture | None]) -> Texture | None:
        key = id(source), use
        if key not in self._textures:
            self._textures[key] = make()
        return self._textures[key]

    def _new_texture(self, source: Any, name: str, metallic_roughness: bool) -> Texture | None:
        pixels = _pixels(source)
        if pixels is None:
            self._losses.add("textures without a plain image of bytes are left out", name)
            return None
        if metallic_roughness:
            pixels = pixels[..., _RED_FIRST]
        options, whole = sampling_options(source.sampler)
        if not whole:
            self._losses.add(_OTHER_SAMPLERS, name)
        return Texture(pixels, name, **options)


def _pixels(source: Any) -> NDArray[np.uint8] | None:
    """Return a pyrender Texture's image with four channels, as OpenGL fills them in: 0, and 255 for alpha."""
    image = source.source
    if image is None or image.ndim < 2 or (source.tex_type, source.data_format) != _BYTES:
        return None
    image = image.reshape(*image.shape[:2], -1)
    pixels = np.zeros((*image.shape[:2], 4), dtype=np.uint8)
    pixels[..., 3] = 255
    pixels[..., : image.shape[2]] = image
    return pixels


def sampling_options(sampler: Any) -> tuple[SamplingOptions, bool]:
    """Return the keywords of a pyrender Sampler for a `Texture`, and whether all of it is among them.

    Filters that are None are pyrender's own, which are the defaults here. A number that glTF does not have
    is left out.
    """
    import pyrender

    gltf = pyrender.GLTF
    wraps = {getattr(gltf, theirs): ours for theirs, ours in _WRAPS.items()}
    magfilters = {getattr(gltf, name.upper()): name for name in _MAGFILTERS}
    minfilters = {getattr(gltf, name.upper()): name for name in _MINFILTERS}
    options: SamplingOptions = {}
    if sampler.wrapS in wraps:
        options["wrap_u"] = wraps[sampler.wrapS]
    if sampler.wrapT in wraps:
        options["wrap_v"] = wraps[sampler.wrapT]
    if sampler.magFilter in magfilters:
        options["magfilter"] = magfilters[sampler.magFilter]
    if sampler.minFilter in minfilters:
        options["minfilter"] = minfilters[sampler.minFilter]
    given = 2 + (sampler.magFilter is not None) + (sampler.minFilter is not None)
    return options, len(options) == given

"""Wrap modes and filters of textures to and from pyrender's samplers, which hold the numbers of glTF."""

from __future__ import annotations

from typing import Any, TypedDict, get_args

from firefly_sample.scene.material import MagFilter, MinFilter, Texture, Wrap

_WRAPS: dict[str, Wrap] = {"REPEAT": "repeat", "CLAMP_TO_EDGE": "clamp", "MIRRORED_REPEAT": "mirror"}
_MAGFILTERS: tuple[MagFilter, ...] = get_args(MagFilter)
_MINFILTERS: tuple[MinFilter, ...] = get_args(MinFilter)


class SamplingOptions(TypedDict, total=False):
    """The keywords of a `Texture` that a sampler decides."""

    wrap_u: Wrap
    wrap_v: Wrap
    minfilter: MinFilter
    magfilter: MagFilter


def pyrender_texture(texture: Texture) -> Any:
    """Return a texture as a pyrender Texture with a sampler of its own."""
    import pyrender

    gltf = pyrender.GLTF
    wraps = {ours: getattr(gltf, theirs) for theirs, ours in _WRAPS.items()}
    sampler = pyrender.Sampler(
        magFilter=getattr(gltf, texture.magfilter.upper()),
        minFilter=getattr(gltf, texture.minfilter.upper()),
        wrapS=wraps[texture.wrap_u],
        wrapT=wraps[texture.wrap_v],
    )
    return pyrender.Texture(name=texture.name, sampler=sampler, source=texture.pixels, source_channels="RGBA")


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

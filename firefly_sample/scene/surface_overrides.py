"""Parts of materials that nodes replace: the texture, the transparency, the sides, and whether they are lit.

The rules are those of Panda3D's attributes (found by testing its classes). A node's own value replaces
the one from above, unless that one has a higher priority. What a Geom's own material has counts as a
value of priority 0 at the Geom: its texture, if there is one; blending or a cut-out; drawing both sides;
being unlit.
"""

from __future__ import annotations

import copy
from typing import Final, Literal, NamedTuple
from weakref import WeakKeyDictionary

from firefly_sample.scene.material import AlphaMode, Material
from firefly_sample.scene.node import inherit
from firefly_sample.scene.texture import Texture

OFF: Final = "off"
"""In place of a texture: none."""
_KEPT = 64
"""Variants kept of one material; of a film of textures, the oldest are made again."""

TRANSPARENCIES: dict[int, AlphaMode] = {0: "opaque", 1: "blend", 3: "mask", 4: "mask", 5: "mask", 6: "blend"}
"""Panda3D's modes by number: none, alpha, multisample, multisample_mask, binary, dual; 2 is not drawn."""


class SurfaceOverrides(NamedTuple):
    """Values that a node has for its surfaces and those below it; None is no value."""

    texture: Texture | Literal["off"] | None = None
    texture_priority: int = 0
    transparency: int | None = None
    transparency_priority: int = 0
    two_sided: bool | None = None
    two_sided_priority: int = 0
    unlit: bool | None = None
    unlit_priority: int = 0


NOTHING = SurfaceOverrides()


def composed(above: SurfaceOverrides | None, own: SurfaceOverrides) -> SurfaceOverrides:
    """Return the values at a node, from those above it and its own."""
    if above is None:
        return own
    return SurfaceOverrides(
        *_composed_texture(above, own),
        *inherit(
            above.transparency, above.transparency_priority, own.transparency, own.transparency_priority
        ),
        *inherit(above.two_sided, above.two_sided_priority, own.two_sided, own.two_sided_priority),
        *inherit(above.unlit, above.unlit_priority, own.unlit, own.unlit_priority),
    )


def _composed_texture(
    above: SurfaceOverrides, own: SurfaceOverrides
) -> tuple[Texture | Literal["off"] | None, int]:
    """Return the texture and its priority; one that is off has a priority over all textures or over none."""
    if own.texture == OFF and above.texture != OFF:
        return OFF, own.texture_priority
    if above.texture == OFF and own.texture not in (OFF, None):
        off = above.texture_priority > 0
        return (OFF, above.texture_priority) if off else (own.texture, own.texture_priority)
    return inherit(above.texture, above.texture_priority, own.texture, own.texture_priority)


_variants: WeakKeyDictionary[Material, dict[tuple[object, ...], Material]] = WeakKeyDictionary()


def overridden(material: Material, overrides: SurfaceOverrides) -> Material:
    """Return a material with the parts that `overrides` replace.

    It is the material itself if there are none, and the same one each time for the same parts. A variant
    takes what the material now has.
    """
    changes: dict[str, object] = {}
    texture, mode, sides = overrides.texture, overrides.transparency, overrides.two_sided
    if texture is not None and (material.texture is None or overrides.texture_priority > 0):
        changes["texture"] = None if texture == OFF else texture
        if texture == OFF:
            changes["modulate_texture"] = None
    if mode is not None and (material.alpha_mode == "opaque" or overrides.transparency_priority > 0):
        changes["alpha_mode"] = TRANSPARENCIES[mode]
    if sides is not None and (not material.double_sided or overrides.two_sided_priority > 0):
        changes["double_sided"] = sides
    if overrides.unlit is not None and (not material.unlit or overrides.unlit_priority > 0):
        changes["unlit"] = overrides.unlit
    changes = {name: value for name, value in changes.items() if value != getattr(material, name)}
    if not changes:
        return material
    variants = _variants.setdefault(material, {})
    key = tuple(changes.items())
    variant = variants.get(key)
    if variant is None:
        if len(variants) >= _KEPT:
            del variants[next(iter(variants))]
        variant = variants[key] = copy.copy(material)
    vars(variant).update(vars(material) | changes)
    return variant

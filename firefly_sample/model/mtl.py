"""Material libraries (.mtl) of Wavefront OBJ files.

The colours are display colours (sRGB), as other viewers show them. `Ka` is not read, since exporters leave it
at any value: ambient light is reflected like other light. `Pr` and `Pm`, roughness and the share of a metal,
make a metallic-roughness material, and take the place of `Ks` and `Ns`.
"""

from __future__ import annotations

import math
import re

from firefly_sample.model.builder import Builder
from firefly_sample.model.conventions import linear_color
from firefly_sample.model.data import MaterialData
from firefly_sample.scene.material import LARGEST_SCALE
from firefly_sample.scene.texture import Wrap

Statements = dict[str, str]
"""The statements of a material: keywords in small letters, and the text behind them."""

_OPTION = re.compile(
    r"-(\w+)\s+((?:(?:on|off|[rgbmlz]|sphere|cube_\w+|[-+]?[\d.][-+.\de]*)\s+)+)", re.IGNORECASE
)
"""An option of a texture, and its values."""
_NEUTRAL = {"o": 0.0, "s": 1.0, "t": 0.0}
"""Options that move a texture, and the number that does not."""
_MULTIPLIER = re.compile(r"-bm\s+([-+.\de]+)", re.IGNORECASE)
"""The option that scales a bump or normal map."""
_NOT_DRAWN = ("bump", "disp", "decal", "refl", "tf", "ps", "pc")
_NOTHING = {"tf": 1.0, "ps": 0.0, "pc": 0.0}
"""Numbers that mean that a material has none of these."""


def parse_mtl(text: str) -> dict[str, Statements]:
    """Return the statements of the materials of a library, by name."""
    materials: dict[str, Statements] = {}
    current: Statements = {}
    for line in text.splitlines():
        keyword, _, rest = line.strip().partition(" ")
        if keyword.lower() == "newmtl":
            current = materials.setdefault(rest.strip(), {})
        elif rest.strip():
            current[keyword.lower()] = rest.strip()
    return materials


def make_material(name: str, source: Statements, builder: Builder) -> MaterialData:
    """Return a material with its textures, and note what is not drawn.

    Raises
    ------
    ValueError
        If a number cannot be read.
    ModelError
        If a texture is too large.
    """
    losses = builder.losses
    for keyword, text in source.items():
        nothing = keyword in _NOTHING and all(number == _NOTHING[keyword] for number in _numbers(text))
        unknown = keyword.startswith("map_") and keyword not in ("map_kd", "map_ke", "map_d", "map_opacity")
        if (unknown or keyword in _NOT_DRAWN) and not nothing:
            losses.add(f"{keyword} statements of materials", name)
    texture, shown = _texture(name, source.get("map_kd"), builder)
    emission_texture, _ = _texture(name, source.get("map_ke"), builder)
    mask = source.get("map_d", source.get("map_opacity"))
    cut_out = mask is not None and texture is not None and _options(mask)[-1] == shown
    if mask is not None and not cut_out:
        losses.add("opacity textures other than the diffuse texture, of materials", name)
    # a texture on black is an exporter's slip: it is meant to be seen
    diffuse = _color(source.get("kd", "0.8"), texture is not None)
    exponent = _numbers(source.get("ns", "0"))[0]
    metallic = _share(source.get("pm", "0"))
    is_phong = "pr" not in source and metallic == 0.0
    shines = is_phong and exponent >= 1.0 and _numbers(source.get("illum", "2"))[0] >= 2
    normal_texture, _ = _texture(name, source.get("norm"), builder)
    opacity = (
        _numbers(source["d"].split()[-1])[0] if "d" in source else 1.0 - _numbers(source.get("tr", "0"))[0]
    )
    opacity = min(max(opacity, 0.0), 1.0)
    return MaterialData(
        name,
        base_color=(*diffuse, opacity),
        texture=texture,
        alpha_mode="mask" if cut_out else "blend" if opacity < 1.0 else "opaque",
        double_sided=True,
        emission=_color(source.get("ke", "0"), emission_texture is not None),
        emission_texture=emission_texture,
        specular=_color(source.get("ks", "0")) if shines else (0.0, 0.0, 0.0),
        shininess=min(exponent, 1e6) if shines else 0.0,
        metallic=None if is_phong else metallic,
        roughness=_share(source.get("pr", "1")),
        normal_texture=normal_texture,
        normal_scale=_multiplier(source.get("norm", "")),
    )


def _numbers(text: str) -> list[float]:
    numbers = [float(word) for word in text.split()]
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"a number is not finite: {text}")
    return numbers


def _share(text: str) -> float:
    return min(max(_numbers(text)[0], 0.0), 1.0)


def _multiplier(text: str) -> float:
    """Return the scale of a normal map, 1 where it has none."""
    found = _MULTIPLIER.search(text)
    scale = 1.0 if found is None else _numbers(found[1])[0]
    if abs(scale) > LARGEST_SCALE:
        raise ValueError(f"a normal map is scaled by -{LARGEST_SCALE:g} to {LARGEST_SCALE:g}: {text}")
    return scale


def _color(text: str, white_for_black: bool = False) -> tuple[float, float, float]:
    """Return a linear colour; one number is a grey. "spectral" and "xyz" are not numbers."""
    values = _numbers(text)[:3]
    if len(values) == 2:
        raise ValueError(f"a colour has three numbers: {text}")
    color = linear_color(values if len(values) == 3 else values * 3)
    return (1.0, 1.0, 1.0) if white_for_black and color == (0.0, 0.0, 0.0) else color


def _texture(material: str, text: str | None, builder: Builder) -> tuple[int | None, str]:
    """Return the index of a texture, None if there is none, and the name of its file."""
    if text is None:
        return None, ""
    wrap, moved, name = _options(text)
    if moved:
        builder.losses.add("offset, scaled or turbulent textures (-o, -s, -t) of materials", material)
    return builder.texture(builder.folder.image(name), wrap), name


def _options(text: str) -> tuple[Wrap, bool, str]:
    """Return how a texture is repeated, whether it is moved, and its name, which may have spaces."""
    wrap: Wrap = "repeat"
    moved = False
    while (found := _OPTION.match(text)) is not None:
        option, values = found[1].lower(), found[2].split()
        wrap = "clamp" if (option, values) == ("clamp", ["on"]) else wrap
        moved = moved or (option in _NEUTRAL and any(float(word) != _NEUTRAL[option] for word in values))
        text = text[found.end() :]
    return wrap, moved, text.strip()

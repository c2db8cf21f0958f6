"""Material libraries (.mtl) of Wavefront OBJ files.

The colours are display colours (sRGB), as other viewers show them. `Ka` is not read, since exporters leave it
at any value: ambient light is reflected like other light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from firefly_sample.losses import Losses
from firefly_sample.scene.material import Wrap

Color = tuple[float, float, float]

_OPTIONS = {
    "-blendu": 1,
    "-blendv": 1,
    "-bm": 1,
    "-boost": 1,
    "-cc": 1,
    "-clamp": 1,
    "-imfchan": 1,
    "-mm": 2,
    "-o": 3,
    "-s": 3,
    "-t": 3,
    "-texres": 1,
    "-type": 1,
}
"""Options of texture maps and the number of their values; -o, -s and -t may have fewer."""

_NOT_DRAWN = {
    "map_ka": "ambient textures",
    "map_ks": "specular textures",
    "map_ns": "shininess textures",
    "map_bump": "bump and normal maps",
    "bump": "bump and normal maps",
    "norm": "bump and normal maps",
    "disp": "displacement maps",
    "decal": "decal textures",
    "refl": "reflection maps",
    "tf": "transmission filters",
    "pr": "roughness (Pr)",
    "map_pr": "roughness textures",
    "pm": "metalness (Pm)",
    "map_pm": "metalness textures",
    "ps": "sheen (Ps)",
    "pc": "clear coats (Pc)",
}
_ZERO_IS_NOTHING = {"pm", "ps", "pc"}
_ONE_IS_NOTHING = {"tf"}


@dataclass
class MtlMap:
    """A texture's file name, and how it is repeated."""

    name: str
    wrap: Wrap = "repeat"


@dataclass
class MtlMaterial:
    """A material as its library writes it; colours are display colours."""

    name: str
    diffuse: Color = (0.8, 0.8, 0.8)
    specular: Color = (0.0, 0.0, 0.0)
    emission: Color = (0.0, 0.0, 0.0)
    exponent: float = 0.0
    opacity: float = 1.0
    model: int | None = None
    maps: dict[str, MtlMap] = field(default_factory=dict)
    """Textures by statement: "map_kd", "map_ke" and "map_d"."""

    @property
    def shines(self) -> bool:
        """Whether it has highlights: not in an illumination model without, nor below an exponent of 1."""
        return (self.model is None or self.model >= 2) and self.exponent >= 1.0


def parse_mtl(text: str, losses: Losses) -> dict[str, MtlMaterial]:
    """Return the materials of a library by name.

    Raises
    ------
    ValueError
        If a number cannot be read; the message names the line.
    """
    materials: dict[str, MtlMaterial] = {}
    current = None
    for number, line in enumerate(text.splitlines(), 1):
        keyword, _, rest = line.strip().partition(" ")
        keyword, rest = keyword.lower(), rest.strip()
        if keyword == "newmtl":
            current = materials.setdefault(rest, MtlMaterial(rest))
        elif current is not None and rest and not keyword.startswith("#"):
            try:
                _read_statement(current, keyword, rest, losses)
            except ValueError:
                shown = line.strip()[:60]
                raise ValueError(f"line {number} has no numbers where they belong: {shown}") from None
    return materials


def _read_statement(material: MtlMaterial, keyword: str, rest: str, losses: Losses) -> None:
    if keyword == "kd":
        material.diffuse = _color(rest)
    elif keyword == "ks":
        material.specular = _color(rest)
    elif keyword == "ke":
        material.emission = _color(rest)
    elif keyword == "ns":
        material.exponent = _finite(rest.split()[0])
    elif keyword == "d":
        material.opacity = _share(rest.split()[-1])  # d -halo 0.5
    elif keyword == "tr":
        material.opacity = 1.0 - _share(rest.split()[0])
    elif keyword == "illum":
        material.model = int(rest.split()[0])
    elif keyword in ("map_kd", "map_ke", "map_d", "map_opacity"):
        made = _map(rest, material.name, losses)
        material.maps["map_d" if keyword == "map_opacity" else keyword] = made
    elif keyword in _NOT_DRAWN:
        values = rest.split()
        nothing = {"0": _ZERO_IS_NOTHING, "1": _ONE_IS_NOTHING}
        if not any(
            keyword in words and set(values) <= {value, f"{value}.0", f"{value}.000000"}
            for value, words in nothing.items()
        ):
            losses.add(f"{_NOT_DRAWN[keyword]} of materials", material.name)


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(text)
    return number


def _share(text: str) -> float:
    return min(max(_finite(text), 0.0), 1.0)


def _color(text: str) -> Color:
    """Return red, green and blue; one number is a grey. "spectral" and "xyz" are not numbers."""
    values = [max(_finite(word), 0.0) for word in text.split()[:3]]
    if len(values) == 2:
        raise ValueError(text)
    return (values[0], values[0], values[0]) if len(values) == 1 else (values[0], values[1], values[2])


def _map(text: str, material: str, losses: Losses) -> MtlMap:
    """Return a texture map: options, then a file name, which may have spaces."""
    words = text.split(" ")
    wrap: Wrap = "repeat"
    place = 0
    while place < len(words) and words[place].lower() in _OPTIONS:
        option = words[place].lower()
        most = _OPTIONS[option]
        values = words[place + 1 : place + 1 + most]
        if option in ("-o", "-s", "-t"):
            values = [word for word in values if _is_number(word)]
        if option == "-clamp" and values == ["on"]:
            wrap = "clamp"
        neutral = {"-o": "0", "-s": "1", "-t": "0"}.get(option)
        if neutral is not None and any(float(value) != float(neutral) for value in values):
            losses.add("offset, scaled or turbulent textures (-o, -s, -t) of materials", material)
        place += 1 + len(values)
    return MtlMap(" ".join(words[place:]), wrap)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True

"""Factors of a glTF file's materials: numbers that are clipped to their range, and named where they are."""

from __future__ import annotations

from firefly_sample.losses import Losses
from firefly_sample.model.gltf.json_object import JsonObject

Color4 = tuple[float, float, float, float]


class Factors:
    """Reads factors, whose defaults are 1; `material` is the name of theirs."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses

    def number(
        self, parent: JsonObject, key: str, what: str, material: str, least: float = 0.0, most: float = 1.0
    ) -> float:
        """Return a number of `least` to `most`."""
        given = parent.number(key, 1.0)
        if not least <= given <= most:
            self._losses.add(f"{what} outside {least:g} to {most:g} are clipped, of materials", material)
        return min(max(given, least), most)

    def color(self, parent: JsonObject, key: str, what: str, material: str, count: int = 4) -> Color4:
        """Return a colour of 0 to 1; one of three channels has the alpha 1."""
        given = parent.numbers(key, count, (1.0,) * count)
        r, g, b, a = (min(max(number, 0.0), 1.0) for number in (*given, 1.0)[:4])
        if (r, g, b, a)[:count] != given:
            self._losses.add(f"{what} outside 0 to 1 are clipped, of materials", material)
        return r, g, b, a

"""Turn the buffers of a Frame into pictures, each with a note on how to read it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import Frame
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.shadows.maps import ShadowMap
from firefly_sample.srgb import linear_to_srgb

Pixels = NDArray[np.uint8]
Float32 = NDArray[np.float32]
Picture = tuple[Pixels, str]
"""A picture, shape (height, width, 3), black where nothing was drawn, and a note on how to read it."""

_ABSENT = ("specular", "emission", "shadow_atlas", "particle_shadow_atlas")
MISSING = {
    "classic": _ABSENT,
    "pyrender": ("particle_shadow_atlas",),
    "panda3d": ("particle_shadow_atlas",),
    "flat": (*_ABSENT, "light", "overdraw", "volumes", "wireframe"),
}
"""The look "classic" has no highlights, emission, shadows and particles; the look "flat" no lights either;
"pyrender" and "panda3d" have no particles."""

DARKEST = 0.1
"""The grey of the farthest surface, which distinguishes it from black, where nothing was drawn."""
EMPTY = (20, 26, 44)
"""Texels of a shadow map where nothing was drawn: not black, so that a map's edges can be seen."""
GOLDEN = 0.6180339887498949
HEAT = ((0, 0, 0), (40, 44, 160), (214, 58, 150), (255, 168, 60), (255, 255, 255))
"""Black, blue, magenta, orange, white: the steps of lightness are equal."""


def buffers_of(look: str) -> tuple[str, ...]:
    """Return the buffers that a look has."""
    return tuple(name for name in BUFFERS if name not in MISSING.get(look, ()))


def picture_of(plan: FramePlan, frame: Frame, output: str) -> Picture:
    """Return a picture of one output of a frame, as large as the frame's picture."""
    image = frame[output]
    if output == "shadow_atlas":
        return shadow_atlas_picture(np.asarray(image, dtype=np.float32), plan, frame.size)
    if output == "particle_shadow_atlas":
        return particle_shadow_atlas_picture(np.asarray(image, dtype=np.float32), plan, frame.size)
    if plan.settings.look in ("flat", "panda3d") and output == "albedo":
        return codes(image), "base colour as stored"
    return buffer_picture(output, image, classic=plan.settings.look == "classic", exposure=plan.exposure)


def buffer_picture(
    output: str,
    image: NDArray[Any],
    *,
    classic: bool = False,
    exposure: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> Picture:
    """Return a picture of one output, an array of a `Frame`; the two atlases have functions of their own.

    Parameters
    ----------
    classic : bool
        True for the look "classic": its albedo, normals and light are display codes already.
    exposure : tuple of 3 floats
        Factor of light and emission, as in the rendered picture.
    """
    if classic and output in ("albedo", "normal"):
        return codes(image), "as stored"
    if classic and output == "light":
        return codes(image), "light on white surfaces, in display codes"
    if output in ("light", "emission"):
        image = image * np.array(exposure, dtype=np.float32)
    convert, note = _CONVERSIONS[output]
    picture = convert(image)
    return picture if isinstance(picture, tuple) else (picture, note)


def shadow_atlas_picture(depth: Float32, plan: FramePlan, size: tuple[int, int]) -> Picture:
    """Return a picture of all shadow maps, as large as fits into `size` (width, height).

    Each map is grey, from white at the surface nearest to its light to dark at the farthest. The scale is
    logarithmic for a light with a position, linear for a directional light. The picture is black around the
    atlas, and in tiles that were not drawn for this frame.

    Parameters
    ----------
    depth : ndarray of float32, shape (height, width)
        The output "shadow_atlas" of the plan's frame.
    """
    picture = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    maps = plan.shadows.maps
    if not maps:
        return picture, "no light casts shadows"
    height, width = depth.shape
    rows, columns, area = _fit((height, width), picture)
    seen = depth[rows[:, None], columns]
    clear = np.float32(0.0 if plan.view.reverse else 1.0)
    for shadow in maps:
        if shadow.casters is None:
            continue  # the tile holds an earlier frame's depths
        x, y, side = shadow.tile
        first = height - y - side  # rows count from the top, tiles from the bottom
        tile = (
            slice(*np.searchsorted(rows, (first, first + side))),
            slice(*np.searchsorted(columns, (x, x + side))),
        )
        area[tile] = _map_picture(seen[tile], shadow, clear)
    count = f"{len(maps)} map{'' if len(maps) == 1 else 's'}"
    return picture, f"{count}, {width} x {height} texels: white is near the light, dark is far, blue is empty"


def particle_shadow_atlas_picture(taken: Float32, plan: FramePlan, size: tuple[int, int]) -> Picture:
    """Return a picture of all slices of the particle shadow, as large as fits into `size` (width, height).

    Parameters
    ----------
    taken : ndarray of float32, shape (height, width, 3)
        The output "particle_shadow_atlas" of the plan's frame.
    """
    picture = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    shadow = plan.particle_shadow
    if shadow is None or not taken.size:
        return picture, "no particles cast shadows"
    rows, columns, area = _fit(taken.shape[:2], picture)
    seen = taken[rows[:, None], columns]
    left = np.exp(-seen) if shadow.method == "optical_depth" else 1.0 - seen
    tile = shadow.view.tile
    slices = (taken.shape[0] - 1 - rows)[:, None] // tile * shadow.grid[0] + columns // tile
    area[...] = codes(linear_to_srgb(np.clip(left, 0.0, 1.0)))
    area[slices >= shadow.view.slices] = EMPTY
    return picture, (
        f"{shadow.view.slices} slices of {tile} texels, the nearest to the light at the lower left: "
        "white lets all light through"
    )


def codes(values: NDArray[Any]) -> Pixels:
    """Return the display codes of values in 0..1; values outside are clipped."""
    return np.asarray(np.clip(values, 0.0, 1.0) * np.float32(255.0) + np.float32(0.5), dtype=np.uint8)


def _srgb(linear: Float32) -> Pixels:
    # a table over square roots, as the G-buffer stores them, has an error below half a code
    table = codes(linear_to_srgb((np.arange(4096) / 4095.0) ** 2))
    return table[(np.sqrt(linear) * np.float32(4095.0) + np.float32(0.5)).astype(np.intp)]


def _toned(radiance: Float32) -> Pixels:
    """Apply the picture's tone curve, because radiance has no upper bound; NaN becomes white."""
    return _srgb(np.fmin(-np.expm1(-radiance), np.float32(1.0)))


def _normal(image: Float32) -> Pixels:
    drawn = image.any(axis=-1, keepdims=True)
    return codes(np.where(drawn, image * 0.5 + 0.5, 0.0))


def _depth(image: Float32) -> Picture:
    """Use a logarithmic scale, because the eye judges distances by their ratio."""
    drawn = np.isfinite(image)
    # an orthographic lens may see behind its origin: such surfaces are as white as the nearest
    ahead = image[drawn & (image > 0)]
    near, far = (float(ahead.min()), float(ahead.max())) if ahead.size else (1.0, 1.0)
    share = np.log(np.clip(image, near, far) / near) / max(np.log(far / near), 1e-9)
    grey = np.where(drawn, 1.0 - (1.0 - DARKEST) * share, 0.0)
    note = f"{near:.4g} (white) to {far:.4g} units away (dark), logarithmic"
    return np.repeat(codes(grey)[..., None], 3, axis=-1), note


def _position(image: Float32) -> Picture:
    drawn = np.isfinite(image[..., 0])
    seen = image[drawn]
    span = float(np.ptp(seen, axis=0).max()) if seen.size else 0.0
    # a power of ten: colours repeat one to ten times in the picture
    period = 10.0 ** np.floor(np.log10(span)) if span > 0 else 1.0
    seen = seen / np.float32(period)
    pixels = np.zeros(image.shape, dtype=np.uint8)
    # the offset gives a floor at height 0 one colour, although rounding puts parts of it below 0
    pixels[drawn] = codes(seen - np.floor(seen + np.float32(1e-4)))
    return pixels, f"x, y, z as red, green, blue, repeating every {period:g} units"


def _id(image: NDArray[np.int32]) -> Pixels:
    """Space the hues by the golden section, so that those of neighbouring ids are never close."""
    k = np.arange(int(image.max(initial=-1)) + 2)
    hue = k * GOLDEN % 1.0
    saturation = 0.45 + 0.2 * (k // 3 % 3)
    value = 1.0 - 0.2 * (k % 3)
    # HSV to RGB in the closed form f(n) = v - v s max(0, min(q, 4 - q, 1)), q = (n + 6 h) mod 6
    q = (np.array([5.0, 3.0, 1.0]) + 6.0 * hue[:, None]) % 6.0
    fall = np.clip(np.minimum(q, 4.0 - q), 0.0, 1.0)
    colors = value[:, None] * (1.0 - saturation[:, None] * fall)
    colors[-1] = 0.0  # the last row is index -1, which means that nothing was drawn
    return codes(colors)[image]


def _overdraw(image: NDArray[np.int32]) -> Picture:
    most = int(image.max(initial=0))
    if most == 0:
        return np.zeros((*image.shape, 3), dtype=np.uint8), "no light shades any pixel"
    steps = np.linspace(0.0, 1.0, len(HEAT))
    counts = np.arange(most + 1) / most
    table = np.stack([np.interp(counts, steps, channel) for channel in zip(*HEAT, strict=True)], axis=1)
    note = f"how often each pixel is shaded: black 0, blue, magenta, orange, white {most}"
    return codes(table / 255.0)[image], note


_CONVERSIONS: dict[str, tuple[Callable[[NDArray[Any]], Pixels | Picture], str]] = {
    "albedo": (_srgb, "base colour, unlit"),
    "normal": (_normal, "x, y, z from -1 to 1 as red, green, blue"),
    "depth": (_depth, ""),
    "position_world": (_position, ""),
    "id": (_id, "one colour per object"),
    "specular": (_srgb, "colour of highlights, unlit"),
    "emission": (_toned, "light that surfaces emit, through 1 - exp(-x) and sRGB"),
    "light": (_toned, "light on white surfaces, through 1 - exp(-x) and sRGB"),
    "overdraw": (_overdraw, ""),
    "volumes": (np.asarray, "the pixels that each light shades, in flat colours that add up"),
    "wireframe": (np.asarray, "visible edges of the light volumes"),
}
"""By output: the function that makes its picture, and a note, unless that function returns its own."""
BUFFERS = (*_CONVERSIONS, "shadow_atlas", "particle_shadow_atlas")
"""The outputs that the window shows, in its order."""


def _fit(texels: tuple[int, ...], picture: Pixels) -> tuple[NDArray[np.intp], NDArray[np.intp], Pixels]:
    """Fit an image of `texels` (height, width) into the middle of a picture.

    Returns the rows and columns of the texels to show, and the part of the picture that shows them. Each
    pixel takes the texel at its middle, because the average of two depths is the depth of no surface.
    """
    height, width = picture.shape[:2]
    scale = min(height / texels[0], width / texels[1])
    sides = ((side, max(1, round(side * scale))) for side in texels[:2])
    rows, columns = (((np.arange(pixels) + 0.5) * (side / pixels)).astype(np.intp) for side, pixels in sides)
    top, left = (height - len(rows)) // 2, (width - len(columns)) // 2
    return rows, columns, picture[top : top + len(rows), left : left + len(columns)]


def _map_picture(depth: Float32, shadow: ShadowMap, clear: np.float32) -> Pixels:
    """Return the picture of one shadow map; `clear` is the depth of texels where nothing was drawn."""
    drawn = depth != clear
    distance = shadow.lens.distance_from_depth(depth[drawn])
    if shadow.lens.perspective:
        distance = np.log(distance)
    low, high = (distance.min(), distance.max()) if distance.size else (0.0, 0.0)
    picture = np.empty((*depth.shape, 3), dtype=np.uint8)
    picture[...] = EMPTY
    picture[drawn] = codes(1.0 - (1.0 - DARKEST) * (distance - low) / max(high - low, 1e-9))[:, None]
    return picture

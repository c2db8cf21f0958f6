"""Images of Panda3D's textures, of any format, as 8-bit codes of four channels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.uint8]
Note = Callable[[str], None]
"""Takes a loss."""
TextureKind = Literal["modulate", "opaque", "sampled", "glow"]
"""Modulating ones multiply colour and alpha; an "opaque" one has no alpha; "sampled" is as OpenGL samples it;
"glow" is the light that Panda3D makes of alpha."""

_BITS = {
    "rgb332": (3, 3, 2, 0),
    "rgb5": (5, 5, 5, 0),
    "rgba5": (5, 5, 5, 1),
    "rgba4": (4, 4, 4, 4),
    "rgb10_a2": (8, 8, 8, 2),
}
"""Bits of each channel, of the formats that have fewer than 8."""
_BLACK = "blue", "green", "color_index", "depth_stencil"
"""Formats that Panda3D draws black."""


def read_texels(source: Any, kind: TextureKind, note: Note) -> Codes:
    """Return the image of one of Panda3D's textures as codes, shape (height, width, 4), first row on top.

    Colours stay the codes that are stored. All numbers of what cannot be sampled so are 0, as in Panda3D.

    Parameters
    ----------
    source : panda3d.core.Texture
    kind : {"modulate", "opaque", "sampled", "glow"}
    note : callable
        Takes each loss.
    """
    name = source.format_format(source.get_format())
    codes = _quantized(_as_codes(_stored(source, name, note), note), _BITS.get(name))
    rgba = _spread(codes, name, kind)
    if kind == "opaque":
        rgba[..., 3] = 255
    elif kind == "glow":
        rgba[..., :3] = np.maximum(2 * rgba[..., 3:].astype(np.int16) - 255, 0)
        rgba[..., 3] = 255
    if "srgb" in name or "sluminance" in name:
        note('the codes of sRGB textures are decoded only by look="correct"')
    return rgba[::-1]


def _stored(source: Any, name: str, note: Note) -> NDArray[Any]:
    """Return the numbers in memory, shape (height, width, channels); one texel of zeros if there are none."""
    channels = source.get_num_components()
    nothing: Codes = np.zeros((1, 1, channels), dtype=np.uint8)
    kind, dtype = source.format_texture_type(source.get_texture_type()), _dtype(source)
    if kind not in ("2d_texture", "1d_texture"):
        note(f"textures of the type {kind} are drawn black")
        return nothing
    if name in _BLACK or name.endswith("i") or dtype is None:
        note(f"textures of the format {name} are drawn black")
        return nothing
    if source.get_type().get_name() == "MovieTexture":
        note("videos stand still")
    image = source.get_uncompressed_ram_image()
    size = source.get_y_size(), source.get_x_size(), channels
    if image is None or not len(image):
        if not source.has_clear_color():
            note("textures without an image are drawn black")
            return nothing
        image, size = source.get_clear_data(), (1, 1, channels)
    if source.get_num_views() > 1:
        note("only the first view of a texture is drawn")
    if source.get_num_ram_mipmap_images() > 1:
        note("smaller copies (mipmaps) that a texture brings are made anew")
    if name == "r11g11b10":
        note(f"textures of the format {name} have 8 bits for each colour")
    return np.frombuffer(memoryview(image), dtype=dtype, count=size[0] * size[1] * channels).reshape(size)


def _dtype(source: Any) -> np.dtype[Any] | None:
    kinds = {
        source.T_unsigned_byte: "u1",
        source.T_byte: "i1",
        source.T_unsigned_short: "u2",
        source.T_short: "i2",
        source.T_unsigned_int: "u4",
        source.T_int: "i4",
        source.T_half_float: "f2",
        source.T_float: "f4",
    }
    kind = kinds.get(source.get_component_type())
    return None if kind is None else np.dtype(kind)


def _as_codes(stored: NDArray[Any], note: Note) -> Codes:
    """Return numbers as OpenGL normalizes them, rounded to 8 bits."""
    if stored.dtype == np.uint8:
        return stored
    shares = stored.astype(np.float64)
    if stored.dtype.kind == "f":
        if not (np.isfinite(shares) & (shares >= 0.0) & (shares <= 1.0)).all():
            note("numbers of textures outside 0..1 are cut off")
        shares = np.nan_to_num(shares, nan=0.0)
    else:
        shares /= np.iinfo(stored.dtype).max
    return np.rint(255.0 * np.clip(shares, 0.0, 1.0)).astype(np.uint8)


def _quantized(codes: Codes, bits: tuple[int, int, int, int] | None) -> Codes:
    """Return codes, in the order in memory, as the few bits of each channel hold them."""
    if bits is None:
        return codes
    made = codes.copy()
    for channel in range(codes.shape[2]):
        most = 2 ** bits[(2, 1, 0, 3)[channel]] - 1
        made[..., channel] = np.rint(np.rint(codes[..., channel] / 255.0 * most) * (255.0 / most))
    return made


def _spread(codes: Codes, name: str, kind: TextureKind) -> Codes:
    """Return channels in the order in memory (blue first) as red, green, blue and alpha."""
    height, width, channels = codes.shape
    rgba = np.zeros((height, width, 4), dtype=np.uint8)
    rgba[..., 3] = 255
    if name == "alpha":
        rgba[..., :3] = 255 if kind == "modulate" else 0
        rgba[..., 3] = codes[..., 0]
    elif channels >= 3:
        rgba[..., 0], rgba[..., 1], rgba[..., 2] = codes[..., 2], codes[..., 1], codes[..., 0]
        if channels == 4:
            rgba[..., 3] = codes[..., 3]
    elif "luminance" in name or "depth" in name:
        rgba[..., :3] = codes[..., :1]
        if channels == 2:
            rgba[..., 3] = codes[..., 1]
    else:
        rgba[..., :channels] = codes
    return rgba

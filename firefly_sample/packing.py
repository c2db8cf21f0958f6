"""Encode colours, normals and highlights as render targets store them, and decode them, in float64.

The twin of ``shaders/include/gbuffer.glsl``; `firefly_sample.plan.variants` names the encodings.

Octahedral normals: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
JCGT 3(2), 2014.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.planar import empty_planar

Float64 = NDArray[np.float64]


def encode_albedo(albedo: ArrayLike) -> Float64:
    """Return square roots: they spend 8 bits about as the eye sees; drivers' sRGB is less exact."""
    return np.asarray(np.sqrt(np.clip(np.asarray(albedo, dtype=np.float64), 0.0, 1.0)))


def decode_albedo(stored: ArrayLike) -> Float64:
    """Return the inverse of `encode_albedo`."""
    return np.asarray(stored, dtype=np.float64) ** 2


def unpack_ten_bits(texels: NDArray[np.uint32]) -> Float64:
    """Return three fractions of 1 for each whole number, ten bits each from the lowest on, shape (..., 3)."""
    fractions = empty_planar(texels.shape, 3)
    for channel in range(3):
        fractions[..., channel] = (texels >> np.uint32(10 * channel) & np.uint32(1023)) / 1023.0
    return fractions


def encode_normal(normal: ArrayLike) -> Float64:
    """Return octahedral coordinates (..., 2) in -1..1 of unit vectors (..., 3)."""
    n = np.asarray(normal, dtype=np.float64)
    n = n / np.abs(n).sum(axis=-1, keepdims=True)
    xy = n[..., :2]
    folded = (1.0 - np.abs(xy[..., ::-1])) * _sign_not_zero(xy)
    return np.asarray(np.where(n[..., 2:] < 0.0, folded, xy), dtype=np.float64)


def decode_normal(encoded: ArrayLike) -> Float64:
    """Return the unit vectors (..., 3) of octahedral coordinates (..., 2)."""
    e = np.asarray(encoded, dtype=np.float64)
    x, y = e[..., 0], e[..., 1]
    z = 1.0 - (np.abs(x) + np.abs(y))
    below = z < 0.0
    n = empty_planar(z.shape, 3)
    n[..., 0] = np.where(below, (1.0 - np.abs(y)) * _sign_not_zero(x), x)
    n[..., 1] = np.where(below, (1.0 - np.abs(x)) * _sign_not_zero(y), y)
    n[..., 2] = z
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return n


_OCTAHEDRAL = {"oct16": (1.0, 0.0), "oct16_unorm": (2.0, 1.0), "oct8": (255.0 / 127.0, 1.0)}
"""Scale and offset from stored fractions to -1..1."""


def decode_normals(stored: Float64, encoding: str) -> Float64:
    """Return unit normals in view space from what a target stores of them.

    Parameters
    ----------
    stored : ndarray of float64, shape (..., 2) for octahedral encodings, else (..., 3)
        Normalised codes as fractions.
    encoding : {"oct16", "oct16_unorm", "oct8", "unorm", "float", "classic"}
    """
    if encoding in _OCTAHEDRAL:
        scale, offset = _OCTAHEDRAL[encoding]
        return decode_normal(stored * scale - offset)
    long = stored if encoding == "float" else stored * 2.0 - 1.0
    if encoding == "classic":  # in OpenGL's view axes: shaders/include/gbuffer.glsl
        long = long[..., (0, 2, 1)] * (1.0, -1.0, 1.0)
    return np.asarray(long / np.maximum(np.linalg.norm(long, axis=-1, keepdims=True), 1e-30))


def encode_specular(specular: ArrayLike) -> Float64:
    """Return (..., 4) in 0..1: square roots of linear colours, and the logarithm of shininess, up to 2^20."""
    given = np.asarray(specular, dtype=np.float64)
    color = np.sqrt(np.clip(given[..., :3], 0.0, 1.0))
    return np.concatenate([color, np.log1p(given[..., 3:]) / np.log(2.0) / 20.0], axis=-1)


def decode_specular(stored: ArrayLike) -> Float64:
    """Return the inverse of `encode_specular`."""
    given = np.asarray(stored, dtype=np.float64)
    decoded = empty_planar(given.shape[:-1], 4)
    decoded[..., :3], decoded[..., 3] = decode_albedo(given[..., :3]), decode_shininess(given[..., 3])
    return decoded


def decode_shininess(stored: ArrayLike) -> Float64:
    """Return the exponents of highlights from what `encode_specular` stores."""
    return np.asarray(np.expm1(np.asarray(stored, dtype=np.float64) * 20.0 * np.log(2.0)))


def decode_viewer(stored: ArrayLike) -> tuple[Float64, NDArray[np.bool_]]:
    """Return what `decode_shininess` takes, and where highlights see the eye where it is.

    Both are one number of 16 bits, whose highest bit is the second.
    """
    code = np.rint(np.asarray(stored, dtype=np.float64) * 65535.0)
    local = code >= 32768.0
    return np.asarray((code - 32768.0 * local) / 32767.0), np.asarray(local)


def encode_metallic_roughness(metallic: ArrayLike, roughness: ArrayLike) -> Float64:
    """Return (..., 2) in 0..1, for targets of 16 bits: 0 first where `metallic` is below 0, which means none.

    The share of metal takes the codes from 1 to 65535.
    """
    share, rough = (np.asarray(given, dtype=np.float64) for given in (metallic, roughness))
    codes = np.where(share < 0.0, 0.0, 1.0 + 65534.0 * np.clip(share, 0.0, 1.0))
    return np.stack(np.broadcast_arrays(codes / 65535.0, np.clip(rough, 0.0, 1.0)), axis=-1)


def decode_metallic_roughness(stored: ArrayLike) -> tuple[Float64, Float64]:
    """Return metallic and roughness, shapes (...,), from fractions (..., 2) of 16 bits.

    Where the surface is not a metallic-roughness one, they are -1 and 1.
    """
    given = np.asarray(stored, dtype=np.float64)
    code = np.round(given[..., 0] * 65535.0)
    none = code == 0.0
    return np.where(none, -1.0, (code - 1.0) / 65534.0), np.where(none, 1.0, given[..., 1])


def quantise_snorm16(value: ArrayLike) -> Float64:
    """Round to the nearest 16-bit signed normalised number."""
    return np.asarray(np.round(np.clip(np.asarray(value, dtype=np.float64), -1.0, 1.0) * 32767.0) / 32767.0)


def _sign_not_zero(value: Float64) -> Float64:
    return np.where(value >= 0.0, 1.0, -1.0)

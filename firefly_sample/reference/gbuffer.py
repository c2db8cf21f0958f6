"""float64 twin of ``shaders/include/gbuffer.glsl``: how albedo and normals are packed.

Octahedral normals: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
JCGT 3(2), 2014.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "decode_albedo",
    "decode_normal",
    "decode_specular",
    "encode_albedo",
    "encode_normal",
    "encode_specular",
    "quantise_snorm16",
    "unpack_ten_bits",
]

Float64 = NDArray[np.float64]


def encode_albedo(albedo: ArrayLike) -> Float64:
    """Square roots spend 8 bits about as the eye wants them, and squaring is exact; drivers' sRGB is not."""
    return np.asarray(np.sqrt(np.clip(np.asarray(albedo, dtype=np.float64), 0.0, 1.0)))


def decode_albedo(stored: ArrayLike) -> Float64:
    """The inverse of `encode_albedo`."""
    return np.asarray(stored, dtype=np.float64) ** 2


def unpack_ten_bits(texels: NDArray[np.uint32]) -> Float64:
    """Three fractions of 1 for each whole number, ten bits each from the lowest on, shape (..., 3)."""
    return (texels[..., None] >> np.array([0, 10, 20], dtype=np.uint32) & np.uint32(1023)) / 1023.0


def encode_normal(normal: ArrayLike) -> Float64:
    """Unit vectors (..., 3) to octahedral coordinates (..., 2) in -1..1."""
    n = np.asarray(normal, dtype=np.float64)
    n = n / np.abs(n).sum(axis=-1, keepdims=True)
    xy = n[..., :2]
    folded = (1.0 - np.abs(xy[..., ::-1])) * _sign_not_zero(xy)
    return np.asarray(np.where(n[..., 2:] < 0.0, folded, xy), dtype=np.float64)


def decode_normal(encoded: ArrayLike) -> Float64:
    """Octahedral coordinates (..., 2) to unit vectors (..., 3)."""
    e = np.asarray(encoded, dtype=np.float64)
    z = 1.0 - np.abs(e).sum(axis=-1, keepdims=True)
    xy = np.where(z < 0.0, (1.0 - np.abs(e[..., ::-1])) * _sign_not_zero(e), e)
    n = np.concatenate([xy, z], axis=-1)
    return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))


def encode_specular(specular: ArrayLike) -> Float64:
    """Linear colour and shininess (..., 4) to 0..1: square roots, and a logarithm that ends at 2^20."""
    given = np.asarray(specular, dtype=np.float64)
    color = np.sqrt(np.clip(given[..., :3], 0.0, 1.0))
    return np.concatenate([color, np.log1p(given[..., 3:]) / np.log(2.0) / 20.0], axis=-1)


def decode_specular(stored: ArrayLike) -> Float64:
    """The inverse of `encode_specular`."""
    given = np.asarray(stored, dtype=np.float64)
    return np.concatenate([given[..., :3] ** 2, np.expm1(given[..., 3:] * 20.0 * np.log(2.0))], axis=-1)


def quantise_snorm16(value: ArrayLike) -> Float64:
    """Round to the nearest 16-bit signed normalised number."""
    return np.asarray(np.round(np.clip(np.asarray(value, dtype=np.float64), -1.0, 1.0) * 32767.0) / 32767.0)


def _sign_not_zero(value: Float64) -> Float64:
    return np.where(value >= 0.0, 1.0, -1.0)

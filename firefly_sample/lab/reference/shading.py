"""float64 twins of the shader includes ``falloff``, ``cone``, ``phong``, ``color`` and ``codes``."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.scene.light import Falloff

Float64 = NDArray[np.float64]

# --- falloff.glsl: how a light fades with distance ---


def ramp_squared(distance: ArrayLike, radius: ArrayLike) -> Float64:
    """Return (1 - d/R)^2, exactly 0 from the radius on; both in scene units."""
    d, r = np.asarray(distance, dtype=np.float64), np.asarray(radius, dtype=np.float64)
    return np.asarray(np.maximum(1.0 - d / r, 0.0) ** 2)


def window(distance: ArrayLike, end: ArrayLike, kind: str) -> Float64:
    """Return the window that ends a light at R: "karis" (1 - (d/R)^4)^2, "gltf" 1 - (d/R)^4."""
    s = np.asarray(distance, dtype=np.float64) / np.asarray(end, dtype=np.float64)
    square = s * s  # a power of 4 takes NumPy twenty times as long
    inside = np.maximum(1.0 - square * square, 0.0)
    return np.asarray(inside**2 if kind == "karis" else inside)


def attenuation(distance: ArrayLike, coefficients: ArrayLike) -> Float64:
    """Return 1/(constant + linear*d + quadratic*d^2)."""
    d = np.asarray(distance, dtype=np.float64)
    constant, linear, quadratic = np.asarray(coefficients, dtype=np.float64)
    return np.asarray(1.0 / (constant + d * (linear + d * quadratic)))


def falloff(kind: Falloff, distance: ArrayLike, end: float, coefficients: ArrayLike, ending: str) -> Float64:
    """Return the factor of one light at distances in scene units.

    `end` is the radius of `Falloff.RAMP_SQUARED`, or the max distance of `Falloff.ATTENUATION`, which may be
    infinite; `coefficients`, shape (3,), are the latter's. `ending` is the kind of its `window`.
    """
    if kind is Falloff.RAMP_SQUARED:
        return ramp_squared(distance, end)
    fading = attenuation(distance, coefficients)
    return fading if np.isinf(end) else np.asarray(fading * window(distance, end, ending))


# --- cone.glsl: the strength of a spotlight in a direction ---


def opening(to_light: Float64, axis: Float64) -> Float64:
    """Return 1 - cos of the angle between a spotlight's axis and the direction from it to a surface.

    Unit vectors, shapes (..., 3); the result has shape (...). It is half the square of the chord between the
    two, which is exact for small angles and large ones.
    """
    chord = to_light + axis
    return np.asarray(0.5 * np.einsum("...i,...i", chord, chord))


def cone_strength(
    opened: Float64, inner: float, outer: float, exponent: float, look: str = "correct"
) -> Float64:
    """Return the strength at openings 1 - cos(angle), for a cone whose angles are given in the same way.

    It is 1 within `inner`, 0 beyond `outer`, a smooth step of the opening between; times cos(angle)^exponent.
    In the look "pyrender", it is the square of a straight ramp, which is at least 0.001 wide.
    """
    if look == "pyrender":
        edge = np.clip((outer - opened) / max(outer - inner, 1e-3), 0.0, 1.0) ** 2
    elif outer > inner:
        t = np.clip((outer - opened) / (outer - inner), 0.0, 1.0)
        edge = t * t * (3.0 - 2.0 * t)
    else:
        edge = np.where((opened <= outer) | (outer >= 2.0 - 1e-9), 1.0, 0.0)
    if exponent == 0.0:
        return np.asarray(edge)
    return np.asarray(edge * power_of_cosine(1.0 - opened, exponent))


# --- phong.glsl: highlights ---


def power_of_cosine(cosine: ArrayLike, exponent: ArrayLike) -> Float64:
    """Return cos^m, 0 where the cosine is not above 0; with m = 0 it is 1, as in fixed-function OpenGL."""
    c, m = np.broadcast_arrays(np.asarray(cosine, dtype=np.float64), np.asarray(exponent, dtype=np.float64))
    # twice as fast as numpy.power; the zeroth power of the smallest positive number is 1 as well
    power = np.where(c > 0.0, np.exp(m * np.log(np.maximum(c, 1e-300))), 0.0)
    return np.where(m == 0.0, 1.0, power)


def highlight(
    normal: Float64, to_light: Float64, to_eye: Float64, shininess: ArrayLike, model: str
) -> Float64:
    """Return the strength of a highlight for unit vectors (..., 3), before any colour.

    The model "phong" takes the angle between the reflected light and the eye, "blinn_phong" that between the
    normal and the half-way vector.
    """
    n_dot_l = np.einsum("...i,...i", normal, to_light)
    n_dot_e = np.einsum("...i,...i", normal, to_eye)
    l_dot_e = np.einsum("...i,...i", to_light, to_eye)
    return highlight_of_cosines(n_dot_l, n_dot_e, l_dot_e, shininess, model)


def highlight_of_cosines(
    n_dot_l: Float64, n_dot_e: Float64, l_dot_e: Float64, shininess: ArrayLike, model: str
) -> Float64:
    """Return the same from the cosines between normal, light and eye, of any shape."""
    if model == "phong":
        cosine = 2.0 * n_dot_l * n_dot_e - l_dot_e
    else:
        half = np.sqrt(np.maximum(2.0 + 2.0 * l_dot_e, 1e-30))
        cosine = (n_dot_l + n_dot_e) / half
    return power_of_cosine(cosine, shininess)


# --- color.glsl: the tone curve; sRGB is in firefly_sample.srgb ---


def tone_curve(radiance: ArrayLike, name: str) -> NDArray[np.float64]:
    """Map radiance to display-linear 0..1: "exponential" is 1 - exp(-L) per channel, "none" clips at 1."""
    value = np.maximum(np.asarray(radiance, dtype=np.float64), 0.0)
    if name == "exponential":
        return -np.expm1(-value)
    return np.minimum(value, 1.0)


# --- codes.glsl: the display values of the look "pyrender" ---


def power_encoded(radiance: ArrayLike) -> Float64:
    """Return the display values 0..1 of radiance, clipped to 0..1, by the power 1/2.2."""
    return np.asarray(np.clip(np.asarray(radiance, dtype=np.float64), 0.0, 1.0) ** (1.0 / 2.2))


def power_decoded(code: ArrayLike) -> Float64:
    """Return the radiance of display values 0..1 of `power_encoded`."""
    return np.asarray(np.asarray(code, dtype=np.float64) ** 2.2)

"""Integrals over the directions above a surface whose normal is +Z."""

from __future__ import annotations

import numpy as np

from firefly_sample.lab.reference.metallic import reflected

UP = np.array([0.0, 0.0, 1.0])


def tilted(degrees):
    """A unit vector at an angle to the normal."""
    return np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])


def half_vectors(a, across=96, around=128):
    """Unit vectors (n, 3) that are as dense as a lobe of width a, and weights: solid angle times cosine.

    With s = sin^2 of the angle to the normal, s = a^2 u / (1 - u + a^2 u) for a u of 0 to 1, and the solid
    angle times cosine is d(phi) ds / 2. u is sin^2 of t, so that also the solid angle alone is smooth in t.
    Gauss-Legendre's places in t, and even steps in phi.
    """
    place, weight = np.polynomial.legendre.leggauss(across)
    t, phi = 0.25 * np.pi * (place + 1.0), (np.arange(around) + 0.5) * (2 * np.pi / around)
    u, weight = np.sin(t) ** 2, 0.25 * np.pi * weight * np.sin(2 * t)
    below = np.cos(t) ** 2 + a * a * u
    sine, cosine = np.sqrt(a * a * u / below), np.cos(t) / np.sqrt(below)
    ring = np.stack([np.cos(phi), np.sin(phi)], axis=1)
    vectors = np.concatenate(
        [sine[:, None, None] * ring, np.broadcast_to(cosine[:, None, None], (across, around, 1))], axis=-1
    )
    weights = weight * 0.5 * (a / below) ** 2 * (2 * np.pi / around)
    return vectors.reshape(-1, 3), np.repeat(weights, around)


def energy(base, metallic, roughness, to_eye):
    """The shares of uniform light that are reflected to the eye, diffusely and in highlights, shape (3,)."""
    directions, weights = half_vectors(1.0, 48, 64)  # evenly, for the diffuse share
    diffuse, _ = _reflected(base, metallic, roughness, directions, to_eye)
    half, weights_of_half = half_vectors(max(roughness, 1 / 32) ** 2)
    v_dot_h = half @ to_eye
    to_light = 2.0 * v_dot_h[:, None] * half - to_eye
    seen = (v_dot_h > 0) & (to_light[:, 2] > 0)
    half, to_light, v_dot_h = half[seen], to_light[seen], v_dot_h[seen]
    _, glint = _reflected(base, metallic, roughness, to_light, to_eye)
    # the solid angle of light is 4 V.H that of H
    shares = weights_of_half[seen] / half[:, 2] * 4.0 * v_dot_h * to_light[:, 2] / np.pi
    return weights @ diffuse / np.pi, shares @ glint


def _reflected(base, metallic, roughness, to_light, to_eye):
    n = len(to_light)
    material = np.tile(base, (n, 1)), np.full(n, metallic), np.full(n, roughness)
    return reflected(*material, UP, to_light, np.broadcast_to(to_eye, (n, 3)))

"""Spheres of metal and of plastic under one point light, pixel by pixel as a textbook has them."""

import math

import numpy as np
import pytest

from firefly_sample.lab.reference.shade import shade_lights
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.readback import GBuffer
from firefly_sample.scene.light import Falloff
from firefly_sample.settings import Settings

GOLD = {"base": (1.0, 0.77, 0.34), "metallic": 1.0, "roughness": 0.3}
PLASTIC = {"base": (0.8, 0.1, 0.2), "metallic": 0.0, "roughness": 0.5}
BRONZE = {"base": (0.7, 0.4, 0.2), "metallic": 0.6, "roughness": 0.08}
LAMP = np.array([1.5, 1.0, 2.5])
COLOR = np.array([3.0, 2.0, 5.0])
SIZE = 24


def sphere(base, metallic, roughness):
    """A unit sphere around (0, 5, 0), seen along the view axis by an orthographic eye."""
    x, z = np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE * 2.2 - 1.1] * 2)
    inside = x * x + z * z < 1.0
    depth = np.sqrt(np.where(inside, 1.0 - x * x - z * z, 0.0))
    normal = np.where(inside[..., None], np.stack([x, -depth, z], axis=-1), 0.0)
    position = np.where(inside[..., None], normal + np.array([0.0, 5.0, 0.0]), np.nan)
    shape = inside.shape
    return GBuffer(
        position=position,
        normal=normal,
        to_eye=np.broadcast_to((0.0, -1.0, 0.0), normal.shape),
        albedo=np.broadcast_to(base, normal.shape) * inside[..., None],
        specular=np.zeros(normal.shape),
        shininess=np.zeros(shape),
        metallic=np.where(inside, metallic, -1.0),
        roughness=np.where(inside, roughness, 1.0),
    )


def lamp(specular_colors=None):
    """A point light that fades with the square of the distance."""
    columns = {} if specular_colors is None else {"specular_colors": specular_colors}
    return LightSet.make(
        "point",
        Falloff.ATTENUATION,
        COLOR[None],
        positions=LAMP[None],
        attenuations=np.array([[0.0, 0.0, 1.0]]),
        **columns,
    )


def textbook(position, normal, base, metallic, roughness, limit):
    """Radiance of one pixel by the formulas of glTF's appendix B, in their plain form."""
    to_lamp = [lamp - here for lamp, here in zip(LAMP, position, strict=True)]
    distance = math.hypot(*to_lamp)
    light = [part / distance for part in to_lamp]
    eye = [0.0, -1.0, 0.0]
    long_half = [one + other for one, other in zip(light, eye, strict=True)]
    half = [part / math.hypot(*long_half) for part in long_half]

    def cosine(one, other):
        return sum(a * b for a, b in zip(one, other, strict=True))

    n_dot_l, n_dot_v = cosine(normal, light), cosine(normal, eye)
    if n_dot_l <= 0.0:
        return [0.0, 0.0, 0.0]
    alpha = roughness**2
    d = alpha**2 / (math.pi * (cosine(normal, half) ** 2 * (alpha**2 - 1) + 1) ** 2)
    g = 1.0
    for c in (n_dot_l, n_dot_v):
        g *= 2 * c / (c + math.sqrt(alpha**2 + (1 - alpha**2) * c**2))
    result = []
    for color, albedo in zip(COLOR, base, strict=True):
        f0 = 0.04 * (1 - metallic) + albedo * metallic
        f = f0 + (1 - f0) * (1 - cosine(eye, half)) ** 5
        diffuse = (1 - f) * albedo * (1 - metallic) * min(color * n_dot_l, limit)
        glint = min(math.pi * f * d * g / (4 * n_dot_l * n_dot_v) * color * n_dot_l, limit)
        result.append((diffuse + glint) / distance**2)
    return result


@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize("material", [GOLD, PLASTIC, BRONZE], ids=["gold", "plastic", "bronze"])
def test_a_sphere_is_the_textbooks(material, clamp):
    gbuffer = sphere(**material)
    radiance, light = shade_lights(gbuffer, [lamp()], Settings(clamp_light=clamp))
    covered = np.isfinite(gbuffer.position).all(axis=-1)
    limit = 1.0 if clamp else math.inf
    expected = np.zeros_like(radiance)
    for row, column in np.argwhere(covered):
        place, normal = gbuffer.position[row, column], gbuffer.normal[row, column]
        expected[row, column] = textbook(place, normal, **material, limit=limit)
    assert (expected > 0).any(axis=-1).sum() > 200
    # the textbook's distribution loses digits: about 1e-16 / a^2
    assert np.abs(radiance - expected).max() <= 1e-15 / material["roughness"] ** 4 * expected.max()
    assert (radiance[~covered] == 0).all()
    matt = shade_lights(_without_metal(gbuffer), [lamp()], Settings(clamp_light=clamp))
    assert (light == matt[1]).all()


def _without_metal(gbuffer):
    shape = gbuffer.metallic.shape
    return GBuffer(**(vars(gbuffer) | {"metallic": np.full(shape, -1.0), "roughness": np.ones(shape)}))


def test_the_colour_of_a_lights_highlights_does_not_matter():
    plain = shade_lights(sphere(**GOLD), [lamp()], Settings())
    red = shade_lights(sphere(**GOLD), [lamp(np.array([[1.0, 0.0, 0.0]]))], Settings())
    assert plain[0].tobytes() == red[0].tobytes()


def test_phong_and_metal_share_a_tile():
    """Each pixel is as it is among its own kind, also where a metal has what only Phong surfaces use."""
    metal = sphere(**BRONZE)
    shiny = np.full(metal.normal.shape, 0.3)
    phong = GBuffer(**(vars(_without_metal(metal)) | {"specular": shiny, "shininess": shiny[..., 0] * 50}))
    left = np.arange(SIZE) < SIZE // 2
    mixed = GBuffer(
        **(vars(phong) | {name: np.where(left, getattr(metal, name), getattr(phong, name)) for name in METAL})
    )
    both, metals, phongs = (
        shade_lights(gbuffer, [lamp()], Settings())[0] for gbuffer in (mixed, metal, phong)
    )
    assert both[:, left].tobytes() == metals[:, left].tobytes()
    assert both[:, ~left].tobytes() == phongs[:, ~left].tobytes()
    assert np.abs(metals - phongs).max() > 0.1


METAL = ("metallic", "roughness")

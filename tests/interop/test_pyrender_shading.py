"""pyrender's own pictures of metallic-roughness scenes, and ours in its look, against float64 twins.

The twin gets position and normal of each pixel from our renderer, and materials and lights from our scene, so
that these pictures check the conversion of all of them.
"""

from __future__ import annotations

import re
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.interop.pyrender.bridge import to_pyrender
from firefly_sample.losses import ConversionWarning
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.interop.oracle import LIT, SIZE
from tests.interop.pyrender_twin import GLTF, PYRENDER, Lamp, Lighting, Surface, codes, radiance
from tests.interop.shading import add_lights, lighting_of, seen, things
from tests.scenes import ball, geom_node, wall


def texel(*code):
    return Texture(np.full((2, 2, 4), code, np.uint8))


def orthographic():
    scene = add_lights(things(), suns=1, lamps=1)
    scene.camera_node.lens = OrthographicLens((8.4, 6.3), near=1.0, far=40.0)
    return scene


def glowing():
    rng = np.random.default_rng(3)
    looks = [{"emission": rng.uniform(0.0, 0.6, 3)} for _ in range(12)]
    return add_lights(things(looks.__getitem__), suns=1)


def textured(**textures):
    return add_lights(things(lambda _: textures), suns=2)


def under_the_sky():
    scene = add_lights(things(), suns=1)
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.15, 0.2)))
    return scene


def packed():
    """Roughness in green and metalness in blue; red and alpha, which are not theirs, would be seen."""
    return textured(
        texture=texel(200, 160, 120, 255),
        metallic_roughness_texture=texel(10, 200, 120, 30),
    )


def many(**lights):
    return add_lights(things(), **lights)


SCENES = {
    "one sun": lambda: many(suns=1),
    "four suns": lambda: many(suns=4),
    "one lamp": lambda: many(lamps=1),
    "four lamps": lambda: many(lamps=4),
    "one spotlight": lambda: many(spots=1),
    "four spotlights": lambda: many(spots=4),
    "four of each": lambda: many(suns=4, lamps=4, spots=4),
    "parallel rays": orthographic,
    "emission": glowing,
    "ambient light": under_the_sky,
    "textures": packed,
    "occlusion": lambda: textured(occlusion_texture=texel(128, 255, 255, 255)),
    "vertex colours": lambda: add_lights(things(colors=lambda index: (1.0, 0.2, index / 12.0)), suns=2),
    "range": lambda: many(lamps=2, end=6.0),
    "mirrors": lambda: add_lights(things(lambda index: {"roughness": 0.015}), suns=1),
}


@pytest.fixture(scope="module")
def renderer():
    """Normals in full precision."""
    with make_renderer(SIZE, Settings(normal_format="rgba32f")) as made:
        yield made


@pytest.fixture(scope="module")
def alike():
    """Our renderer in pyrender's look; targets of full precision, and no light is cut off."""
    exact = {"normal_format": "rgba32f", "albedo_format": "rgba32f", "cutoff_budget": 0.0}
    with make_renderer(SIZE, Settings(look="pyrender", range_falloff="gltf", **exact)) as made:
        yield made


@pytest.fixture(scope="module")
def drawn(renderer, draw_with_pyrender):
    """``drawn(name)``: a scene, our frame of it, and pyrender's codes."""
    return cache(lambda name: both(SCENES[name](), renderer, draw_with_pyrender))


@pytest.fixture(scope="module")
def difference(drawn):
    """``difference(name, terms)``: pyrender's codes minus the twin's inside the silhouettes, shape (n, 3)."""

    def compare(name, terms):
        scene, frame, theirs = drawn(name)
        inside, surface = seen(scene, frame, "eye" in terms)
        assert inside.mean() > 0.2
        return theirs[inside].astype(np.float64) - codes(surface, lighting_of(scene), terms)

    return compare


def both(scene, renderer, draw_with_pyrender):
    """The scene, our frame of it, and pyrender's codes."""
    frame = renderer.render(scene, 0.0, ("position", "normal", "depth", "id"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConversionWarning)
        theirs = draw_with_pyrender(to_pyrender(scene, size=SIZE), SIZE, LIT)[0]
    return scene, frame, theirs


def whole_codes(roughness, metallic):
    """The numbers next to these that the sixteen bits of a target hold."""
    return np.round(roughness * 65535) / 65535, np.round(metallic * 65534) / 65534


def mean_and_largest(differences):
    return np.abs(differences).mean(), np.abs(differences).max()


@pytest.mark.parametrize("name", SCENES)
def test_pyrender_draws_what_the_twin_computes_with_its_terms(difference, name):
    """Codes differ by one where float32 rounds to the other side, in few pixels."""
    mean, largest = mean_and_largest(difference(name, PYRENDER.keys()))
    assert largest <= 1
    assert mean < 0.01


@pytest.mark.parametrize("name", SCENES)
def test_the_look_pyrender_has_the_twins_radiance_and_pyrenders_codes(drawn, alike, name):
    """Radiance differs by float32's rounding; codes by one where it rounds to the other side.

    A max distance is ours, and ends a light in every look.
    """
    scene, _, theirs = drawn(name)
    frame = alike.render(scene, 0.0, ("radiance", "color", "position", "normal", "depth", "id"))
    inside, surface = seen(scene, frame, True)
    surface.roughness, surface.metallic = whole_codes(surface.roughness, surface.metallic)
    expected = radiance(surface, lighting_of(scene), PYRENDER.keys() - {"range"})
    assert np.abs(frame.radiance[inside] - expected).max() <= 1e-5 * expected.max()
    if name != "range":
        mean, largest = mean_and_largest(frame.color[inside] - theirs[inside].astype(np.float64))
        assert largest <= 1
        assert mean < 0.001


@pytest.mark.parametrize(
    ("term", "name"),
    [
        ("diffuse", "one sun"),
        ("visibility", "one sun"),
        ("floors", "one sun"),
        ("display", "one sun"),
        ("roughness", "mirrors"),
        ("emission", "emission"),
        ("occlusion", "occlusion"),
        ("tint", "vertex colours"),
        ("range", "range"),
        ("eye", "parallel rays"),
    ],
)
def test_every_term_is_needed(difference, term, name):
    """Without any one of them, its scene differs by more than rounding."""
    mean, largest = mean_and_largest(difference(name, PYRENDER.keys() - {term}))
    assert largest > 1
    assert mean > 0.1


def test_every_term_has_its_scene():
    (mark,) = test_every_term_is_needed.pytestmark
    assert {term for term, _ in mark.args[1]} == PYRENDER.keys()


def test_the_page_has_the_differences(difference):
    """docs/pyrender.md: pyrender's pictures against glTF's formula, with pyrender's and glTF's display."""
    page = (Path(__file__).parents[2] / "docs" / "pyrender.md").read_text()
    rows = re.findall(r"^\| ([a-z ]+) \| ([\d.]+) \| (\d+) \| ([\d.]+) \| (\d+) \|$", page, re.MULTILINE)
    assert [name for name, *_ in rows] == list(SCENES)
    for name, *figures in rows:
        found = [*mean_and_largest(difference(name, {"display"})), *mean_and_largest(difference(name, GLTF))]
        np.testing.assert_allclose(np.float64(figures), found, atol=1.0, err_msg=name)
        np.testing.assert_allclose(np.float64(figures[::2]), found[::2], atol=0.06, err_msg=name)


@pytest.mark.parametrize("mirrored", [False, True])
def test_normal_maps_lie_along_texture_coordinates(renderer, alike, draw_with_pyrender, mirrored):
    """pyrender takes the direction of u, and a bitangent that is right if u and v are not mirrored.

    Tangents that say so change nothing there.
    """
    pixels = (180, 150, 220, 255)
    plain, sign = wall(12.0), -1.0 if mirrored else 1.0
    texcoords = plain.texcoords * (sign, 1.0)
    tangents = np.tile([sign, 0.0, 0.0, sign], (len(plain.vertices), 1))
    geom = Geom(plain.vertices, plain.triangles, plain.normals, texcoords, tangents=tangents)
    material = Material(
        "bumps", (0.6, 0.5, 0.4, 1), metallic=0.2, roughness=0.4, normal_texture=texel(*pixels)
    )
    scene = Scene()
    scene.root.attach_new_node(geom_node("wall", geom, material)).set_pos(0, 10, 0)
    scene, frame, theirs = both(add_lights(scene, suns=1, lamps=2), renderer, draw_with_pyrender)
    inside, surface = seen(scene, frame, True)
    x, y, z = np.array(pixels[:3]) / 127.5 - 1.0
    surface.normal = np.broadcast_to((x, -z, y), surface.normal.shape) / np.linalg.norm((x, y, z))
    if mirrored:
        surface.normal = surface.normal * (-1.0, 1.0, -1.0)
    expected = codes(surface, lighting_of(scene), PYRENDER.keys())
    ours = alike.render(scene, 0.0, ("color",)).color
    assert inside.mean() > 0.5
    assert np.abs(theirs[inside] - expected).max() <= 1
    assert np.abs(theirs[inside] - ours[inside].astype(np.float64)).max() <= 1


def test_each_texel_has_its_own_roughness_and_metalness(renderer, alike, draw_with_pyrender):
    """Three by three texels: pyrender would skew rows of three texels with two or three channels."""
    pixels = np.random.default_rng(5).integers(60, 256, (3, 3, 4), np.uint8)
    packed = Texture(pixels, minfilter="nearest", magfilter="nearest")
    material = Material("tiles", (0.6, 0.5, 0.4, 1), metallic=1.0, metallic_roughness_texture=packed)
    scene = Scene()
    scene.root.attach_new_node(geom_node("wall", wall(12.0), material)).set_pos(0, 10, 0)
    scene, frame, theirs = both(add_lights(scene, suns=2), renderer, draw_with_pyrender)
    inside, surface = seen(scene, frame, True)
    across, up = surface.position[:, 0] / 12.0 + 0.5, surface.position[:, 2] / 12.0 + 0.5
    column, row = 3.0 * across, 3.0 * (1.0 - up)
    stored = pixels[row.astype(int), column.astype(int)] / 255.0
    surface.roughness, surface.metallic = stored[:, 1], stored[:, 2]
    clear = np.all([np.abs(at - np.round(at)) > 0.02 for at in (row, column)], axis=0)  # of texels' edges
    differences = theirs[inside] - codes(surface, lighting_of(scene), PYRENDER.keys())
    ours = alike.render(scene, 0.0, ("color",)).color[inside].astype(np.float64)
    assert len(np.unique(stored[clear], axis=0)) == 9
    assert np.abs(differences[clear]).max() <= 1
    assert np.abs(theirs[inside] - ours)[clear].max() <= 1


def test_the_look_pyrender_has_pyrenders_normals(alike, draw_with_pyrender):
    """Backs of two-sided surfaces keep those of their fronts, which light from behind reaches.

    Those of a stretched thing are unit vectors before they are interpolated.
    """
    scene, look = (
        Scene(),
        Material("look", (0.6, 0.5, 0.4, 1), metallic=0.3, roughness=0.4, double_sided=True),
    )
    for index, (shape, turn) in enumerate([(wall(3.0), 160.0), (wall(3.0), 20.0), (ball(1.4, 1), 0.0)]):
        path = scene.root.attach_new_node(geom_node(f"thing {index}", shape, look))
        path.set_pos_hpr(3.5 * index - 3.5, 10.0, 0.0, turn, 0.0, 0.0)
    path.set_scale(0.3, 1.0, 1.5)
    scene, frame, theirs = both(add_lights(scene, suns=2, lamps=2), alike, draw_with_pyrender)
    inside, _ = seen(scene, frame, True)
    ours = alike.render(scene, 0.0, ("color",)).color[inside].astype(np.float64)
    assert [(frame.id[inside] == index).sum() > 500 for index in range(3)] == [True] * 3
    assert np.abs(theirs[inside] - ours).max() <= 1


@pytest.mark.parametrize("terms", [GLTF, {"visibility"}])
@pytest.mark.parametrize("metallic", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
def test_the_twin_has_the_closed_form_of_light_from_the_eye(terms, metallic, roughness):
    """Then D is 1 / (pi alpha^2), F is F0, and G is 1, by either formula."""
    forward = np.array([[0.0, 1.0, 0.0]])
    one, base = np.ones(1), np.array([[0.2, 0.5, 0.8]])
    surface = Surface(
        10.0 * forward, -forward, -forward, base, metallic * one, roughness * one, 0 * base, 1 + 0 * base, one
    )
    lighting = Lighting([Lamp(np.array([3.0, 2.0, 1.0]), direction=forward[0])])
    f0 = 0.04 + (base - 0.04) * metallic
    matt = (1.0 - f0) * base * (1.0 - metallic) / np.pi
    expected = (3.0, 2.0, 1.0) * (matt + f0 / (4.0 * np.pi * roughness**4))
    np.testing.assert_allclose(radiance(surface, lighting, terms), expected, rtol=1e-12)


def test_pyrender_blends_display_codes(draw_with_pyrender):
    """Half of a grey of 0.8 in front of one of 0.2, under an ambient light of 1."""
    scene = Scene()
    scene.root.attach_new_node(AmbientLight("sky", (1.0, 1.0, 1.0)))
    for name, distance, grey, alpha in (("back", 10, 0.2, 1.0), ("front", 8, 0.8, 0.5)):
        material = Material(name, (grey, grey, grey, alpha), alpha_mode="blend", metallic=0.0)
        scene.root.attach_new_node(geom_node(name, wall(), material)).set_pos(0, distance, 0)
    middle = draw_with_pyrender(to_pyrender(scene, size=SIZE), SIZE, LIT)[0][60, 80]
    assert np.abs(middle - 255 * (0.5 * 0.8 ** (1 / 2.2) + 0.5 * 0.2 ** (1 / 2.2))).max() <= 1

"""Materials of glTF files in pictures: normal maps, occlusion, metal, blending, unlit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from firefly_sample import (
    AmbientLight,
    DirectionalLight,
    OrthographicLens,
    Renderer,
    Scene,
    Settings,
    load_model,
)
from firefly_sample.srgb import srgb_to_linear
from tests.conftest import make_renderer
from tests.model.gltf_files import GltfFile
from tests.model.quads import CORNERS, UVS, picture, quad, reflected

SIZE = 33
MIDDLE = SIZE // 2
NEAREST = {"magFilter": 9728, "minFilter": 9728}
SKY = np.array([0.5, 0.75, 1.0])
BACKGROUND = np.array([0.25, 0.5, 0.125])
AWAY = (0.5, 0.7, -0.6)
"""The way of the light, in the scene's axes: from the left, the front and above."""


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with make_renderer((SIZE, SIZE), Settings(albedo_format="rgba32f", normal_format="rgba32f")) as made:
        yield made


@pytest.fixture
def draw(renderer, tmp_path):
    """``draw(file, ...)`` gives a frame of a file, whose quad fills it; `behind`: from its other side."""

    def drawn(file: GltfFile, *outputs, light=None, sky=(0, 0, 0), behind=False, shadow=False):
        scene = Scene(background=tuple(BACKGROUND))
        load_model(file.write(tmp_path / "model.glb")).reparent_to(scene.root)
        scene.camera.set_pos(0, 10 if behind else -10, 0)
        scene.camera.set_hpr(180 if behind else 0, 0, 0)
        scene.camera.node().lens = OrthographicLens(film_size=(2, 2), near=1, far=20)
        scene.root.attach_new_node(AmbientLight("sky", sky))
        if light is not None:
            sun = DirectionalLight("sun", (1, 1, 1))
            sun.set_shadow_caster(shadow, 64)
            scene.root.attach_new_node(sun).look_at(*light)
        return renderer.render(scene, outputs=outputs or ("radiance",))

    return drawn


def painted(file: GltfFile, metallic=0.0, roughness=1.0, color=(1, 1, 1, 1), **more) -> int:
    surface = {"metallicFactor": metallic, "roughnessFactor": roughness, "baseColorFactor": list(color)}
    surface |= more.pop("surface", {})
    return file.add("materials", pbrMetallicRoughness=surface, **more)


def quarters(image: np.ndarray) -> np.ndarray:
    """The pixels in the middle of the quarters of a picture."""
    near, far = SIZE // 4, SIZE - 1 - SIZE // 4
    return np.array([image[near, near], image[near, far], image[far, near], image[far, far]])


def codes(normals) -> np.ndarray:
    """The texels (2, 2, 3) of four normals."""
    return np.round(127.5 + 127.5 * np.asarray(normals)).astype(np.uint8).reshape(2, 2, 3)


SLOPES = [(0.6, 0, 0.8), (-0.6, 0, 0.8), (0, 0.6, 0.8), (0, -0.6, 0.8)]
"""To the right, to the left, upwards and downwards in the picture, which is upright on the quad."""


def bumpy(given: bool, scale=(1, 1, 1), turned=0, texels=None, **more) -> GltfFile:
    """A quad with a normal map, whose texture coordinates are turned by quarters."""
    file = GltfFile()
    texture = picture(file, codes(SLOPES) if texels is None else texels, **NEAREST)
    material = painted(file, normalTexture={"index": texture, **more}, doubleSided=True)
    along = np.float32([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])[turned]
    tangents = {"TANGENT": np.float32([[*along, 1]] * 4)} if given else {}
    file.node(
        mesh=quad(file, material=material, TEXCOORD_0=np.roll(UVS, turned, axis=0), **tangents),
        scale=list(scale),
    )
    return file


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("behind", [False, True])
@pytest.mark.parametrize("mirrored", [False, True])
def test_normals_of_a_map_point_where_its_picture_says(draw, given, behind, mirrored):
    """Red is to the right and green upwards in the picture, wherever that is on the surface."""
    found = draw(bumpy(given, (-1 if mirrored else 1, 1, 1)), "normal_world", behind=behind).normal_world
    x, y, z = (2.0 * codes(SLOPES) / 255.0 - 1.0).reshape(4, 3).T
    expected = np.stack([-x if mirrored else x, -z, y], axis=1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    if behind:  # the back of a surface has all three axes turned, as has its light
        expected = -expected
    if mirrored != behind:  # what is on the right of the picture is on the left of the frame
        expected = expected[[1, 0, 3, 2]]
    np.testing.assert_allclose(quarters(found), expected, atol=1e-6)


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("turned", range(4))
def test_normals_turn_with_the_texture(draw, given, turned):
    found = quarters(draw(bumpy(given, turned=turned), "normal_world").normal_world)
    plain = quarters(draw(bumpy(given), "normal_world").normal_world)
    right, up = plain[:, 0], plain[:, 2]
    for _ in range(turned):
        right, up = -up, right
    order = np.array([[0, 1], [2, 3]])
    places = np.rot90(order, turned).reshape(-1)
    np.testing.assert_allclose(found, np.stack([right, plain[:, 1], up], axis=1)[places], atol=1e-6)


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("behind", [False, True])
def test_a_mirrored_bump_is_lit_as_the_mirror_image(draw, given, behind):
    """The image, and the light's way, are mirrored in x."""
    rng = np.random.default_rng(3)
    # three pixels a texel, so that no pixel lies between two
    slopes = np.concatenate([rng.uniform(-0.6, 0.6, (11, 11, 2)), np.full((11, 11, 1), 0.8)], axis=2)
    texels = np.round(127.5 + 127.5 * slopes).astype(np.uint8)
    y = -AWAY[1] if behind else AWAY[1]
    plain = draw(bumpy(given, texels=texels), light=(AWAY[0], y, AWAY[2]), behind=behind).radiance
    mirror = bumpy(given, (-1, 1, 1), texels=texels)
    found = draw(mirror, light=(-AWAY[0], y, AWAY[2]), behind=behind).radiance
    assert np.ptp(plain) > 0.2
    np.testing.assert_allclose(found[:, ::-1], plain, atol=2e-6)


def test_the_scale_of_a_normal_map_multiplies_its_slopes(draw):
    found = quarters(draw(bumpy(False), "normal_world").normal_world)
    steep = bumpy(False)
    steep.json["materials"][0]["normalTexture"]["scale"] = 3
    scaled = quarters(draw(steep, "normal_world").normal_world)
    np.testing.assert_allclose(scaled[:, ::2] / scaled[:, 1:2], 3 * found[:, ::2] / found[:, 1:2], atol=1e-5)


@pytest.mark.parametrize("strength", [0.0, 0.5, 1.0])
def test_occlusion_darkens_ambient_light_alone(draw, strength):
    reds = np.array([0, 51, 153, 255])
    texels = np.stack([reds, 255 - reds, 0 * reds], axis=1).astype(np.uint8).reshape(2, 2, 3)
    file = GltfFile()
    hollow = {"index": picture(file, texels, **NEAREST), "strength": strength}
    material = painted(file, color=(0.5, 0.25, 1, 1), occlusionTexture=hollow, emissiveFactor=[0.5, 0, 0])
    file.node(mesh=quad(file, material=material))
    base, glow = np.array([0.5, 0.25, 1.0]), np.array([0.5, 0.0, 0.0])
    shown = quarters(draw(file, sky=SKY).radiance)
    part = (1 + strength * (reds / 255 - 1))[:, None]
    np.testing.assert_allclose(shown, glow + part * (0.04 + 0.96 * base) * SKY, rtol=1e-5)
    lit = quarters(draw(file, light=(0, 1, 0)).radiance)
    np.testing.assert_allclose(lit, [glow + reflected(base, math.pi, 1.0)] * 4, rtol=1e-5)


def test_blue_is_metal_and_green_is_roughness(draw):
    file = GltfFile()
    texels = np.uint8([[[9, 255, 0], [99, 255, 255]], [[0, 102, 0], [255, 102, 255]]])
    maps = {"metallicRoughnessTexture": {"index": picture(file, texels, **NEAREST)}}
    color = np.array([0.9, 0.5, 0.1])
    file.node(mesh=quad(file, material=painted(file, 0.8, 0.7, (*color, 1), surface=maps)))
    way = np.array([0.3, 0.8, -0.2])
    cosine = way[1] / np.linalg.norm(way)
    shares = [(0.0, 0.7), (0.8, 0.7), (0.0, 0.28), (0.8, 0.28)]
    lit = quarters(draw(file, light=tuple(way)).radiance)
    np.testing.assert_allclose(
        lit, [reflected(color, math.pi, cosine, *share) for share in shares], rtol=1e-4
    )
    sky = quarters(draw(file, sky=SKY).radiance)
    for found, (metallic, _) in zip(sky, shares, strict=True):
        start = 0.04 * (1 - metallic) + color * metallic
        np.testing.assert_allclose(found, (start + (1 - start) * (1 - metallic) * color) * SKY, rtol=1e-4)


@pytest.mark.parametrize("ground", [False, True])
def test_a_blended_quad_lets_through_what_its_alphas_leave(draw, ground):
    """Alpha is the product of factor, texture and vertex colour; radiance is mixed, before the tone curve."""
    file = GltfFile()
    alphas = np.array([0, 51, 204, 255])
    texels = np.stack([0 * alphas + 255, 0 * alphas + 188, 0 * alphas, alphas], axis=1).astype(np.uint8)
    surface = {"baseColorTexture": {"index": picture(file, texels.reshape(2, 2, 4), **NEAREST)}}
    glass = painted(file, color=(1, 1, 0.5, 0.75), alphaMode="BLEND", surface=surface)
    tint = np.float32([[0.5, 1, 1, 0.5]] * 4)
    file.node(mesh=quad(file, material=glass, COLOR_0=tint))
    behind = BACKGROUND
    if ground:
        wall = painted(file, color=(0.2, 0.4, 0.6, 1))
        file.node(mesh=quad(file, material=wall), translation=[0, 0, -1])
        behind = (0.04 + 0.96 * np.array([0.2, 0.4, 0.6])) * SKY
    base = np.array([0.5, srgb_to_linear(np.array(188 / 255)), 0.0])
    shown = (0.04 + 0.96 * base) * SKY
    alpha = (alphas / 255 * 0.75 * 0.5)[:, None]
    frame = draw(file, sky=SKY)
    np.testing.assert_allclose(quarters(frame.radiance), alpha * shown + (1 - alpha) * behind, rtol=2e-4)
    assert frame.warnings == ()


@pytest.mark.parametrize("alpha", [0.25, 0.49, 0.51, 0.75])
def test_a_blended_quad_blocks_light_from_an_alpha_of_one_half_on(draw, alpha):
    file = GltfFile()
    glass = painted(file, color=(1, 1, 1, alpha), alphaMode="BLEND")
    file.node(mesh=quad(file, material=glass))
    file.node(mesh=quad(file, material=painted(file)), translation=[0, 0, -1])
    shown = reflected(1.0, math.pi, 1.0)
    behind = 0.0 if alpha >= 0.5 else shown
    found = draw(file, light=(0, 1, 0), shadow=True).radiance[MIDDLE, MIDDLE]
    np.testing.assert_allclose(found, [alpha * shown + (1 - alpha) * behind] * 3, rtol=2e-4)


def test_data_show_the_nearest_opaque_surface(draw):
    file = GltfFile()
    glass = painted(file, color=(1, 1, 1, 0.75), name="pane", alphaMode="BLEND")
    file.node(mesh=quad(file, material=glass))
    file.node(mesh=quad(file, material=painted(file)), translation=[0, 0, -1])
    frame = draw(file, "depth", "id")
    assert frame.depth[MIDDLE, MIDDLE] == pytest.approx(11.0)
    assert frame.id_names[frame.id[MIDDLE, MIDDLE]].endswith("node 1")
    (line,) = frame.warnings
    assert "nearest opaque surface" in line
    assert "pane" in line


def test_no_light_meets_an_unlit_surface(draw):
    file = GltfFile()
    plain = painted(file, 1.0, 0.5, (0.5, 0.25, 1, 1), extensions={"KHR_materials_unlit": {}})
    file.node(mesh=quad(file, material=plain))
    for light in (None, AWAY):
        shown = draw(file, light=light, sky=SKY).radiance[MIDDLE, MIDDLE]
        np.testing.assert_allclose(shown, (0.5, 0.25, 1), rtol=1e-5)


def test_flat_triangles_take_a_normal_map(draw):
    """Without normals in the file tangents are computed, whatever the file says."""
    file = GltfFile()
    texture = picture(file, codes(SLOPES), **NEAREST)
    material = painted(file, normalTexture={"index": texture})
    mesh = file.mesh(
        POSITION=CORNERS[[0, 1, 2, 0, 2, 3]], TEXCOORD_0=UVS[[0, 1, 2, 0, 2, 3]], material=material
    )
    file.node(mesh=mesh)
    found = draw(file, "normal_world").normal_world
    np.testing.assert_allclose(
        quarters(found), quarters(draw(bumpy(False), "normal_world").normal_world), atol=1e-6
    )

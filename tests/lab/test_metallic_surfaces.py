"""Textures and factors of metallic-roughness surfaces, and the normals of normal maps."""

import numpy as np
import pytest

from firefly_sample.errors import OutputError
from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.metallic import ambient_reflectance
from firefly_sample.lab.reference.normal_map import mapped_normal
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.lab.float64 import covering, plan_of
from tests.scenes import geom_node

CORNERS = np.array([(-40.0, 0.0, -30.0), (40.0, 0.0, -30.0), (0.0, 0.0, 60.0)])
"""Of a triangle that fills the view, facing -Y."""
TANGENTS = np.tile([1.0, 0.0, 0.0, 1.0], (3, 1))
TEXEL = (210, 90, 200)
SIZE = (8, 6)


def flat(*rgb, right=None):
    """A texture of one colour, or of another one in its right half."""
    pixels = np.zeros((4, 4, 4), dtype=np.uint8)
    pixels[...] = (*rgb, 255)
    if right is not None:
        pixels[:, 2:, :3] = right
    return Texture(pixels, minfilter="nearest", magfilter="nearest")


def one_triangle(material, **arrays):
    scene = Scene()
    given = {"texcoords": np.full((3, 2), 0.25), "tangents": TANGENTS} | arrays
    geom = Geom(given.pop("vertices", CORNERS), [(0, 1, 2)], **given)
    scene.root.attach_new_node(geom_node("triangle", geom, material)).set_pos(0, 10, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(4, 3), near=1, far=100)
    return scene


def seen(scene, **given):
    plan = plan_of(scene, SIZE)
    return see_surfaces(plan, covering(plan), **given)


def same(image, value):
    return np.abs(image - value).max() <= 1e-14


@pytest.mark.parametrize("second", [False, True])
def test_factors_are_multiplied_by_green_and_blue_as_stored(second):
    """Texels are numbers, not sRGB, also where a base texture of the same image is a colour."""
    texture = flat(10, 20, 30, right=(200, 51, 102))
    material = Material(
        base_color=(1, 1, 1, 1),
        texture=texture,
        metallic=0.5,
        roughness=0.8,
        metallic_roughness_texture=texture,
        metallic_roughness_texcoord=int(second),
    )
    gbuffer = seen(one_triangle(material, texcoords_1=np.full((3, 2), 0.75))).gbuffer
    green, blue = (51, 102) if second else (20, 30)
    assert same(gbuffer.metallic, 0.5 * blue / 255)
    assert same(gbuffer.roughness, 0.8 * green / 255)
    assert gbuffer.albedo.max() < 0.02  # decoded from sRGB, at the first coordinates
    assert not gbuffer.specular.any()
    assert not gbuffer.shininess.any()


def test_other_surfaces_and_nothing_are_not_metallic():
    plan = plan_of(one_triangle(Material(specular=(1, 1, 1), shininess=9.0)), SIZE)
    visibility = covering(plan)
    visibility[0] = -1
    gbuffer = see_surfaces(plan, visibility).gbuffer
    assert (gbuffer.metallic == -1.0).all()
    assert (gbuffer.roughness == 1.0).all()
    assert (gbuffer.shininess[1:] == 9.0).all()


@pytest.mark.parametrize("metallic", [None, 0.3])
def test_occlusion_dims_ambient_light_alone(metallic):
    material = Material(
        base_color=(0.9, 0.5, 0.2, 1),
        metallic=metallic,
        occlusion_texture=flat(51, 0, 0),
        occlusion_strength=0.5,
    )
    surfaces = seen(one_triangle(material))
    base = np.array([0.9, 0.5, 0.2])
    whole = base if metallic is None else ambient_reflectance(base, metallic)
    assert same(surfaces.ambient_albedo, whole * (1 + 0.5 * (0.2 - 1)))
    assert same(surfaces.gbuffer.albedo, base)


@pytest.mark.parametrize("metallic", [None, 1.0])
def test_unlit_surfaces_show_their_colour_and_no_light(metallic):
    """KHR_materials_unlit: base colour, its texture and vertex colours; no emission of its own."""
    material = Material(
        base_color=(0.9, 0.5, 0.2, 1),
        texture=flat(255, 0, 255),
        emission=(7, 7, 7),
        emission_texture=flat(255, 255, 255),
        normal_texture=flat(*TEXEL),
        metallic=metallic,
        unlit=True,
    )
    scene = one_triangle(material, colors=np.full((3, 3), 0.5))
    scene.root.attach_new_node(PointLight("lamp")).set_pos(0, 5, 0)
    scene.root.attach_new_node(AmbientLight("sky"))
    surfaces = seen(scene)
    assert same(surfaces.emission, (0.45, 0.0, 0.1))
    assert not surfaces.gbuffer.albedo.any()
    assert not surfaces.ambient_albedo.any()
    assert (surfaces.gbuffer.metallic == -1.0).all()
    plan = plan_of(scene, SIZE)
    assert same(render_reference(plan, covering(plan), shadows=False).radiance, (0.45, 0.0, 0.1))


def bump(scale=1.0):
    x, y, z = (2 * code / 255 - 1 for code in TEXEL)
    return np.array([scale * x, scale * y, z]) / np.linalg.norm([scale * x, scale * y, z])


@pytest.mark.parametrize("scale", [1.0, 0.25, -2.0])
@pytest.mark.parametrize("handed", [1.0, -1.0])
def test_a_texel_is_a_normal_in_tangent_space(handed, scale):
    """Seen along +Y: tangent +X, normal -Y, and so the bitangent is +Z for a sign of 1."""
    material = Material(normal_texture=flat(*TEXEL), normal_scale=scale)
    tangents = np.tile([3.0, 0.0, 0.0, handed], (3, 1))
    gbuffer = seen(one_triangle(material, tangents=tangents)).gbuffer
    along, up, out = bump(scale)
    assert same(gbuffer.normal, (along, -out, handed * up))


def test_a_map_goes_by_its_own_coordinates_and_not_by_srgb():
    texture = flat(128, 128, 255, right=TEXEL)
    material = Material(normal_texture=texture, normal_texcoord=1)
    gbuffer = seen(one_triangle(material, texcoords_1=np.full((3, 2), 0.75))).gbuffer
    along, up, out = bump()
    assert same(gbuffer.normal, (along, -out, up))


def test_the_back_of_a_two_sided_surface_has_its_normals_turned():
    """From behind, the picture is mirrored, and the surface's bumps are hollows."""
    material = Material(normal_texture=flat(*TEXEL), double_sided=True)
    scene = one_triangle(material)
    front = seen(scene).gbuffer.normal
    scene.camera.set_pos(0, 20, 0)
    scene.camera.set_h(180)
    behind = seen(scene).gbuffer.normal
    # the camera has turned half around Z, and the normal is turned to it
    assert np.abs(behind - front * (1, 1, -1)).max() <= 1e-14
    scene.root.find("triangle").node().geoms[:] = [
        (geom, Material(normal_texture=material.normal_texture))
        for geom, _ in scene.root.find("triangle").node().geoms
    ]
    assert np.abs(seen(scene).gbuffer.normal + behind).max() <= 1e-14


def test_a_mirrored_model_has_mirrored_normals():
    """A model by a mirror's matrix is what a mirror shows of it, bumps and all."""
    rng = np.random.default_rng(3)
    normals = rng.normal((0, -4, 0), 1.0, (3, 3))
    tangents = np.column_stack([rng.normal((4, 0, 0), 1.0, (3, 3)), [-1.0, -1.0, -1.0]])
    scene = one_triangle(Material(normal_texture=flat(*TEXEL)), normals=normals, tangents=tangents)
    plain = seen(scene).gbuffer.normal
    scene.root.find("triangle").set_scale(-1, 1, 1)
    plan = plan_of(scene, SIZE)
    assert plan.batches[0].mirrored
    mirrored = see_surfaces(plan, covering(plan)).gbuffer.normal
    assert np.abs(mirrored[:, ::-1] - plain * (-1, 1, 1)).max() <= 1e-13
    assert np.ptp(plain.reshape(-1, 3), axis=0).max() > 1e-3


def test_tangents_go_with_the_surface_and_normals_with_its_cofactors():
    """A stretched and sheared surface: the tangent stays in it, the normal stays across."""
    scene = one_triangle(Material(normal_texture=flat(*TEXEL)))
    path = scene.root.find("triangle")
    path.set_scale(2.0, 1.0, 3.0)
    path.set_hpr(20, 15, 40)
    plan = plan_of(scene, SIZE)
    matrix = plan.batches[0].model_to_view[0, :3, :3]
    tangent = np.array([1.0, 0.0, 0.0]) @ matrix
    normal = np.cross(np.array([1.0, 0.0, 0.0]) @ matrix, np.array([0.0, 0.0, 1.0]) @ matrix)
    tangent, normal = tangent / np.linalg.norm(tangent), normal / np.linalg.norm(normal)
    assert normal[1] < 0
    along, up, out = bump()
    expected = along * tangent + up * np.cross(normal, tangent) + out * normal
    found = see_surfaces(plan, covering(plan)).gbuffer.normal
    assert np.abs(found - expected / np.linalg.norm(expected)).max() <= 1e-13


def test_without_a_direction_there_is_no_mapping():
    """Tangents that cancel, and a texel that does."""
    unit = np.array([[0.0, -1.0, 0.0], [0.0, 0.6, 0.8], [0.0, -1.0, 0.0]])
    tangent = np.array([[0.0, 0.0, 0.0, 1.0], [1e-200, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]])
    texel = np.array([[0.9, 0.9, 0.9], [1.0, 0.5, 0.5], [0.5, 0.5, 0.5]])
    found = mapped_normal(unit, tangent, texel, 1.0, mirrored=False)
    assert found.tolist() == [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]


def test_the_classic_look_has_none_of_it():
    material = Material(base_color=(0.9, 0.5, 0.2, 1), metallic=1.0, normal_texture=flat(*TEXEL), unlit=True)
    plan = build_plan(one_triangle(material), Settings(look="classic"), SIZE)
    surfaces = see_surfaces(plan, covering(plan))
    assert same(surfaces.gbuffer.normal, (0, -1, 0))
    assert same(surfaces.gbuffer.albedo, (0.9, 0.5, 0.2))
    assert (surfaces.gbuffer.metallic == -1.0).all()


TEXTURED = Material(
    base_color=(0.9, 0.5, 0.2, 1),
    metallic=0.5,
    roughness=0.5,
    metallic_roughness_texture=flat(0, 100, 100),
    normal_texture=flat(*TEXEL),
)
PLAIN = Material(base_color=(0.9, 0.5, 0.2, 1), metallic=0.5, roughness=0.5)


def test_a_gpus_samples_are_taken_where_there_are_textures_and_nowhere_else():
    """A normal that is given replaces the map's; the ambient colour follows from what is given."""
    shape = (SIZE[1], SIZE[0])
    given = {
        "metallic_roughness": np.broadcast_to((0.25, 0.75), (*shape, 2)),
        "normal": np.broadcast_to((0.0, -0.6, 0.8), (*shape, 3)),
        "albedo": np.full((*shape, 3), 0.5),
    }
    taken = seen(one_triangle(TEXTURED), **given)
    assert (taken.gbuffer.metallic == 0.25).all()
    assert (taken.gbuffer.roughness == 0.75).all()
    assert (taken.gbuffer.normal == (0.0, -0.6, 0.8)).all()
    assert same(taken.ambient_albedo, ambient_reflectance(np.full(3, 0.5), 0.25))
    left = seen(one_triangle(PLAIN), **given)
    assert (left.gbuffer.metallic == 0.5).all()
    assert (left.gbuffer.roughness == 0.5).all()
    assert (left.gbuffer.normal == (0.0, -1.0, 0.0)).all()


@pytest.mark.parametrize(("name", "channels"), [("metallic_roughness", 3), ("normal", 2)])
def test_samples_of_a_wrong_shape_are_refused(name, channels):
    with pytest.raises(OutputError, match="must have the plan's shape"):
        seen(one_triangle(TEXTURED), **{name: np.zeros((SIZE[1], SIZE[0], channels))})

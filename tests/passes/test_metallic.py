"""The lighting passes on metallic-roughness surfaces, against float64 on the same G-buffer."""

import numpy as np
import pytest

from firefly_sample.errors import OutputError
from firefly_sample.lab.reference.metallic import ambient_reflectance, reflected
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights
from firefly_sample.scene.material import Material, Texture
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear
from tests.conftest import borrow_renderer
from tests.lab.hemisphere import UP, half_vectors, tilted
from tests.lit_scenes import KINDS
from tests.reference import BOUNDS, compare
from tests.scenes import ball, geom_node, orthographic_wall, wall, wall_scene

SIZE = 96, 72
ROUGHNESS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
METALLIC = (0.0, 0.3, 1.0)
LIGHTS = 470
WHOLE = Settings(cutoff_budget=0.0)

BOUND = 1e-5
"""Of the difference, times the roughness, over a pixel's own radiance: float32's rounding of highlights."""
FLOOR = 1e-3
"""Of the 99.9th percentile: the least radiance that a difference is divided by."""


def whole_codes(roughness, metallic):
    """The numbers next to these that sixteen bits hold."""
    return np.round(roughness * 65535) / 65535, np.round(metallic * 65534) / 65534


def field(seed=0, orthographic=False):
    """Balls of every roughness and metalness, of Phong and matt ones and of one unlit, under 500 lights."""
    scene, geom, rng = Scene(), ball(0.5), np.random.default_rng(seed)
    for row, share in enumerate(METALLIC):
        for column, rough in enumerate(ROUGHNESS):
            roughness, metallic = whole_codes(rough, share)
            color = (*rng.uniform(0.1, 1.0, 3), 1.0)
            material = Material(f"{row} {column}", color, metallic=metallic, roughness=roughness)
            place = 1.3 * column - 3.9, 10 + 1.3 * row, -0.5
            scene.root.attach_new_node(geom_node(material.name, geom, material)).set_pos(*place)
    others = (
        Material("phong", (0.3, 0.5, 0.2, 1.0), specular=(0.5, 0.6, 0.7), shininess=30.0),
        Material("matt", (0.7, 0.6, 0.5, 1.0)),
        Material("sign", (0.2, 0.9, 0.4, 1.0), unlit=True),
    )
    for index, material in enumerate(others):
        node = geom_node(material.name, geom, material)
        scene.root.attach_new_node(node).set_pos(2 * index - 2, 8.7, -0.5)
    roughness, metallic = whole_codes(0.4, 0.1)
    slab = Material("slab", (0.4, 0.4, 0.4, 1.0), metallic=metallic, roughness=roughness)
    scene.root.attach_new_node(geom_node("floor", wall(30.0, 8), slab)).set_pos_hpr(0, 10, -1, 0, -90, 0)
    places = rng.uniform((-6, 6, -0.8), (6, 16, 2), (LIGHTS, 3))
    scene.root.attach_new_node(PointLights("lights", places, rng.uniform(0.2, 1, (LIGHTS, 3)), 2.0))
    for kind in ("attenuated", "sun", "spots"):
        KINDS[kind](scene.root, rng)
    scene.root.attach_new_node(AmbientLight("sky", (0.02, 0.03, 0.05)))
    scene.camera.set_pos_hpr(0, 0, 5, 0, -25, 0)
    scene.camera.node().lens = (
        OrthographicLens(film_size=(12, 9), near=1, far=60)
        if orthographic
        else PerspectiveLens(vfov=40, near=0.5, far=100)
    )
    return scene


def apart(image, expected, gbuffer, covered):
    """The difference of each pixel over its own radiance, times its roughness; 1 where it has none."""
    radiance = expected.max(axis=-1)
    floor = FLOOR * np.percentile(radiance[covered], 99.9)
    difference = np.abs(image.astype(np.float64) - expected).max(axis=-1)
    return difference / np.maximum(radiance, floor) * np.where(gbuffer.metallic >= 0, gbuffer.roughness, 1.0)


def compared_field(settings, **kind):
    """The frame of the field against float64, and the pixels' differences."""
    compared = compare(field(**kind), settings, SIZE, shadows=False)
    assert sum(map(len, compared.plan.lights)) >= 490
    metal = compared.gbuffer.metallic[compared.chosen]
    assert (metal == -1).any()
    assert np.unique(metal).size > 3
    assert compared.chosen.sum() >= 0.95 * compared.covered.sum()
    different = apart(compared.frame.radiance, compared.expected, compared.gbuffer, compared.covered)
    return compared, different[compared.chosen]


# --- Against the reference ---


@pytest.mark.parametrize("method", ["volumes", "clustered", "fullscreen", "loop"])
def test_500_lights_by_each_method_are_what_float64_says(method):
    compared, different = compared_field(WHOLE.with_changes(light_method=method))
    assert compared.plan.light_method.name == method
    assert different.max() <= BOUND
    assert compared.error("light") <= BOUNDS["linear32f"]


@pytest.mark.parametrize(
    "changes",
    [
        {"specular_model": "blinn_phong"},
        {"clamp_light": True},
        {"range_falloff": "gltf"},
        {"normal_format": "rgba32f", "albedo_format": "rgba8"},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_each_setting_of_the_light_is_its_twins(changes):
    _, different = compared_field(WHOLE.with_changes(**changes))
    assert different.max() <= BOUND


def test_through_an_orthographic_lens():
    _, different = compared_field(WHOLE, orthographic=True)
    assert different.max() <= BOUND


@pytest.mark.parametrize(
    ("method", "coarser"),
    [("depth32f", 1), ("stored32f", 1), ("stored16f", 1), ("depth24", 30), ("depth16", 30)],
)
def test_from_every_position_method(method, coarser):
    """As for other materials, a distance from a standard depth buffer is thirty times as coarse."""
    _, different = compared_field(WHOLE.with_changes(position_method=method))
    assert BOUNDS["depth24"] / BOUNDS["linear32f"] == pytest.approx(30)
    assert different.max() <= coarser * BOUND


def test_forward_shading_is_the_same_light():
    """It keeps no G-buffer: that of the same plan by another method is shaded in float64.

    Nothing is rounded for a G-buffer there, so that normals differ in their last digit.
    """
    exact = WHOLE.with_changes(albedo_format="rgba32f", normal_format="rgba32f")
    compared, _ = compared_field(exact)
    with borrow_renderer(SIZE, exact.with_changes(light_method="forward")) as renderer:
        image = renderer.render(field(), outputs=("radiance",)).radiance
    different = apart(image, compared.expected, compared.gbuffer, compared.covered)[compared.chosen]
    assert different.max() <= 3 * BOUND


def test_in_shadow():
    """Shadow maps of a sun and of a lamp take the highlight with the rest."""
    scene = field()
    scene.root.find("lights").detach_node()
    scene.root.find("sun").node().set_shadow_caster(True, 256)
    lamp = PointLight("lamp", (2.0, 2.0, 2.0), 20.0)
    lamp.set_shadow_caster(True, 128)
    scene.root.attach_new_node(lamp).set_pos(1, 10, 3)
    compared = compare(scene, WHOLE, SIZE, shadows=True)
    different = apart(compared.frame.radiance, compared.expected, compared.gbuffer, compared.covered)
    # at a shadow's edge, a texel may be on the other side of the comparison
    assert np.percentile(different[compared.chosen], 99) <= BOUND
    lit = compare(field(), WHOLE, SIZE).frame.radiance
    assert np.abs(lit - compared.frame.radiance).max() > 0.1


# --- At half the resolution ---


def test_at_half_the_resolution_pixels_that_are_lit_themselves_are_the_full_ones():
    full, _ = compared_field(WHOLE)
    with borrow_renderer(SIZE, WHOLE.with_changes(light_resolution="half")) as renderer:
        image = renderer.render(field(), outputs=("radiance",)).radiance
    different = apart(image, full.expected, full.gbuffer, full.covered)
    own = np.zeros(SIZE[::-1], dtype=bool)
    own[::-1][::2, ::2] = True  # every second one from the lower left
    assert different[own & full.chosen].max() <= BOUND
    assert (different[~own & full.chosen] > BOUND).any()


def test_half_the_resolution_has_no_light_of_metals_and_says_what_to_do():
    scene, half = field(), Settings(light_resolution="half")
    with borrow_renderer(SIZE, half) as renderer:
        with pytest.raises(OutputError, match=r"choose light_resolution=full, or leave color, .* out"):
            renderer.plan(scene, outputs=("radiance", "light"))
        light = renderer.render(scene, outputs=("light",)).light
        renderer.settings = Settings()
        full = renderer.render(scene, outputs=("light",)).light
    assert np.abs(light - full)[::-1][::2, ::2].max() <= 1e-5 * full.max()


# --- Energy ---


@pytest.mark.parametrize("degrees", [0.0, 45.0, 75.0])
@pytest.mark.parametrize("roughness", [0.05, 0.3, 1.0])
def test_a_white_furnace_reflects_no_more_than_arrives(render, roughness, degrees):
    """Equal light from everywhere on a white metal: directional lights at the nodes of a quadrature."""
    to_eye = tilted(degrees)  # above a surface whose normal is +Z
    half, weights = half_vectors(max(roughness, 1 / 32) ** 2, 24, 32)
    v_dot_h = half @ to_eye
    to_light = 2.0 * v_dot_h[:, None] * half - to_eye
    seen = (v_dot_h > 0) & (to_light[:, 2] > 1e-6)
    solid = (4.0 * v_dot_h * weights / half[:, 2])[seen]
    scene = orthographic_wall()
    surface = scene.root.find("wall")
    surface.set_material(Material("white", metallic=1.0, roughness=roughness))
    turn = np.array([to_eye, np.cross([0, 1, 0], to_eye), [0, 1, 0]])  # to the eye, across, up
    view = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # the same three in the scene
    to_scene = turn.T @ view
    # the wall's normal is -Y before it is turned
    surface.set_h(np.degrees(np.arctan2(to_scene[2, 0], -to_scene[2, 1])))
    for direction, share in zip(to_light[seen] @ to_scene, solid / np.pi, strict=True):
        light = DirectionalLight("light", (share,) * 3)
        light.set_direction(tuple(-direction))
        scene.root.attach_new_node(light)
    frame = render(scene, Settings(light_method="loop"), (3, 3), ("radiance", "normal_world"))
    assert frame.normal_world[1, 1] == pytest.approx(to_scene[2], abs=1e-4)
    bright = float(frame.radiance[1, 1].max())
    _, glint = reflected(*metal(roughness, to_light[seen]), UP, to_light[seen], to_eye)
    expected = (solid * to_light[seen, 2] / np.pi) @ glint
    assert bright <= 1.0 + 1e-5
    assert bright == pytest.approx(float(expected[0]), rel=1e-4)


def metal(roughness, like):
    """Base colours, metalness and roughness of a white metal, a row for each of some vectors."""
    return np.ones_like(like), np.ones(len(like)), np.full(len(like), roughness)


def test_the_budget_counts_how_much_a_metal_concentrates_a_light():
    """Far lights whose diffuse light cannot be seen are bright in a polished metal."""
    scene = wall_scene(material=Material("mirror", (1.0, 1.0, 1.0, 1.0), metallic=1.0, roughness=0.1))
    rng = np.random.default_rng(0)
    places = rng.uniform((-60, -60, -60), (60, 5, 60), (30, 3))
    scene.root.attach_new_node(PointLights("far", places, (0.5, 0.4, 0.3), attenuation=(1, 0.5, 3.0)))
    with borrow_renderer(SIZE) as renderer:
        ends = renderer.plan(scene).lights[0].reaches.min()
        cut = renderer.render(scene, outputs=("radiance",)).radiance
        renderer.settings = WHOLE
        whole = renderer.render(scene, outputs=("radiance",)).radiance
        renderer.settings = Settings()
        scene.root.find("wall").set_material(Material("matt"))
        assert renderer.plan(scene).lights[0].reaches.max() < ends
    assert np.abs(whole - cut).max() <= Settings().budget + 1e-6 * whole.max()
    assert whole.max() > 1e-3


# --- Ambient light, occlusion, unlit surfaces ---


def image(*texel):
    return Texture(np.full((2, 2, 4), texel, dtype=np.uint8))


def centre_of(frame, output="radiance"):
    height, width = frame[output].shape[:2]
    return frame[output][height // 2, width // 2].astype(np.float64)


@pytest.mark.parametrize("metallic", [0.0, 0.25, 1.0])
def test_ambient_light_is_reflected_as_head_on(render, metallic):
    base, sky = np.array([0.9, 0.5, 0.1]), np.array([0.3, 0.6, 1.2])
    material = Material("m", (*base, 1.0), metallic=metallic, roughness=0.3)
    material.occlusion_texture, material.occlusion_strength = image(51, 0, 0, 255), 0.5
    scene = wall_scene(material=material)
    scene.root.attach_new_node(AmbientLight("sky", tuple(sky)))
    occlusion = 1.0 + 0.5 * (51 / 255 - 1.0)
    head_on = 0.04 * (1 - metallic) + base * metallic
    share = (head_on + (1 - head_on) * base * (1 - metallic)) * occlusion
    assert share == pytest.approx(ambient_reflectance(base, metallic) * occlusion)
    frame = render(scene, Settings(albedo_format="rgba32f"), (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx(share * sky, rel=1e-6)
    stored = (np.round(np.sqrt(share) * 1023) / 1023) ** 2
    assert centre_of(render(scene, None, (9, 9), ("radiance",))) == pytest.approx(stored * sky, rel=1e-6)


@pytest.mark.parametrize("metallic", [None, 0.5])
def test_occlusion_dims_ambient_light_alone(render, metallic):
    material = Material("m", (0.9, 0.5, 0.1, 1.0), metallic=metallic, occlusion_texture=image(0, 9, 9, 255))
    scene = wall_scene(material=material)
    sky = scene.root.attach_new_node(AmbientLight("sky", (1.0, 1.0, 1.0)))
    assert render(scene, None, (9, 9), ("radiance",)).radiance.max() == 0.0
    sky.detach_node()
    scene.root.attach_new_node(DirectionalLight("sun"))
    lit = render(scene, None, (9, 9), ("radiance",)).radiance
    material.occlusion_texture = None
    assert lit.max() > 0.1
    assert (render(scene, None, (9, 9), ("radiance",)).radiance == lit).all()


@pytest.mark.parametrize("look", ["correct", "pyrender", "panda3d"])
@pytest.mark.parametrize("method", ["auto", "forward"])
@pytest.mark.parametrize("alpha_mode", ["opaque", "blend"])
def test_an_unlit_surface_has_no_highlights_beside_surfaces_that_have(render, look, method, alpha_mode):
    base = np.array([0.4, 0.3, 0.1])
    shine = {"specular": (0.5, 0.5, 0.5), "shininess": 2.0}
    scene = wall_scene(material=Material("shiny", **shine))
    for x, kind in ((-2.0, shine), (2.0, {"metallic": 0.5, "roughness": 0.7})):
        made = Material("sign", (*base, 1.0), alpha_mode=alpha_mode, **kind)
        scene.root.attach_new_node(geom_node("sign", wall(3.0), made)).set_pos(x, 9, 0)
    for path in scene.root.find_all_matches("sign"):
        path.set_light_off(1)
    scene.root.attach_new_node(DirectionalLight("sun", (0.5, 0.5, 0.5)))
    settings = Settings(tone="none", look=look, light_method=method)
    row = render(scene, settings, (9, 9), ("radiance",)).radiance[4]
    assert row[[3, 5]] == pytest.approx(np.array([base, base]), abs=2e-3)
    assert row[0].min() > 0.5  # with a highlight


@pytest.mark.parametrize("metallic", [None, 0.5])
@pytest.mark.parametrize("method", ["auto", "forward"])
def test_an_unlit_surface_shows_its_base_color(render, metallic, method):
    """No light changes it, and the tone curve is that of the picture."""
    base = np.array([0.9, 0.5, 0.1])
    material = Material("sign", (*base, 1.0), image(200, 100, 255, 255), metallic=metallic, unlit=True)
    material.set_emission((5.0, 5.0, 5.0))  # of which an unlit surface has none
    scene = wall_scene(material=material)
    scene.root.attach_new_node(AmbientLight("sky", (1.0, 1.0, 1.0)))
    scene.root.attach_new_node(DirectionalLight("sun", (9.0, 9.0, 9.0)))
    frame = render(scene, Settings(light_method=method, tone="none"), (9, 9), ("radiance", "color"))
    expected = base * srgb_to_linear(np.array([200, 100, 255]) / 255)
    assert centre_of(frame) == pytest.approx(expected, rel=1e-3)  # the sampler's sRGB has eight bits
    assert centre_of(frame, "color") == pytest.approx(255 * linear_to_srgb(expected), abs=1.0)


# --- Normal maps ---

TEXEL = 200, 90, 230, 255
SCALE = 0.7


def leaning(tangent, bitangent, normal):
    """The unit normal that the texel stands for, by these axes."""
    x, y, z = np.array(TEXEL[:3]) / 255 * 2 - 1
    leant = SCALE * x * np.array(tangent) + SCALE * y * np.array(bitangent) + z * np.array(normal)
    return leant / np.linalg.norm(leant)


def bumpy(changes=None, coordinates=0, double_sided=False, metallic=0.5):
    """The wall at y = 10, whose texture runs along +X and +Z, with a normal map."""
    plain = wall()
    arrays = {"texcoords": plain.texcoords} | (changes or {})
    geom = Geom(plain.vertices, plain.triangles, plain.normals, **arrays)
    material = Material("bumpy", metallic=metallic, double_sided=double_sided)
    material.normal_texture, material.normal_scale = image(*TEXEL), SCALE
    material.normal_texcoord = coordinates
    scene = wall_scene()
    scene.root.find("wall").node().geoms[:] = [(geom, material)]
    return scene


RIGHT, ABOVE, FRONT = (1, 0, 0), (0, 0, 1), (0, -1, 0)
LEFT, BACK = (-1, 0, 0), (0, 1, 0)


def normal_of(render, scene):
    frame = render(scene, Settings(normal_format="rgba32f"), (9, 9), ("normal_world",))
    return centre_of(frame, "normal_world")


@pytest.mark.parametrize("metallic", [None, 0.5])
def test_tangents_are_made_along_the_texture(render, metallic):
    expected = leaning(RIGHT, ABOVE, FRONT)
    assert normal_of(render, bumpy(metallic=metallic)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_given_tangents_count_and_their_sign_turns_the_bitangent(render, side):
    """The bitangent is w cross(N, T); a tangent need not be a unit vector."""
    tangent = np.array([np.cos(0.5), 0.0, np.sin(0.5)])
    given = np.tile([*(3.0 * tangent), side], (4, 1))
    expected = leaning(tangent, side * np.cross(FRONT, tangent), FRONT)
    assert normal_of(render, bumpy({"tangents": given})) == pytest.approx(expected, abs=1e-6)


def test_tangents_follow_the_second_texture_coordinates(render):
    x, z = wall().texcoords.T
    scene = bumpy({"texcoords_1": np.stack([z, -x], axis=1)}, coordinates=1)
    assert normal_of(render, scene) == pytest.approx(leaning(ABOVE, LEFT, FRONT), abs=1e-6)


@pytest.mark.parametrize("given", [False, True])
def test_a_mirrored_instance_is_the_mirror_image(render, given):
    tangents = {"tangents": np.tile([1.0, 0.0, 0.0, 1.0], (4, 1))} if given else None
    scene = bumpy(tangents)
    scene.root.find("wall").set_scale(-1, 1, 1)
    assert normal_of(render, scene) == pytest.approx(leaning(LEFT, ABOVE, FRONT), abs=1e-6)
    scene.root.find("wall").set_scale(1, 1, -2)
    expected = leaning(RIGHT, (0, 0, -1), FRONT)
    assert normal_of(render, scene) == pytest.approx(expected, abs=1e-6)


def test_the_back_of_a_two_sided_surface_leans_the_other_way(render):
    scene = bumpy(double_sided=True)
    scene.root.find("wall").set_h(180)
    assert normal_of(render, scene) == pytest.approx(-leaning(LEFT, ABOVE, BACK), abs=1e-6)


def test_without_texture_coordinates_the_tangent_is_any_at_a_right_angle(render):
    """The map's slope is kept, its direction is not known."""
    normal = normal_of(render, bumpy({"texcoords": None}))
    assert normal @ FRONT == pytest.approx(leaning(RIGHT, ABOVE, FRONT) @ FRONT, abs=1e-6)


def test_normal_mapped_pixels_are_the_rasterizers_whatever_the_interpolation(render):
    scene = bumpy()
    one, other = (
        render(scene, Settings(interpolation=each), (9, 9), ("normal",)).normal
        for each in ("rasterizer", "float64")
    )
    assert (one == other).all()

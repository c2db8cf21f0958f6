"""The look "pyrender": its formula for metallic-roughness surfaces, against float64 and in closed form."""

import numpy as np
import pytest

from firefly_sample.errors import SettingsError
from firefly_sample.lab.reference.cache import reference_frame
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer, make_renderer
from tests.interop.pyrender_twin import PYRENDER, Lamp, Lighting, Surface, radiance
from tests.lab.test_metallic_frames import metal_scene, noise
from tests.lit_scenes import lit_scene
from tests.passes.test_metallic import BOUND, SIZE, apart, centre_of, field, image, whole_codes
from tests.reference import BOUNDS, compare
from tests.scenes import ball, geom_node, wall, wall_scene
from tests.unit.test_plan import cost

LOOK = Settings(look="pyrender", cutoff_budget=0.0)
EXACT = LOOK.with_changes(albedo_format="rgba32f", normal_format="rgba32f")
METHODS = ("volumes", "clustered", "fullscreen", "loop")


def colored(geom, color):
    """The geom with one vertex colour."""
    arrays = {"colors": np.tile(color, (len(geom.vertices), 1)), "texcoords": geom.texcoords}
    return Geom(geom.vertices, geom.triangles, geom.normals, **arrays)


def tinted_field(**kind):
    """The field of test_metallic, some of whose balls have vertex colours, emission and occlusion."""
    scene, rng = field(**kind), np.random.default_rng(4)
    for row in range(3):
        for column in range(7):
            node = scene.root.find(f"{row} {column}").node()
            ((geom, material),) = node.geoms
            if column % 2:
                geom = colored(geom, (*rng.uniform(0.2, 1.0, 3), 1.0))
            if column % 3 == row:
                material.occlusion_texture = image(int(rng.integers(40, 250)), 9, 9, 255)
                material.set_emission(tuple(rng.uniform(0.0, 0.5, 3)))
            node.geoms[:] = [(geom, material)]
    return scene


def compared_field(settings, **kind):
    """The frame of the field against float64, and the pixels' differences."""
    compared = compare(tinted_field(**kind), settings, SIZE)
    assert compared.plan.target("tint") is not None
    assert compared.chosen.sum() >= 0.95 * compared.covered.sum()
    different = apart(compared.frame.radiance, compared.expected, compared.gbuffer, compared.covered)
    return compared, different[compared.chosen]


# --- Against the reference ---


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_500_lights_by_each_method_are_what_float64_says(method, orthographic):
    settings = LOOK.with_changes(light_method=method)
    compared, different = compared_field(settings, orthographic=orthographic)
    assert compared.plan.light_method.name == method
    assert different.max() <= BOUND
    assert compared.error("light") <= BOUNDS["linear32f"]


@pytest.mark.parametrize(
    ("method", "coarser"),
    [("depth32f", 1), ("stored32f", 1), ("stored16f", 1), ("depth24", 30), ("depth16", 30)],
)
def test_from_every_position_method(method, coarser):
    _, different = compared_field(LOOK.with_changes(position_method=method))
    assert different.max() <= coarser * BOUND


@pytest.mark.parametrize("orthographic", [False, True])
def test_forward_shading_is_the_same_light(orthographic):
    """Nothing is rounded for a G-buffer there, so that normals differ in their last digit."""
    compared, _ = compared_field(EXACT, orthographic=orthographic)
    with borrow_renderer(SIZE, EXACT.with_changes(light_method="forward")) as renderer:
        drawn = renderer.render(tinted_field(orthographic=orthographic), outputs=("radiance",)).radiance
    different = apart(drawn, compared.expected, compared.gbuffer, compared.covered)[compared.chosen]
    assert different.max() <= 3 * BOUND


def test_a_frame_with_every_map_is_its_reference(tmp_path):
    """Normals of normal maps, and texels but those of occlusion, are those that the GPU samples."""
    scene = metal_scene(minfilter="nearest", magfilter="nearest")
    with make_renderer((160, 120), EXACT) as renderer:
        reference = reference_frame(renderer, scene, folder=tmp_path)
        frame = renderer.render(scene, outputs=("radiance",))
    different = np.abs(frame["radiance"] - reference.radiance).max(axis=-1)
    assert np.percentile(different / np.percentile(reference.radiance, 99.9), 99.9) <= 1e-5


def test_surfaces_are_those_of_the_reference():
    """Of a ball with every map, of nearest texels, whose filtering has no error."""
    scene = metal_scene(minfilter="nearest", magfilter="nearest")
    node = scene.root.find("**/brass").node()
    ((geom, material),) = node.geoms
    material.set_emission((0.3, 0.5, 0.7))
    material.emission_texture = noise(8, 50, minfilter="nearest", magfilter="nearest")
    arrays = {"texcoords": geom.texcoords, "texcoords_1": geom.texcoords_1, "tangents": geom.tangents}
    colors = np.random.default_rng(1).uniform(0.2, 1.0, geom.vertices.shape)
    node.geoms[:] = [(Geom(geom.vertices, geom.triangles, geom.normals, colors=colors, **arrays), material)]
    with make_renderer((160, 120), EXACT) as renderer:
        visibility = renderer.render(scene, outputs=("visibility",)).visibility
        plan = renderer.plan(scene, 0.0, ("albedo", "normal", "metallic", "radiance", "emission"))
        frame = renderer.draw(plan)
        surface = renderer.surface(plan)
        drawn, ambient, tint = surface.gbuffer(), surface.ambient_albedo(), surface.tint()
    seen = see_surfaces(plan, visibility)
    inside = (seen.tint != 1.0).any(axis=-1)  # the ball that has everything
    assert inside.sum() > 200
    pairs = {
        "normal": (drawn.normal, seen.gbuffer.normal),
        "metallic": (drawn.metallic, seen.gbuffer.metallic),
        "albedo": (drawn.albedo, seen.gbuffer.albedo),
        "ambient": (ambient, seen.ambient_albedo),
        "tint": (tint, seen.tint),
        "emission": (frame["emission"], seen.emission),
    }
    for name, (one, other) in pairs.items():
        different = np.abs(one - other).reshape(*inside.shape, -1).max(axis=-1)[inside]
        # half a code of sixteen bits is 7.6e-6; a tangent is the difference of float32 positions
        assert different.max() <= 2e-5, name


def test_in_shadow():
    """A shadow takes all of a light, also what reaches surfaces that face away."""
    scene = field()
    scene.root.find("lights").detach_node()
    scene.root.find("sun").node().set_shadow_caster(True, 256)
    compared = compare(scene, LOOK, SIZE, shadows=True)
    different = apart(compared.frame.radiance, compared.expected, compared.gbuffer, compared.covered)
    # at a shadow's edge, a texel may be on the other side of the comparison
    assert np.percentile(different[compared.chosen], 99) <= BOUND


def test_the_dark_side_of_a_ball_is_in_its_own_shadow(render):
    """Its middle, which the ball's shadow map certainly covers; without shadows it has light."""
    scene = Scene()
    scene.root.attach_new_node(geom_node("ball", ball(), Material("ball", metallic=0.0))).set_pos(0, 10, 0)
    sun = DirectionalLight("sun", (5.0, 5.0, 5.0))
    sun.set_direction((0.3, -1.0, 0.2))
    scene.root.attach_new_node(sun)
    assert centre_of(render(scene, LOOK, (33, 33), ("radiance",))).min() > 1e-3
    for taps in (1, 4, 16):
        sun.set_shadow_caster(True, 128)
        frame = render(scene, LOOK.with_changes(shadow_taps=taps), (33, 33), ("radiance",))
        assert centre_of(frame).max() == 0.0


# --- Blended ---


@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
@pytest.mark.parametrize("orthographic", [False, True])
def test_blended_surfaces_are_what_float64_says(tmp_path, method, orthographic):
    """One layer at a pixel, whose weight does not count, behind the field's balls and before its floor."""
    scene = tinted_field(orthographic=orthographic)
    scene.root.find("lights").detach_node()
    looks = {"metallic": 0.3, "roughness": 0.4, "emission": (0.3, 0.2, 0.5), "double_sided": True}
    for index, turn in enumerate((20.0, 200.0)):
        shape = colored(wall(1.6, 4), (0.9, 0.5, 0.7, 0.8))
        pane = Material(f"pane {index}", (0.5, 0.8, 0.9, 0.6), alpha_mode="blend", **looks)
        pane.normal_texture = image(180, 150, 220, 255)
        path = scene.root.attach_new_node(geom_node(pane.name, shape, pane))
        path.set_pos_hpr(3.0 * index - 1.5, 7.5, 0.5, turn, 0.0, 0.0)
    with make_renderer(SIZE, EXACT.with_changes(transparency=method)) as renderer:
        reference = reference_frame(renderer, scene, folder=tmp_path)
        frame = renderer.render(scene, outputs=("radiance", "color"))
        scene.root.find("pane 0").hide()
        scene.root.find("pane 1").hide()
        before = renderer.render(scene, outputs=("radiance",)).radiance
    panes = (before != frame.radiance).any(axis=-1)
    bright = reference.radiance.max(axis=-1) <= 1.0  # mixed values of the display end at 1
    different = np.abs(frame.radiance - reference.radiance).max(axis=-1)
    assert (panes & bright).sum() > 200
    assert np.percentile(different[bright & panes], 99) <= 2e-5
    assert np.abs(frame.color.astype(int) - reference.color)[panes].max() <= 1


# --- Values that are known ---


def twin_of(normal, to_eye, lamp, position=(0.0, 10.0, 0.0), **material):
    """The radiance of one pixel by the tests' own twin of pyrender's shader."""
    given = {"base": (0.9, 0.5, 0.1), "metallic": 0.0, "roughness": 1.0, "occlusion": 1.0} | material
    rows = {name: np.array([value], dtype=np.float64) for name, value in given.items()}
    nothing = {"emission": np.zeros((1, 3)), "tint": np.ones((1, 3))}
    vectors = (np.array([vector], dtype=np.float64) for vector in (position, normal, to_eye))
    return radiance(Surface(*vectors, **(nothing | rows)), Lighting([lamp]), PYRENDER)[0]


@pytest.mark.parametrize("metallic", [0.0, 0.25, 1.0])
@pytest.mark.parametrize("roughness", [0.01, 0.2, 1.0])
def test_light_from_the_eye(render, metallic, roughness):
    """Then D is 1/(pi alpha^2), F is F0, and G is 1; 0.001 is added to 4, and roughness is 0.04 at least."""
    base = np.array([0.9, 0.5, 0.1])
    roughness, metallic = whole_codes(roughness, metallic)
    scene = wall_scene(material=Material("m", (*base, 1.0), metallic=metallic, roughness=roughness))
    lamp = PointLight("lamp", (30.0, 20.0, 10.0))
    lamp.set_attenuation((0, 0, 1))
    scene.root.attach_new_node(lamp)
    f0 = 0.04 + (base - 0.04) * metallic
    matt = (1.0 - f0) * 0.96 * base * (1.0 - metallic)
    expected = (0.3, 0.2, 0.1) * (matt + f0 / (4.001 * max(roughness, 0.04) ** 4))
    frame = render(scene, EXACT, (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("method", [*METHODS, "forward"])
def test_a_light_also_reaches_a_surface_that_faces_away(render, method):
    """By a cosine of 0.001, through every method; a Phong surface beside it gets nothing."""
    scene = wall_scene(material=Material("m", (0.9, 0.5, 0.1, 1.0), metallic=0.0, roughness=1.0))
    lamp = PointLight("lamp", (9.0, 8.0, 7.0))
    lamp.set_attenuation((0, 0, 1))
    scene.root.attach_new_node(lamp).set_pos(0.3, 10.5, 0.0)
    place = {"position": np.array([0.3, 10.5, 0.0])}
    expected = twin_of((0, -1, 0), (0, -1, 0), Lamp(np.pi * np.array([9.0, 8.0, 7.0]), **place))
    settings = EXACT.with_changes(light_method=method, cutoff_budget=Settings().cutoff_budget)
    assert expected.min() > 1e-3
    assert centre_of(render(scene, settings, (9, 9), ("radiance",))) == pytest.approx(expected, rel=1e-5)
    scene.root.find("wall").set_material(Material("phong", specular=(1, 1, 1)))
    assert render(scene, settings, (9, 9), ("radiance",)).radiance.max() == 0.0


def test_the_back_keeps_the_normal_of_the_front(render):
    """Seen from behind, the sun behind the wall lights it fully, and the one beside the eye hardly."""
    material = Material("m", (0.9, 0.5, 0.1, 1.0), metallic=0.3, roughness=0.5, double_sided=True)
    scene = wall_scene(material=material)
    scene.root.find("wall").set_h(180)
    sun = DirectionalLight("sun")
    scene.root.attach_new_node(sun)
    found = []
    for direction in ((0.6, -0.8, 0.0), (0.6, 0.8, 0.0)):
        sun.set_direction(direction)
        found.append(centre_of(render(scene, EXACT, (9, 9), ("radiance",))))
        lamp = Lamp(np.full(3, np.pi), direction=np.array(direction))
        expected = twin_of((0, 1, 0), (0, -1, 0), lamp, metallic=0.3, roughness=0.5)
        assert found[-1] == pytest.approx(expected, rel=1e-4)
    assert found[0].min() > 50 * found[1].max()


def test_a_normal_without_length_faces_the_camera(render):
    """Through an orthographic lens as well, whose rays meet in its position."""
    scene = wall_scene(material=Material("m", metallic=0.0, roughness=0.7))
    ((geom, material),) = scene.root.find("wall").node().geoms
    bare = Geom(geom.vertices, geom.triangles, np.zeros_like(geom.vertices), geom.texcoords)
    scene.root.find("wall").node().geoms[:] = [(bare, material)]
    scene.camera.node().lens = OrthographicLens(film_size=(16, 12), near=1, far=100)
    frame = render(scene, EXACT, (16, 12), ("normal", "position"))
    to_eye = -frame.position / np.linalg.norm(frame.position, axis=-1, keepdims=True)
    assert frame.normal == pytest.approx(to_eye, abs=1e-6)


# --- Vertex colours, occlusion, emission, ambient light ---


def shown(render, colors=None, settings=EXACT, **material):
    """The middle of a wall of a metallic-roughness material under a sun and a sky."""
    given = {"metallic": 0.4, "roughness": 0.3} | material
    scene = wall_scene(material=Material("m", (0.9, 0.5, 0.1, 1.0), **given))
    node = scene.root.find("wall").node()
    if colors is not None:
        node.geoms[:] = [(colored(geom, colors), each) for geom, each in node.geoms]
    scene.root.attach_new_node(AmbientLight("sky", (0.3, 0.2, 0.1)))
    sun = DirectionalLight("sun", (2.0, 1.5, 1.0))
    sun.set_direction((0.2, 1.0, -0.1))
    scene.root.attach_new_node(sun)
    return centre_of(render(scene, settings, (9, 9), ("radiance",)))


@pytest.mark.parametrize("method", ["auto", "forward"])
def test_vertex_colours_multiply_all_that_is_seen(render, method):
    settings = EXACT.with_changes(light_method=method)
    plain = shown(render, settings=settings, emission=(0.5, 0.4, 0.3))
    tint = np.array([0.25, 0.5, 0.75])
    tinted = shown(render, (*tint, 1.0), settings, emission=(0.5, 0.4, 0.3))
    assert tinted == pytest.approx(tint * plain, rel=1e-6)


@pytest.mark.parametrize("method", ["auto", "forward"])
def test_occlusion_multiplies_all_light_but_emission(render, method):
    settings = EXACT.with_changes(light_method=method)
    glow = np.array([0.5, 0.4, 0.3])
    reflected = shown(render, settings=settings)
    occluded = shown(render, None, settings, occlusion_texture=image(51, 200, 200, 255), emission=tuple(glow))
    assert occluded == pytest.approx(0.2 * reflected + glow**2, rel=1e-6)


def test_an_emissive_factor_is_squared_and_its_texture_is_not(render):
    emission = {"emission": (0.5, 0.4, 0.3), "emission_texture": image(255, 0, 255, 255)}
    assert shown(render, **emission) - shown(render) == pytest.approx([0.25, 0.0, 0.09], abs=1e-6)


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_ambient_light_is_multiplied_by_the_base_colour_of_metals_too(render, metallic):
    scene = wall_scene(material=Material("m", (0.9, 0.5, 0.1, 1.0), metallic=metallic))
    scene.root.attach_new_node(AmbientLight("sky", (0.3, 0.6, 1.2)))
    frame = render(scene, EXACT, (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx([0.27, 0.3, 0.12], rel=1e-6)


# --- Spotlights ---


@pytest.mark.parametrize(("inner", "outer"), [(10.0, 20.0), (20.0, 20.0), (0.0, 3.0), (2.0, 2.0)])
def test_a_spotlights_edge_is_the_square_of_a_ramp(render, inner, outer):
    """The ramp is 0.001 wide at least: a spotlight of 2 degrees is nowhere as bright as it says."""
    scene = wall_scene(material=Material("m", (0.9, 0.5, 0.1, 1.0)))  # matt, of no model of pyrender's
    spot = Spotlight("spot", (1.0, 1.0, 1.0))
    spot.set_cone(inner, outer)
    scene.root.attach_new_node(spot)
    scene.camera.node().lens.set_fov(2.2 * max(outer, 3.0))
    frame = render(scene, EXACT, (81, 81), ("light", "position"))
    cosine = frame.position[..., 1] / np.linalg.norm(frame.position.astype(np.float64), axis=-1)
    ends = np.cos(np.radians([inner, outer]))
    ramp = np.clip((cosine - ends[1]) / max(0.001, ends[0] - ends[1]), 0.0, 1.0)
    assert frame.light[..., 0] == pytest.approx(cosine * ramp**2, abs=2e-4)
    assert ((ramp > 0.1) & (ramp < 0.9)).any()
    assert outer > 2.0 or ramp.max() < 0.7


# --- The cut-off of lights ---


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_cut_off_drops_no_more_than_the_budget(side):
    """Far lights on both sides of a surface, and of its back, which they reach as well."""
    white = Material("white", (1.0, 1.0, 1.0, 1.0), metallic=0.5, roughness=0.5, double_sided=True)
    scene = wall_scene(material=white)
    scene.root.find("wall").set_h(0 if side > 0 else 180)
    places = np.random.default_rng(0).uniform((-60, -60, -60), (60, 80, 60), (30, 3))
    scene.root.attach_new_node(PointLights("far", places, (0.5, 0.4, 0.3), attenuation=(1, 0.5, 3.0)))
    settings = Settings(look="pyrender", cutoff_budget=1e-2)
    with borrow_renderer(SIZE, settings) as renderer:
        assert np.isfinite(renderer.plan(scene).lights[0].reaches).all()
        cut = renderer.render(scene, outputs=("radiance",)).radiance
        renderer.settings = LOOK
        whole = renderer.render(scene, outputs=("radiance",)).radiance
    dropped = np.abs(whole - cut).max()
    assert 2e-5 < dropped <= 1e-2 + 1e-6 * whole.max()


# --- Surfaces of other models ---


@pytest.mark.parametrize("orthographic", [False, True])
def test_phong_and_unlit_surfaces_are_as_in_the_look_correct(render, orthographic):
    """Beside a metal, with colours for ambient light, vertex colours, emission and a back that is seen."""
    scene = lit_scene(("ramp", "attenuated", "sun"), "everything", orthographic=orthographic)
    metal = colored(ball(0.6), (0.4, 0.9, 0.5, 1.0))
    node = geom_node("metal", metal, Material("metal", metallic=0.8, roughness=0.3))
    scene.root.attach_new_node(node).set_pos(0.0, 8.0, -0.4)
    back = Material("back", specular=(0.5, 0.5, 0.5), shininess=9.0, double_sided=True)
    back.occlusion_texture = image(90, 9, 9, 255)
    cards = (back, 160.0), (Material("sign", (0.2, 0.9, 0.4, 1.0), unlit=True), 0.0)
    for index, (material, turn) in enumerate(cards):
        path = scene.root.attach_new_node(
            geom_node(material.name, colored(wall(1.5), (0.9, 0.6, 0.3, 1.0)), material)
        )
        path.set_pos_hpr(4.0 * index - 2.0, 7.0, 1.0, turn, 0.0, 0.0)
    alike = render(scene, EXACT, (96, 72), ("radiance",))
    correct = render(scene, EXACT.with_changes(look="correct"), (96, 72), ("radiance",))
    seen = render(scene, EXACT, (96, 72), ("id",))
    names = np.array([*seen.id_names, "nothing"])[seen.id]
    others = ~np.char.endswith(names, "metal")
    apart_by = np.abs(alike.radiance - correct.radiance).max(axis=-1)
    assert apart_by[others].max() <= 1e-6 * np.percentile(correct.radiance, 99.9)
    assert np.median(apart_by[~others]) > 1e-3
    assert (~others).sum() > 30


# --- What it costs, and what it allows ---


def test_only_metals_with_vertex_colours_or_occlusion_cost_a_target():
    settings = Settings(look="pyrender")
    scene = wall_scene(material=Material("m", metallic=0.5, roughness=0.4))
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    base = {"depth": 4, "albedo": 4, "color": 4, "radiance": 16}
    assert cost(scene, settings) == (["geometry", "ambient", "resolve"], base)
    sun = scene.root.attach_new_node(DirectionalLight("sun"))
    lit = base | {"normal": 4, "metallic_roughness": 4}
    passes = ["geometry", "ambient", "directional_lights", "resolve"]
    assert cost(scene, settings) == (passes, lit)
    # only where highlights see an orthographic camera in its position, a sun's light needs surfaces'
    before = scene.camera.node().lens
    scene.camera.node().lens = OrthographicLens(film_size=(16, 12), near=1, far=100)
    assert cost(scene, settings) == (passes, lit | {"distance": 4})
    assert "distance" not in cost(scene, Settings())[1]
    scene.camera.node().lens = before
    node = scene.root.find("wall").node()
    ((geom, material),) = node.geoms
    node.geoms[:] = [(colored(geom, (1, 0.5, 0.5, 1)), material)]
    assert cost(scene, settings) == (passes, lit | {"tint": 4})
    assert cost(scene, settings, ("normal",)) == (["geometry"], {"depth": 4, "albedo": 4, "normal": 4})
    assert "tint" not in cost(scene, Settings())[1]
    sun.detach_node()
    assert cost(scene, settings) == (["geometry", "ambient", "resolve"], base | {"tint": 4})
    node.geoms[:] = [(geom, Material("m", metallic=0.5, occlusion_texture=image(9, 9, 9, 255)))]
    assert cost(scene, settings) == (["geometry", "ambient", "resolve"], base | {"tint": 4})
    node.geoms[:] = [(colored(geom, (1, 0.5, 0.5, 1)), Material("phong"))]
    assert cost(scene, settings) == (["geometry", "ambient", "resolve"], base)


REFUSED = {
    "clamp_light": True,
    "light_resolution": "half",
    "interpolation": "float64",
    "tone": "exponential",
}


@pytest.mark.parametrize("name", REFUSED)
def test_it_refuses_what_pyrender_lacks(name):
    with pytest.raises(SettingsError, match=f"setting '{name}' must be .* with look=pyrender"):
        Settings(look="pyrender", **{name: REFUSED[name]})

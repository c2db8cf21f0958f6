"""One renderer, several frames: whatever changed, the next frame is what a fresh Renderer draws."""

import numpy as np
import pytest

from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.scenes import ball, ball_scene, geom_node, wall, wall_scene

SIZE = (48, 36)
SAMPLED = ("color", "albedo", "normal", "depth", "id")


def _pixels(seed=0):
    """Sixteen coloured squares, a part of them not there."""
    pixels = np.random.default_rng(seed).integers(0, 256, (4, 4, 4), dtype=np.uint8)
    return pixels.repeat(4, axis=0).repeat(4, axis=1)


class Stage:
    """A wall with a ball before it, a cut-out flag beside it, lights and a dot; every part at hand."""

    def __init__(self):
        self.scene = wall_scene()
        self.root = self.scene.root
        self.wall = self.root.find("wall")
        self.clay = Material("clay", (0.8, 0.5, 0.3, 1))
        self.ball_geom = ball(1.0, 2)
        self.ball = self.root.attach_new_node(geom_node("ball", self.ball_geom, self.clay))
        self.ball.set_pos(-2, 7, 0)
        self.texture = Texture(_pixels())
        self.flag_geom = wall(3.0, 2)
        flag = Material("flag", texture=self.texture, alpha_mode="mask", double_sided=True)
        self.flag = self.root.attach_new_node(geom_node("flag", self.flag_geom, flag))
        self.flag.set_pos(2, 7, 0)
        self.lights = PointLights("lights", [(0, 5, 1), (-3, 6, -1)], [(1, 1, 0.5), (0, 1, 1)], 6.0)
        self.root.attach_new_node(self.lights)
        self.ambient = AmbientLight("sky", (0.1, 0.1, 0.2))
        self.root.attach_new_node(self.ambient)
        self.lamp = PointLight("lamp", (0.2, 0.3, 0.2))
        self.lamp_path = self.root.attach_new_node(self.lamp)
        self.lamp_path.set_pos(1, 4, 1)
        self.spot = Spotlight("spot", (0.5, 0.2, 0.5), 14.0)
        self.spot.set_shadow_caster(True, 64)
        self.spot_path = self.root.attach_new_node(self.spot)
        self.spot_path.set_pos_hpr(-1, 2, 2, -5, -10, 0)
        self.sun = DirectionalLight("sun", (0.2, 0.2, 0.1))
        self.sun.set_shadow_caster(True, 64)
        self.sun_path = self.root.attach_new_node(self.sun)
        self.sun_path.set_hpr(20, -30, 0)
        self.dots = Sprites("dots", [(0, 6, -1)], (1, 0, 1), 0.5)
        self.root.attach_new_node(self.dots)

    def vertices(self):
        self.ball_geom.set_vertices(self.ball_geom.vertices * (1.5, 1, 0.5))

    def vertices_far_off(self):
        """Beyond the old bounding sphere: culling must hear of it."""
        self.ball_geom.set_vertices(self.ball_geom.vertices + np.array([4, 0, 0]))

    def normals(self):
        self.ball_geom.set_normals(np.tile([0.0, 0.0, 1.0], (len(self.ball_geom.vertices), 1)))

    def colors(self):
        self.ball_geom.set_colors(np.tile([0.1, 1.0, 0.4], (len(self.ball_geom.vertices), 1)))

    def pixels(self):
        self.texture.set_pixels(_pixels(1))

    def base_color(self):
        self.clay.set_base_color((0.1, 0.9, 0.2, 1))

    def material(self):
        self.ball.set_material(Material("other", (0.2, 0.2, 0.9, 1)))

    def textured_material(self):
        self.wall.set_material(Material("other", texture=Texture(_pixels(2))))

    def color(self):
        self.ball.set_color((0.2, 0.9, 0.9, 1))

    def hiding(self):
        self.ball.hide()

    def detaching(self):
        self.flag.detach_node()

    def moving(self):
        self.ball.set_pos(0, 6, 0.5)

    def mirroring(self):
        self.flag.set_scale(-1, 1, 1)

    def one_more(self):
        self.ball.copy_to(self.root).set_pos(1, 6, 1)

    def one_more_geom(self):
        self.ball.node().add_geom(wall(2.5), self.clay)

    def light_arrays(self):
        self.lights.set_arrays([(1, 5, 1)] * 40, (0.1, 0.05, 0), 5.0)

    def specular_colors(self):
        self.lights.set_specular_colors((0, 1, 0))
        self.clay.set_specular((0.5, 0.5, 0.5))

    def specular(self):
        self.clay.set_specular((0.3, 0.4, 0.5))
        self.clay.set_shininess(5.0)

    def emission(self):
        self.clay.set_emission((0.1, 0.0, 0.4))

    def ambient_of_a_material(self):
        self.clay.set_ambient((0.1, 0.1, 1.0))

    def texture_of_a_material(self):
        self.clay.texture = self.texture

    def sidedness(self):
        self.clay.double_sided = True
        self.ball_geom.set_vertices(-self.ball_geom.vertices)  # inside out: now its back is seen

    def attenuation(self):
        self.lamp.set_attenuation((1, 0, 1))

    def max_distance(self):
        self.lamp.set_max_distance(5.0)

    def radius(self):
        self.lamp.set_radius(6.0)

    def color_of_a_light(self):
        self.lamp.set_color((0.1, 0.9, 0.1))

    def lamp_casts(self):
        self.lamp.set_shadow_caster(True, 32)

    def cone(self):
        self.spot.set_cone(5, 25)

    def cones_lens(self):
        self.spot.get_lens().set_fov(12)

    def exponent(self):
        self.spot.set_exponent(1.0)

    def spot_moves(self):
        self.spot_path.set_x(0.5)

    def resolution(self):
        self.spot.set_shadow_caster(True, 16)

    def no_shadow(self):
        self.spot.set_shadow_caster(False)

    def sun_turns(self):
        self.sun_path.set_h(-20)

    def suns_direction(self):
        self.sun.set_direction((0.2, 1, 0.1))

    def suns_shadow_distance(self):
        self.sun.set_shadow_distance(4.0)

    def sun_sets(self):
        self.sun_path.hide()

    def mask_of_a_light(self):
        self.ball.hide(0b1000)
        self.scene.camera.node().camera_mask = 0b1
        self.spot.camera_mask = 0b1000

    def a_caster_out_of_sight(self):
        self.root.attach_new_node(geom_node("above", wall(3.0))).set_pos_hpr(-2, 1, 6, 0, -60, 0)

    def cut_off_of_a_caster(self):
        self.flag.node().geoms[0][1].alpha_cutoff = 0.9

    def ambient_color(self):
        self.ambient.set_color((0.5, 0.1, 0.1))

    def dot_arrays(self):
        self.dots.set_arrays([(1, 6, 1), (-1, 6, -1)], (0, 1, 0), 0.75)

    def camera(self):
        self.scene.camera.set_pos(1, 1, 0)
        self.scene.camera.set_hpr(5, -3, 4)

    def lens(self):
        self.scene.camera.node().lens = PerspectiveLens(vfov=40, near=0.5, far=50)

    def orthographic_lens(self):
        self.scene.camera.node().lens = OrthographicLens(film_height=8, near=1, far=50)

    def exposure(self):
        self.scene.exposure = 3.0

    def background(self):
        self.wall.hide()
        self.scene.background = (0.2, 0.1, 0.4)


CHANGES = [name for name in vars(Stage) if not name.startswith("_")]


def draw(renderer, scene):
    outputs = SAMPLED if renderer.settings.supersample == 1 else ("color",)
    return {name: image.copy() for name, image in renderer.render(scene, 0.0, outputs).images.items()}


def same(a, b):
    return a.keys() == b.keys() and all(
        a[name].shape == b[name].shape and a[name].tobytes() == b[name].tobytes() for name in a
    )


def assert_as_fresh(renderer, scene):
    """The next frame equals a fresh Renderer's, byte for byte; gives its images."""
    images = draw(renderer, scene)
    with make_renderer(renderer.size, renderer.settings) as fresh:
        expected = draw(fresh, scene)
    stale = [name for name in images if images[name].tobytes() != expected[name].tobytes()]
    assert not stale
    assert same(images, expected)
    return images


@pytest.fixture(scope="module")
def renderer():
    """One for many tests: what others had it draw before must not show either."""
    with make_renderer(SIZE) as made:
        yield made


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_reaches_the_next_frame(renderer, change):
    stage = Stage()
    before = draw(renderer, stage.scene)
    getattr(stage, change)()
    after = assert_as_fresh(renderer, stage.scene)
    assert not same(before, after)
    assert same(after, draw(renderer, stage.scene))


def test_all_changes_one_after_another():
    stage = Stage()
    changes = ("pixels", "colors", "normals", "base_color", "vertices", "moving", "mirroring", "lens")
    with make_renderer(SIZE) as renderer:
        before = draw(renderer, stage.scene)
        for change in changes:
            getattr(stage, change)()
            after = draw(renderer, stage.scene)
            assert not same(before, after), change
            before = after
        assert_as_fresh(renderer, stage.scene)


def test_what_is_set_back_is_drawn_as_before():
    stage = Stage()
    geom, vertices, normals = stage.ball_geom, stage.ball_geom.vertices, stage.ball_geom.normals
    undo = {
        "vertices": lambda: geom.set_vertices(vertices),
        "normals": lambda: geom.set_normals(normals),
        "colors": lambda: geom.set_colors(None),
        "pixels": lambda: stage.texture.set_pixels(_pixels()),
        "base_color": lambda: stage.clay.set_base_color((0.8, 0.5, 0.3, 1)),
        "material": stage.ball.clear_material,
        "color": stage.ball.clear_color,
        "hiding": stage.ball.show,
        "detaching": lambda: stage.flag.reparent_to(stage.root),
    }
    with make_renderer(SIZE) as renderer:
        before = {name: image for name, image in draw(renderer, stage.scene).items() if name != "id"}
        for change, back in undo.items():
            getattr(stage, change)()
            draw(renderer, stage.scene)
            back()
            after = {name: image for name, image in draw(renderer, stage.scene).items() if name != "id"}
            assert same(after, before), change


def test_geometry_that_moves_into_view_by_its_vertices_is_drawn():
    stage = Stage()
    stage.ball.set_pos(50, 7, 0)
    with make_renderer(SIZE) as renderer:
        assert (draw(renderer, stage.scene)["id"] != 1).all()
        stage.ball_geom.set_vertices(stage.ball_geom.vertices - (50, 0, 0))
        assert (assert_as_fresh(renderer, stage.scene)["id"] == 1).any()


def test_of_one_mesh_what_is_opaque_stays_in_the_ids_while_the_alpha_of_others_changes():
    """All three are marked for blending; ids are of the nearest opaque surface."""
    scene, geom = wall_scene(), ball(1.0, 2)
    panes = [Material(f"pane {i}", (0.5, 0.5, 0.5, 1), alpha_mode="blend") for i in range(3)]
    for i, material in enumerate(panes):
        path = scene.root.attach_new_node(geom_node(f"ball {i}", geom, material))
        path.set_pos(2.5 * i - 2.5, 7, 0)
    with make_renderer(SIZE) as renderer:
        before = assert_as_fresh(renderer, scene)
        assert np.unique(before["id"]).tolist() == [0, 1, 2, 3]
        panes[0].set_base_color((0.5, 0.5, 0.5, 0.5))
        scene.root.find("ball 2").set_color((1, 1, 1, 0.5))
        images = assert_as_fresh(renderer, scene)
        assert np.unique(images["id"]).tolist() == [0, 2]
        assert np.array_equal(images["id"] == 2, before["id"] == 2)
        panes[0].set_base_color((0.5, 0.5, 0.5, 1))
        scene.root.find("ball 2").clear_color()
        assert same(draw(renderer, scene), before)


def test_a_colour_of_vertices_reaches_every_instance_and_every_frame():
    stage = Stage()
    stage.one_more()
    with make_renderer(SIZE) as renderer:
        draw(renderer, stage.scene)
        for shade in (0.1, 0.5, 0.9):
            stage.ball_geom.set_colors(np.full((len(stage.ball_geom.vertices), 3), shade))
            images = assert_as_fresh(renderer, stage.scene)
            seen = images["albedo"][..., 0][np.isin(images["id"], (1, 3))]
            assert np.abs(seen - 0.8 * shade).max() <= 2 * 0.5 / 255


def test_a_texture_that_two_materials_share_changes_in_both():
    stage = Stage()
    stage.wall.set_material(Material("poster", texture=stage.texture))
    with make_renderer(SIZE) as renderer:
        draw(renderer, stage.scene)
        stage.texture.set_pixels(np.full((16, 16, 4), 255, dtype=np.uint8))
        albedo = assert_as_fresh(renderer, stage.scene)
        assert (albedo["albedo"][np.isin(albedo["id"], (0, 2))] == 1).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"position_method": "depth24"},
        {"position_method": "depth32f"},
        {"look": "classic"},
        {"supersample": 2},
        {"light_method": "loop"},
        {"light_method": "fullscreen"},
        {"volume_depth_test": False},
        {"exposure": 2.0},
        {"tone": "none"},
    ],
    ids=lambda changes: "-".join(map(str, next(iter(changes.items())))),
)
def test_settings_change_between_frames(renderer, changes):
    stage = Stage()
    before = draw(renderer, stage.scene)
    renderer.settings = Settings(**changes)
    try:
        assert_as_fresh(renderer, stage.scene)
    finally:
        renderer.settings = Settings()
    assert same(draw(renderer, stage.scene), before)


def test_size_changes_between_frames():
    stage = Stage()
    with make_renderer(SIZE) as renderer:
        before = draw(renderer, stage.scene)
        for size in ((64, 20), (17, 33), (1, 1)):
            renderer.resize(size)
            assert assert_as_fresh(renderer, stage.scene)["color"].shape[:2] == size[::-1]
        renderer.resize(SIZE)
        assert same(draw(renderer, stage.scene), before)


def test_another_scene_and_back():
    first, second, third = Stage().scene, ball_scene(20), Stage()
    third.pixels()
    with make_renderer(SIZE) as renderer:
        before = draw(renderer, first)
        assert not same(assert_as_fresh(renderer, second), before)
        assert not same(assert_as_fresh(renderer, third.scene), before)
        assert same(draw(renderer, first), before)


def _colored_geom():
    return Geom(wall().vertices, wall().triangles, wall().normals, wall().texcoords, np.ones((4, 3)))


@pytest.mark.parametrize("what", ["vertices", "normals", "colors", "triangles"])
def test_a_geoms_arrays_are_not_written_in_place(what):
    geom = _colored_geom()
    with pytest.raises(ValueError, match="read-only"):
        getattr(geom, what)[0, 0] = 1
    if what != "triangles":
        getattr(geom, f"set_{what}")(np.ones((4, 3)))
        with pytest.raises(ValueError, match="read-only"):
            getattr(geom, what)[0, 0] = 1


def test_a_textures_pixels_are_not_written_in_place():
    texture = Texture(_pixels())
    with pytest.raises(ValueError, match="read-only"):
        texture.pixels[0, 0, 0] = 1
    texture.set_pixels(_pixels(1))
    with pytest.raises(ValueError, match="read-only"):
        texture.pixels[0, 0, 0] = 1


def test_the_callers_own_arrays_stay_theirs():
    """Writeable as before, and what is written there later is nobody else's business."""
    pixels, vertices = _pixels(), np.array(wall().vertices)
    triangles = np.array(wall().triangles, dtype=np.int32)
    texture, geom = Texture(pixels), Geom(vertices, triangles)
    again = _pixels(1)
    for mine in (pixels, vertices, triangles):
        mine[:] = 0
    assert texture.pixels.any()
    assert geom.vertices.any()
    assert geom.triangles.any()
    texture.set_pixels(again)
    again[:] = 0
    assert texture.pixels.any()

"""Normals and distances found in float64: thin triangles against the reference, and what stays as it is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as search
from hypothesis import strategies as st

from firefly_sample.errors import SettingsError
from firefly_sample.gpu.corner_tables import CornerTables
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer, make_renderer
from tests.scenes import ball, ball_scene, geom_node, wall, wall_scene

SIZE = (96, 72)
OUTPUTS = ("visibility", "normal", "depth", "position")
FINE = {"normal_format": "rgba32f", "interpolation": "float64"}
LENSES = {
    "perspective": lambda: PerspectiveLens(vfov=60.0, near=0.5, far=100.0),
    "off centre": lambda: PerspectiveLens(vfov=60.0, near=0.5, far=100.0, film_offset=(0.2, -0.1)),
    "orthographic": lambda: OrthographicLens(film_size=(16.0, 12.0), near=0.5, far=100.0),
}


def float32(values):
    return np.asarray(values).astype(np.float32).astype(np.float64)


def slivers(rng, count=400, length=6.0, offset=0.0):
    """Thin triangles, each a step behind the last: heights of 5 to 1/2000 of a pixel."""
    start = np.stack([rng.uniform(-9, 9, count), np.linspace(0, 4, count), rng.uniform(-7, 7, count)], axis=1)
    angle = rng.uniform(0, 2 * np.pi, count)
    along = length * np.stack([np.cos(angle), rng.uniform(-0.5, 0.5, count), np.sin(angle)], axis=1)
    thickness = 10.0 ** rng.uniform(-4, 0, (count, 1))
    aside = thickness * np.stack([-np.sin(angle), rng.uniform(-1, 1, count), np.cos(angle)], axis=1)
    vertices = np.stack([start, start + along, start + 0.5 * along + aside], axis=1).reshape(-1, 3)
    normals = rng.normal(size=vertices.shape) - np.array((0.0, 2.0, 0.0))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Geom(vertices + offset, np.arange(3 * count).reshape(-1, 3), normals, name="slivers")


def attach(scene, node, place, hpr=(0, 0, 0), scale=(1, 1, 1)):
    """A place of its own for a node that may have others."""
    path = scene.root.attach_new_node("place")
    path.set_pos_hpr(*place, *hpr)
    path.set_scale(*scale)
    path.attach_new_node(node)
    return path


def sliver_scene(seed, lens="perspective"):
    """Slivers, mirrored ones, far-off ones of a mesh far from its origin, a ball, and a crowd of balls."""
    rng = np.random.default_rng(seed)
    scene = Scene()
    paper = Material("paper", (0.5, 0.5, 0.5, 1), double_sided=True)
    node = geom_node("slivers", slivers(rng), paper)
    attach(scene, node, (0, 12, 0))
    attach(scene, node, (1, 20, 1), (20, 10, 5), (-1.5, 1.5, 2.0))
    attach(scene, geom_node("ball", ball(0.7, 4)), (2, 9, 1))
    baked = attach(
        scene, geom_node("baked", slivers(rng, 300, offset=500.0), paper), (0, 60, 0), scale=(4, 1, 4)
    )
    baked.set_pos(-2000, -440, -2000)
    crowd = geom_node("crowd", ball(0.2, 1))
    for place in rng.uniform((-20, 40, -15), (20, 60, 15), (500, 3)):
        attach(scene, crowd, place)
    scene.camera.set_hpr(3, -2, 1)
    scene.camera.node().lens = LENSES[lens]()
    return scene


def errors(scene, settings, size=SIZE):
    """How far normals, and places over their distance, are from the reference, where there is a surface."""
    with borrow_renderer(size, settings) as renderer:
        plan = renderer.plan(scene, 0.0, OUTPUTS)
        frame = renderer.draw(plan)
    found, rays = see_surfaces(plan, frame["visibility"]), pixel_rays(plan.view)
    distance = found.gbuffer.position[..., 1:2]
    on_ray = rays.origin.reshape(*size[::-1], 3) + distance * rays.direction.reshape(*size[::-1], 3)
    normal = np.linalg.norm(frame["normal"] - found.gbuffer.normal, axis=-1)
    place = np.abs(frame["position"] - on_ray).max(axis=-1) / distance[..., 0]
    return normal[found.covered], place[found.covered]


@search(max_examples=12)
@given(seed=st.integers(0, 2**32 - 1), lens=st.sampled_from(sorted(LENSES)))
def test_thin_triangles_have_the_normals_and_distances_that_they_must_have(seed, lens):
    scene = sliver_scene(seed, lens)
    normal, distance = errors(scene, Settings(**FINE))
    assert len(normal) > 300
    assert normal.max() <= 1e-6
    assert distance.max() <= 5e-7


def test_a_rasterizer_is_far_off_there():
    """Or else the test above tells nothing."""
    normal, _ = errors(sliver_scene(1), Settings(normal_format="rgba32f"))
    assert normal.max() > 1e-2


@pytest.mark.parametrize("position", ["linear32f", "stored32f", "depth32f"])
def test_every_way_to_keep_positions_gets_them(position):
    normal, distance = errors(sliver_scene(2), Settings(**FINE, position_method=position))
    assert normal.max() <= 1e-6
    if position != "depth32f":  # which is the rasterizer's own
        assert distance.max() <= 5e-7


def test_far_from_the_worlds_origin_nothing_is_lost():
    scene = sliver_scene(3)
    for path in scene.root.get_children():
        path.set_pos(np.add(path.get_pos(), (2.0e6, -1.0e6, 5.0e5)))
    normal, distance = errors(scene, Settings(**FINE))
    assert normal.max() <= 1e-6
    assert distance.max() <= 5e-7


def test_what_is_not_steep_stays_as_the_rasterizer_has_it(render):
    scene = wall_scene(distance=10.0)
    plain = render(scene, Settings(normal_format="rgba32f"), outputs=OUTPUTS)
    fine = render(scene, Settings(**FINE), outputs=OUTPUTS)
    for name in OUTPUTS:
        assert np.array_equal(plain[name], fine[name], equal_nan=True)


def test_triangles_keep_their_numbers(render):
    scene = sliver_scene(4)
    plain = render(scene, Settings(), SIZE, OUTPUTS)
    fine = render(scene, Settings(**FINE), SIZE, OUTPUTS)
    assert np.array_equal(plain["visibility"], fine["visibility"])
    assert fine["visibility"][..., 1].max() > 4096  # of the ball


def drawn_alone(scene, settings):
    """The frame of a renderer that has drawn nothing else."""
    with make_renderer(SIZE, settings) as renderer:
        return renderer.render(scene, 0.0, OUTPUTS)


def test_what_a_frame_shows_does_not_depend_on_the_frames_before():
    """Geoms change, come and go, one after the other; those that stay move in the tables."""
    settings = Settings(**FINE)

    def holds(renderer, scene):
        after, fresh = renderer.render(scene, 0.0, OUTPUTS), drawn_alone(scene, settings)
        return all(np.array_equal(after[name], fresh[name], equal_nan=True) for name in OUTPUTS)

    with make_renderer(SIZE, settings) as renderer:
        for seed, lens in ((5, "perspective"), (6, "orthographic")):
            scene = sliver_scene(seed, lens)
            before = renderer.render(scene, 0.0, OUTPUTS)
            geom, _ = scene.root.find("place/slivers").node().geoms[0]
            geom.set_normals(np.roll(geom.normals, 1, axis=0))
            assert not np.array_equal(before["normal"], renderer.render(scene, 0.0, OUTPUTS)["normal"])
            assert holds(renderer, scene)
            scene.root.find("place/ball").remove_node()
            assert holds(renderer, scene)
            attach(scene, geom_node("other", ball(0.9, 2)), (-2, 9, 0))
            assert holds(renderer, scene)


def test_tables_that_could_not_be_made_are_made_again(monkeypatch):
    scene, settings = sliver_scene(7), Settings(**FINE)
    fresh = drawn_alone(scene, settings)
    with make_renderer(SIZE, settings) as renderer:
        write = CornerTables._write

        def failing(tables, name, rows, **exact):
            if name == "u_vertices":
                raise MemoryError
            write(tables, name, rows, **exact)

        monkeypatch.setattr(CornerTables, "_write", failing)
        with pytest.raises(MemoryError):
            renderer.render(scene, 0.0, OUTPUTS)
        monkeypatch.undo()
        frame = renderer.render(scene, 0.0, OUTPUTS)
    assert all(np.array_equal(frame[name], fresh[name], equal_nan=True) for name in OUTPUTS)


@pytest.mark.parametrize(("size", "height"), [(200.0, 0.3), (2e4, 1.7), (2e4, 0.01)])
def test_a_floor_of_one_square_to_the_horizon(size, height):
    """Normals are the same all over, and distances are steep."""
    scene = Scene()
    attach(scene, geom_node("floor", wall(size)), (0, 0, -height), (0, -90, 0))
    scene.camera.set_hpr(20, -10, 5)
    scene.camera.node().lens = PerspectiveLens(vfov=60.0, near=0.1 * height, far=2 * size)
    _, place = errors(scene, Settings(**FINE))
    assert len(place) > 1000
    assert place.max() <= 5e-7


@pytest.mark.parametrize("interpolation", ["rasterizer", "float64"])
def test_triangles_that_are_lines_stay_numbers(render, interpolation):
    rng = np.random.default_rng(0)
    corners = float32(rng.uniform((-5, 8, -4), (5, 14, 4), (600, 3)))
    corners[2::3] = float32(0.5 * (corners[::3] + corners[1::3]))
    lines = Geom(corners, np.arange(600).reshape(-1, 3), rng.normal(size=corners.shape))
    scene = Scene()
    scene.root.attach_new_node(geom_node("lines", lines, Material("ink", (0.5,) * 4, double_sided=True)))
    scene.root.attach_new_node(PointLights("light", [(0, 5, 0)], (1, 1, 1), 30.0))
    scene.camera.node().lens = PerspectiveLens(vfov=60.0, near=0.5, far=100.0)
    settings = Settings(normal_format="rgba32f", interpolation=interpolation)
    frame = render(scene, settings, (256, 192), (*OUTPUTS, "radiance"))
    seen = frame["visibility"][..., 0] >= 0
    assert seen.any()
    for name in (*OUTPUTS, "radiance"):
        assert np.isfinite(frame[name][seen]).all()


def test_light_takes_it_from_there(render):
    """Finer normals reach the picture, at half resolution and with several samples too."""
    for more in ({}, {"light_resolution": "half"}, {"supersample": 2}):
        plain = render(
            ball_scene(20), Settings(normal_format="rgba32f", **more), SIZE, ("radiance",)
        ).radiance
        fine = render(ball_scene(20), Settings(**FINE, **more), SIZE, ("radiance",)).radiance
        scale = np.percentile(fine, 99.9)
        assert not np.array_equal(plain, fine)
        assert np.abs(plain - fine).max() <= 1e-3 * scale


def test_the_pass_exists_only_where_something_is_interpolated():
    def passes(settings, outputs, **capabilities):
        plan = build_plan(ball_scene(5), settings, SIZE, outputs, 0.0, Capabilities(**capabilities))
        return [step.name for step in plan.passes], plan.warnings

    fine = Settings(interpolation="float64")
    assert "interpolation" in passes(fine, ("color",))[0]
    assert "interpolation" not in passes(fine, ("albedo",))[0]
    assert "interpolation" not in passes(Settings(), ("color",))[0]
    names, warnings = passes(fine, ("color",), float64=False)
    assert "interpolation" not in names
    assert any("ARB_gpu_shader_fp64" in line for line in warnings)


def test_what_has_no_g_buffer_or_another_look_says_so():
    with pytest.raises(SettingsError, match=r"interpolation.*light_method=forward"):
        Settings(light_method="forward", interpolation="float64")
    with pytest.raises(SettingsError, match=r"interpolation.*look=classic"):
        Settings(look="classic", interpolation="float64")

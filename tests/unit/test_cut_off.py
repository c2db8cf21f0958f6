"""Geometry that only the near or the far plane keeps out of the picture is named."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firefly_sample.pipeline import build_plan
from firefly_sample.plan.collect import collect
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.plan.frustum import corners_near
from firefly_sample.plan.geometry_warnings import find_clipped
from firefly_sample.plan.view import Eye
from firefly_sample.plan.visible import Visible
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.scenes import ball, geom_node, new_planner, wall

SIZE = (64, 48)


def scene_of(lens: Lens | None = None, **things) -> Scene:
    """A scene of Geoms that stand at positions: name=(geom, (x, y, z))."""
    scene = Scene()
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    for name, (geom, position) in things.items():
        scene.root.attach_new_node(geom_node(name, geom, Material("m"))).set_pos(*position)
    if lens is not None:
        scene.camera.node().lens = lens
    return scene


def warnings_of(scene: Scene) -> tuple[str, ...]:
    return build_plan(scene, size=SIZE).warnings


def test_a_small_model_before_panda3d_s_near_plane_is_named():
    (warning,) = warnings_of(scene_of(toy=(ball(0.05), (0, 0.5, 0))))
    assert warning == (
        "camera root/camera: the near plane at 1, Panda3D's default, cuts off root/toy, and nothing else is "
        "in view: set the lens's planes by set_near_far"
    )


def test_a_model_that_is_cut_in_part_is_named_and_others_are_not():
    scene = scene_of(
        near=(ball(0.2), (0, 1.1, 0)), behind=(ball(1), (0, 5, 0)), beside=(ball(0.1), (1, 0.5, 0))
    )
    (warning,) = warnings_of(scene)
    assert "cuts off root/near: set" in warning


def test_a_near_plane_that_was_set_may_cut_as_long_as_something_is_left():
    toy = ball(0.05), (0, 0.5, 0)
    assert warnings_of(scene_of(PerspectiveLens(near=1.0), toy=toy, house=(ball(), (0, 5, 0)))) == ()
    (warning,) = warnings_of(scene_of(PerspectiveLens(near=1.0), toy=toy))
    assert "the near plane at 1 cuts off root/toy, and nothing else is in view" in warning
    (warning,) = warnings_of(scene_of(PerspectiveLens(near=0.01, far=0.2), toy=toy))
    assert "the far plane at 0.2 cuts off root/toy, and nothing else is in view" in warning


def test_a_lens_keeps_in_mind_which_planes_were_set():
    toy = ball(0.2), (0, 1.1, 0)
    for lens in (PerspectiveLens(far=50.0), OrthographicLens(far=50.0)):
        assert (
            "the near plane at 1, Panda3D's default, cuts off root/toy"
            in warnings_of(scene_of(lens, toy=toy))[0]
        )
        lens.set_near(1.0)
        assert warnings_of(scene_of(lens, toy=toy)) == ()
    lens = PerspectiveLens()
    lens.set_far(2e5)
    assert (lens.near_given, lens.far_given) == (False, True)
    assert (lens.make_copy().near_given, lens.for_picture(200, 100).far_given) == (False, True)


def test_a_city_behind_panda3d_s_far_plane_is_named():
    city = ball(2e4), (0, 1.1e5, 0)
    assert warnings_of(scene_of(PerspectiveLens(near=10.0, far=1e6), city=city)) == ()
    (warning,) = warnings_of(scene_of(PerspectiveLens(near=10.0), city=city))
    assert "the far plane at 100000, Panda3D's default, cuts off root/city: set" in warning


def test_what_is_out_of_view_is_not_cut_off():
    """A floor under the camera, walls of a room around it, and a model behind it."""
    scene = scene_of(
        floor=(wall(200.0), (0, 0, -0.5)), back=(ball(0.3), (0, -0.6, 0)), front=(wall(4.0), (0, 3, 0))
    )
    scene.root.find("**/floor").set_hpr(0, -90, 0)
    assert warnings_of(scene) == ()
    scene.camera.set_hpr(10, -8, 5)
    assert warnings_of(scene) == ()
    # from half a unit above, looking down far enough, the floor is cut
    scene.camera.set_hpr(0, -60, 0)
    assert "cuts off root/floor" in warnings_of(scene)[0]


def test_back_faces_are_never_drawn_and_so_not_cut_off():
    """The eye within a ball: only a material of two sides shows its inside."""
    scene = scene_of(head=(ball(0.3), (0, 0, 0)), house=(ball(), (0, 5, 0)))
    assert warnings_of(scene) == ()
    scene.root.find("**/head").set_scale(-1, 1, 1)
    assert warnings_of(scene) == ()
    scene.root.find("**/head").node().geoms[0][1].double_sided = True
    assert "cuts off root/head" in warnings_of(scene)[0]


def test_lines_and_points_are_cut_off_too():
    ends = [(0.1, 0.0, 0.0), (0.2, 5.0, 0.1), (0.0, 5.0, 0.0)]
    for marks in (Geom.points(ends), Geom.lines(ends, [(0, 1), (1, 2)])):
        (warning,) = warnings_of(scene_of(marks=(marks, (0, 0.5, 0))))
        assert "the near plane at 1, Panda3D's default, cuts off root/marks: set" in warning
        assert (
            warnings_of(scene_of(marks=(marks, (1, 0.5, 0)))) == ()
        )  # beside the view, and beyond the plane


def test_an_orthographic_lens_sees_nothing_behind_its_eye():
    assert warnings_of(scene_of(OrthographicLens(film_size=2.0), back=(ball(0.2), (0, -1, 0)))) == ()
    assert (
        "cuts off root/toy"
        in warnings_of(scene_of(OrthographicLens(film_size=2.0), toy=(ball(0.2), (0, 0.5, 0))))[0]
    )


def test_many_nodes_are_not_all_named():
    toys = {f"toy{i}": (ball(0.02, 1), (0.04 * i - 0.1, 0.8, 0)) for i in range(6)}
    (warning,) = warnings_of(scene_of(**toys))
    assert re.search(
        r"cuts off root/toy\d, root/toy\d, root/toy\d, root/toy\d and more, and nothing", warning
    )


@pytest.mark.parametrize("name", ["forest", "lightbulbs", "smoke", "spheres"])
def test_the_scenes_have_planes_of_their_own(name):
    scene = build_scene(find_scene(name))
    assert scene.lens.near_given
    assert scene.lens.far_given
    assert not [line for line in build_plan(scene, size=SIZE).warnings if "plane" in line]


def test_sprites_and_particles_are_something_that_is_left_to_see():
    """A backdrop behind a far plane that was set is left out on purpose, unless the picture is empty."""
    lens = PerspectiveLens(near=0.1, far=20.0)
    for thing in (Sprites("fireflies", [(0, 5, 0)], radii=0.1), ParticleNode("mist", [(0, 5, 0)], 0.5)):
        scene = scene_of(lens, backdrop=(wall(40.0), (0, 30, 0)))
        planner = new_planner()

        def lines(scene=scene, planner=planner):
            plan = planner.plan(scene, Settings(), SIZE, ("color",), 0.0, Capabilities())
            return [line for line in plan.warnings if "plane" in line]

        assert "the far plane at 20 cuts off root/backdrop, and nothing else is in view" in lines()[0]
        path = scene.root.attach_new_node(thing)
        assert lines() == []
        path.hide()
        assert len(lines()) == 1
        path.show()
        path.set_y(-50)
        assert len(lines()) == 1


TRIANGLES = ball(1.0, 4)


@given(st.randoms(use_true_random=False), st.floats(0.01, 1.0), st.booleans())
def test_chunks_of_triangles_leave_none_out(random, size, moved):
    """Of a ball in 20 chunks, every triangle is found that no plane of a random box rules out."""
    numbers = np.random.default_rng(random.randrange(2**32))
    geom = Geom(TRIANGLES.vertices, numbers.permutation(TRIANGLES.triangles))
    if moved:
        assert sum(map(len, corners_near(geom, np.array([(0, 0, 0, 1.0)]), 0.0))) == len(geom.triangles)
        geom.set_vertices(numbers.permutation(geom.vertices) * (1, 2, 3) + 4)
    middle = geom.vertices[numbers.integers(len(geom.vertices))] + numbers.normal(size=3) * 0.1
    normals = np.linalg.qr(numbers.normal(size=(3, 3)))[0]
    normals = np.concatenate([normals, -normals])
    planes = np.column_stack([normals, size - normals @ middle])
    beyond = geom.vertices @ planes[:, :3].T + planes[:, 3] <= 1e-9
    expected = geom.triangles[~beyond[geom.triangles].all(axis=1).any(axis=1)]
    found = [np.zeros((0, 3, 3)), *corners_near(geom, planes, 1e-9)]
    assert np.array_equal(
        np.unique(np.concatenate(found), axis=0), np.unique(geom.vertices[expected], axis=0)
    )


def test_it_is_found_anew_when_the_lens_or_the_model_has_changed():
    scene, planner = scene_of(toy=(ball(0.2), (0, 1.1, 0))), new_planner()

    def warned() -> bool:
        return bool(planner.plan(scene, Settings(), SIZE, ("color",), 0.0, Capabilities()).warnings)

    assert warned()
    scene.root.find("**/toy").set_y(2.0)
    assert not warned()
    scene.root.find("**/toy").set_y(1.1)
    assert warned()
    scene.lens.set_near_far(0.1, 100.0)
    assert not warned()


def clipped_area(corners: np.ndarray, planes: np.ndarray) -> float:
    """Area of a triangle's part within planes: I. Sutherland and G. Hodgman's clipping."""
    polygon = list(corners)
    for plane in planes:
        kept = []
        for start, end in pairwise([*polygon, polygon[0]]):
            a, b = (plane[:3] @ point + plane[3] for point in (start, end))
            if a >= 0:
                kept.append(start)
            if (a >= 0) != (b >= 0):
                kept.append(start + a / (a - b) * (end - start))
        polygon = kept
        if not polygon:
            return 0.0
    fan = [np.cross(b - polygon[0], c - polygon[0]) for b, c in pairwise(polygon[1:])]
    return float(np.linalg.norm(sum(fan, np.zeros(3)))) / 2


COORDINATE = st.floats(-4, 4)
LENSES = st.sampled_from(
    [
        PerspectiveLens(vfov=60),
        PerspectiveLens(vfov=100, film_offset=(0.3, -0.2)),
        OrthographicLens(film_height=2),
    ]
)


@given(LENSES, st.lists(COORDINATE, min_size=9, max_size=9), st.sampled_from([0.2, 1.0, 20.0]))
def test_a_triangle_is_cut_off_where_clipping_leaves_something(lens, numbers, size):
    corners = np.array(numbers).reshape(3, 3) * size
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    # on edge, it shows no side
    assume(abs(normal @ corners[0] if lens.is_perspective() else normal[1]) > 1e-3)
    assume(np.abs(corners[:, 1]).max() > 1e-6)  # in the eye's plane, it is neither before nor behind the eye
    scene = Scene()
    material = Material("m", double_sided=True)
    scene.root.attach_new_node(geom_node("triangle", Geom(corners, [(0, 1, 2)]), material))
    scene.camera.node().lens = lens
    eye, instances = Eye(scene, SIZE), collect(scene.root, 1).instances
    area = clipped_area(corners, np.array([*eye.planes[:4], (0, 1, 0, 0), (0, -1, 0, 1.0)]))
    assume(area == 0.0 or area > 1e-6)
    found = find_clipped(instances, eye, Visible(instances, eye.camera.world_to_view, eye.planes))
    assert bool(found.near) == (area > 0.0)

"""Points, lines and wireframes: the pixels that they cover, and what these hold, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample import Geom, Material, NodePath, Scene, Settings, Texture
from firefly_sample.errors import SceneError
from firefly_sample.lab import render_reference
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight
from tests.conftest import borrow_renderer
from tests.scenes import geom_node

SIZE = (32, 24)
CLEAR = Texture(np.array([[(255, 255, 255, 51)]], np.uint8), "clear")


def scene_of(geom: Geom, material: Material | None = None) -> tuple[Scene, NodePath]:
    """A scene in which one unit is one pixel, and (x, z) = (0, 0) the picture's lower left corner."""
    scene = Scene()
    scene.camera_node.lens = OrthographicLens((32, 24), near=1.0, far=100.0)
    scene.camera.set_pos(16, 0, 12)
    path = scene.root.attach_new_node(geom_node("marks", geom, material))
    scene.root.attach_new_node(AmbientLight("ambient", (0.5, 0.5, 0.5)))
    return scene, path


def covered(scene: Scene, settings: Settings | None = None) -> set[tuple[int, int]]:
    """Column and row, from the lower left corner, of the pixels where something is."""
    with borrow_renderer(SIZE, settings) as renderer:
        depth = renderer.render(scene, outputs=("depth",)).depth
    rows, columns = np.nonzero(np.isfinite(depth))
    return {(int(column), SIZE[1] - 1 - int(row)) for row, column in zip(rows, columns, strict=True)}


def square(x: int, z: int, side: int) -> set[tuple[int, int]]:
    return {(x + i, z + j) for i in range(side) for j in range(side)}


@pytest.mark.parametrize("side", [1, 2, 3, 6, 11])
def test_a_point_is_a_square_of_its_thickness(side):
    """A square of n pixels has whole ones around the centre of a pixel, if n is odd, or else its corner."""
    shift = 0.5 * (side % 2)
    scene, path = scene_of(Geom.points([(10 + shift, 10, 12 + shift)]))
    path.set_render_mode_thickness(side)
    first = 10 - side // 2, 12 - side // 2
    assert covered(scene) == square(*first, side)


def test_points_are_one_pixel_without_a_thickness():
    scene, _ = scene_of(Geom.points([(3.5, 10, 4.5), (20.5, 10, 0.5), (31.5, 10, 23.5)]))
    assert covered(scene) == {(3, 4), (20, 0), (31, 23)}


def test_an_axis_line_covers_the_pixels_whose_centres_it_crosses():
    """A line leaves its last pixel out where it ends within it: the pixels of (2.5, 5.5) to (9.5, 5.5)."""
    scene, _ = scene_of(
        Geom.lines([(2.5, 10, 5.5), (9.5, 10, 5.5), (4.5, 9, 2.5), (4.5, 9, 8.5)], [(0, 1), (2, 3)])
    )
    found = covered(scene)
    across, up = {(x, 5) for x in range(2, 9)}, {(4, z) for z in range(2, 8)}
    assert across | up <= found
    assert len(found - across - up) <= 2  # a driver may draw the last pixel of each


def test_a_diagonal_line_covers_the_diagonal():
    scene, _ = scene_of(Geom.lines([(2.5, 10, 2.5), (12.5, 10, 12.5)], [(0, 1)]))
    found = covered(scene)
    assert {(i, i) for i in range(2, 12)} <= found <= {(i, i) for i in range(2, 13)}


def test_a_wireframe_is_the_edges_of_its_triangles():
    corners = [(2.5, 10, 2.5), (22.5, 10, 2.5), (2.5, 10, 18.5)]
    solid, path = scene_of(Geom(corners, [(0, 1, 2)]))
    filled = covered(solid)
    path.set_render_mode_wireframe()
    edges = covered(solid)
    assert {(x, 2) for x in range(3, 22)} | {(2, z) for z in range(3, 18)} <= edges
    inside = {
        (x, z)
        for x, z in filled
        if {(x - 1, z), (x + 1, z), (x, z - 1), (x, z + 1), (x + 1, z + 1)} <= filled
    }
    assert len(inside) > 80
    assert not edges & inside
    path.clear_render_mode()
    assert covered(solid) == filled


def test_a_wireframe_leaves_the_next_draw_filled():
    corners = [(2.5, 10, 2.5), (22.5, 10, 2.5), (2.5, 10, 18.5)]
    scene, path = scene_of(Geom(corners, [(0, 1, 2)]))
    path.set_render_mode_wireframe()
    other = Geom([(24, 5, 2), (30, 5, 2), (30, 5, 8), (24, 5, 8)], [(0, 1, 2), (0, 2, 3)])
    scene.root.attach_new_node(geom_node("filled", other))
    assert square(24, 2, 6) <= covered(scene)


@pytest.mark.parametrize("method", ["volumes", "clustered", "loop", "forward"])
def test_marks_without_normals_are_lit_as_if_they_faced_the_camera(method):
    """By half an ambient light and a sun along the view, of 0.25: a matt surface shows 0.75 of its colour."""
    corners = [(4.5, 10, 4.5), (12.5, 10, 4.5)]
    for geom in (Geom.points(corners), Geom.lines(corners, [(0, 1)])):
        scene, _ = scene_of(geom, Material("matt", base_color=(0.8, 0.4, 0.2, 1.0)))
        scene.root.attach_new_node(DirectionalLight("sun", (0.25, 0.25, 0.25)))
        with borrow_renderer(SIZE, Settings(light_method=method, albedo_format="rgba32f")) as renderer:
            radiance = renderer.render(scene, outputs=("radiance",)).radiance
        assert np.allclose(radiance[SIZE[1] - 1 - 4, 4], (0.6, 0.3, 0.15), rtol=1e-6)


def test_colors_of_vertices_go_along_a_line():
    scene, _ = scene_of(Geom.lines([(2.5, 9, 5.5), (12.5, 9, 5.5)], [(0, 1)], colors=[(1, 0, 0), (0, 0, 1)]))
    with borrow_renderer(SIZE, Settings(albedo_format="rgba32f")) as renderer:
        albedo = renderer.render(scene, outputs=("albedo",)).albedo[SIZE[1] - 1 - 5]
    share = (np.arange(3, 12) - 2) / 10.0
    assert np.allclose(albedo[3:12], np.stack([1 - share, 0 * share, share], axis=1), atol=1e-6)


def test_ids_and_depth_are_those_of_the_marks():
    scene, _ = scene_of(Geom.points([(5.5, 7, 6.5), (8.5, 30, 6.5)]))
    with borrow_renderer(SIZE) as renderer:
        frame = renderer.render(scene, outputs=("depth", "id"))
    row = SIZE[1] - 1 - 6
    assert frame.depth[row, [5, 8]].tolist() == [7.0, 30.0]
    assert [frame.id_names[frame["id"][row, column]] for column in (5, 8)] == ["root/marks", "root/marks"]
    assert frame["id"][0, 0] == -1


def test_supersampling_keeps_the_size_of_points():
    scene, path = scene_of(Geom.points([(10, 10, 12)]), Material("white", emission=(1.0, 1.0, 1.0)))
    path.set_render_mode_thickness(4)
    with borrow_renderer(SIZE, Settings(supersample=2, tone="none")) as renderer:
        color = renderer.render(scene).color[::-1]
    lit = {(int(x), int(z)) for z, x in np.argwhere(color[..., 0] > 0)}
    assert lit == square(8, 10, 4)


def test_marks_cast_no_shadow_and_break_no_sum_over_surfaces():
    scene, _ = scene_of(Geom.points([(10, 10, 12)]))
    sun = DirectionalLight("sun")
    sun.set_shadow_caster(True, 64)
    scene.root.attach_new_node(sun)
    with borrow_renderer(SIZE, Settings(exposure="auto", interpolation="float64")) as renderer:
        frame = renderer.render(scene, outputs=("color", "depth", "shadow_atlas"))
    assert np.isfinite(frame.depth).sum() == 1


@pytest.mark.parametrize(
    ("share", "colors"),
    [
        ({"base_color": (1.0, 1.0, 1.0, 0.2)}, None),
        ({"texture": CLEAR}, None),
        ({"modulate_texture": CLEAR}, None),
        ({}, [(1.0, 1.0, 1.0, 0.5)]),
    ],
)
def test_marks_that_let_through_are_opaque_and_named(share, colors):
    clear = Material("glass", alpha_mode="blend", **share)
    scene, _ = scene_of(Geom.points([(10.5, 10, 12.5)], name="dust", colors=colors), clear)
    with borrow_renderer(SIZE, Settings(albedo_format="rgba32f")) as renderer:
        frame = renderer.render(scene, outputs=("radiance", "depth"))
    assert frame.warnings == ("lines and points are drawn opaque, not blended: dust",)
    assert frame.radiance[SIZE[1] - 1 - 12, 10].tolist() == [0.5, 0.5, 0.5]
    assert np.isfinite(frame.depth).sum() == 1


@pytest.mark.parametrize(
    ("kind", "mode", "thickness", "warned"),
    [
        ("lines", "filled", 3.0, True),
        ("lines", "wireframe", 0.5, True),
        ("triangles", "wireframe", 3.0, True),
        ("lines", "filled", 1.0, False),
        ("triangles", "filled", 3.0, False),
        ("points", "wireframe", 3.0, False),
    ],
)
def test_lines_of_another_thickness_are_named(kind, mode, thickness, warned):
    corners, elements = [(5, 10, 5), (25, 10, 5), (5, 10, 20)], {"lines": [(0, 1)], "triangles": [(0, 1, 2)]}
    geom = Geom(corners, elements.get(kind, [(0,), (1,)]), name="net", mode=kind)
    scene, path = scene_of(geom)
    path.get_parent().set_render_mode(mode, thickness)
    with borrow_renderer(SIZE) as renderer:
        warnings = renderer.render(scene, outputs=("depth",)).warnings
    assert len(warnings) == warned
    assert all(line.startswith("lines are one pixel wide, whatever") and "net" in line for line in warnings)


def test_the_reference_refuses_marks_by_name():
    scene, _ = scene_of(Geom.points([(10.5, 10, 12.5)], name="dust"))
    with borrow_renderer(SIZE) as renderer:
        plan = renderer.plan(scene, outputs=("radiance", "visibility"))
        seen = renderer.draw(plan)["visibility"]
    with pytest.raises(SceneError, match="hide the lines and points dust"):
        render_reference(plan, seen)

"""All blended triangles along a ray, found in float64: none twice, none lost."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab.reference.cache import reference_frame
from firefly_sample.lab.reference.layer_rays import cast_layers, steady_layers
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.blended import add_panes, backdrop, empty_scene, glass
from tests.conftest import make_renderer
from tests.lab.float64 import plan_of
from tests.scenes import ball, geom_node, wall

SIZE = (32, 24)
EMPTY = np.full(SIZE[::-1], np.inf)


def layers_of(scene, distance=EMPTY):
    plan = plan_of(scene, SIZE)
    return cast_layers(plan, distance), plan


def counts(layers):
    return np.bincount(layers.pixel, minlength=SIZE[0] * SIZE[1]).reshape(SIZE[::-1])


def put(scene, geom, place=(0, 5, 0), **more):
    path = scene.root.attach_new_node(geom_node("glass", geom, glass("glass", (1, 1, 1), 0.5, **more)))
    path.set_pos(*place)
    return path


@pytest.mark.parametrize("cells", [1, 2, 8, 32])
def test_edges_through_centres_of_pixels_have_one_triangle(cells):
    """The squares' diagonals, and some of their sides, go right through centres."""
    scene = Scene()
    scene.camera.node().lens = OrthographicLens(film_size=SIZE, near=1, far=20)
    put(scene, wall(64.0, cells), (0.5, 5, 0.5))
    layers, _ = layers_of(scene)
    assert (counts(layers) == 1).all()
    assert np.abs(layers.distance - 5.0).max() <= 1e-14


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
def test_a_closed_surface_is_met_an_even_number_of_times(orthographic):
    scene = empty_scene()
    if not orthographic:
        scene.camera.node().lens = PerspectiveLens(vfov=40, near=0.1, far=100)
    put(scene, ball(0.7, 3), (0.1, 5, 0.05)).set_hpr(20, 30, 40)
    layers, _ = layers_of(scene)
    assert set(np.unique(counts(layers))) == {0, 2}
    pairs = layers.distance.reshape(-1, 2)
    assert (pairs[:, 0] < pairs[:, 1]).all()


def test_one_sided_surfaces_show_the_side_that_faces_the_eye():
    scene = empty_scene()
    put(scene, ball(0.7, 2), double_sided=False)
    layers, _ = layers_of(scene)
    assert set(np.unique(counts(layers))) == {0, 1}
    assert (layers.distance < 5.0).all()


def test_distances_are_those_of_the_plane():
    scene = empty_scene()
    scene.camera.node().lens = PerspectiveLens(vfov=40, near=0.1, far=100)
    normal = np.array([0.3, -1.0, 0.2])
    corners = np.array([(-9, -9), (9, -9), (0, 9)], dtype=float)
    y = 5 + 0.3 * corners[:, 0] + 0.2 * corners[:, 1]
    put(scene, Geom(np.column_stack([corners[:, 0], y, corners[:, 1]]), [(0, 1, 2)]), (0, 0, 0))
    layers, plan = layers_of(scene)
    assert (counts(layers) == 1).all()
    direction = pixel_rays(plan.view).direction
    assert layers.distance == pytest.approx(-5.0 / (direction @ normal), rel=1e-13)


def test_a_floor_that_reaches_behind_the_eye_is_seen_from_the_near_plane_on():
    scene = empty_scene()
    scene.camera.node().lens = PerspectiveLens(vfov=90, near=2.0, far=30.0)
    put(scene, wall(400.0), (0, 0, -1.0)).set_p(-90)
    layers, plan = layers_of(scene)
    down = -pixel_rays(plan.view).direction[:, 2].reshape(SIZE[::-1])
    with np.errstate(divide="ignore"):
        expected = 1.0 / down
    assert (counts(layers) == ((expected >= 2.0) & (expected <= 30.0))).all()


def test_surfaces_in_one_plane_are_all_there_in_the_order_of_drawing():
    scene = empty_scene()
    for _ in range(5):
        put(scene, wall(4.0))
    layers, _ = layers_of(scene)
    assert (counts(layers) == 5).all()
    assert layers.most == 5
    numbers = np.stack([layers.batch, layers.instance]).reshape(2, -1, 5)
    assert (np.diff(numbers[0] * 5 + numbers[1], axis=1) > 0).all()


def test_what_is_behind_an_opaque_surface_is_no_layer():
    scene = empty_scene()
    for y in (4.0, 5.0, 6.0):
        put(scene, wall(4.0), (0, y, 0))
    for distance, expected in ((3.9, 0), (4.0, 1), (5.5, 2), (np.inf, 3)):
        layers, _ = layers_of(scene, np.full(SIZE[::-1], distance))
        assert (counts(layers) == expected).all()


def test_pixels_on_edges_and_crossings_are_not_steady():
    """Two panes that cross in the middle of the picture, on a column of centres; one ends on another."""
    scene = Scene()
    scene.camera.node().lens = OrthographicLens(film_size=SIZE, near=1, far=60)
    put(scene, wall(100.0), (0.5, 20, 0)).set_h(30)
    put(scene, wall(100.0), (0.5, 20, 0)).set_h(-30)
    put(scene, wall(10.0), (-0.5, 5, 0))
    plan = plan_of(scene, SIZE)
    steady = steady_layers(plan, np.full((*SIZE[::-1], 2), -1, dtype=np.int32))
    # squares of two triangles: the diagonals are edges as well
    columns = np.arange(SIZE[0]) - 15.5
    assert not steady[:, columns == 0.5].any()
    sides = np.isin(columns, (-5.5, 4.5))
    inside = slice(SIZE[1] // 2 - 4, SIZE[1] // 2 + 4)
    assert not steady[inside][:, sides].any()
    assert steady[:, (columns > 8) | (columns < -8)].mean() > 0.9


def test_a_reference_is_computed_again_when_a_pane_moves(tmp_path):
    scene = add_panes(backdrop(), 2, kinds=({"unlit": True},))
    pictures = []
    with make_renderer(SIZE, Settings()) as renderer:
        for _ in range(2):
            pictures.append(reference_frame(renderer, scene, folder=tmp_path))
            pictures.append(reference_frame(renderer, scene, folder=tmp_path))
            pane = scene.root.find("**/pane 0")
            pane.set_y(pane.get_y() - 1.0)
    assert len(list(tmp_path.glob("reference-*.npz"))) == 2
    for first, second in (pictures[:2], pictures[2:]):
        assert (first.radiance == second.radiance).all()
    assert (pictures[0].radiance != pictures[2].radiance).any()

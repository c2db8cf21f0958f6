"""What stands above a node: transforms place lights and dots but never stretch them; colours multiply."""

import numpy as np
import pytest

from firefly_sample.scene.lights import PointLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.points import Sprites
from tests.scenes import geom_node, wall, wall_scene

LOCAL = np.array([(-1.0, -0.5, 0.25), (-0.5, 0.75, -0.5)])
COLORS = np.array([(1.0, 0.5, 0.25), (0.25, 0.5, 1.0)])
RADII = np.array([3.5, 4.0])


def _moved(root):
    root.set_pos(0.5, 8, -0.25)
    return LOCAL + np.array([0.5, 8, -0.25])


def _turned(root):
    """A heading of 90 degrees turns +X into +Y and +Y into -X."""
    root.set_pos(0, 9, 0)
    root.set_h(90)
    return np.stack([-LOCAL[:, 1], LOCAL[:, 0], LOCAL[:, 2]], axis=1) + np.array([0, 9, 0])


def _scaled(root):
    root.set_pos(0, 8, 0)
    root.set_scale(2, 0.5, 3)
    return LOCAL * (2, 0.5, 3) + (0, 8, 0)


def _turned_and_scaled(root):
    root.set_pos(0, 9, 0)
    root.set_h(90)
    root.set_scale(2)
    return 2 * np.stack([-LOCAL[:, 1], LOCAL[:, 0], LOCAL[:, 2]], axis=1) + (0, 9, 0)


def _mirrored(root):
    root.set_pos(0, 8, 0)
    root.set_scale(-1, 1, -1.5)
    return LOCAL * (-1, 1, -1.5) + (0, 8, 0)


PARENTS = [_moved, _turned, _scaled, _turned_and_scaled, _mirrored]


def _picture(render, attach):
    """The radiance of a wall at y = 10 and what `attach` hangs under its root."""
    scene = wall_scene(distance=10.0)
    attach(scene.root)
    return render(scene, None, (96, 72), ("radiance",)).radiance


def assert_same_light(picture, expected):
    assert expected.max() > 0.03
    assert not (expected.sum(axis=2) > 0).all()  # the rim of the reach is in view
    assert np.abs(picture - expected).max() <= 1e-5 * expected.max()


@pytest.mark.parametrize("kind", [PointLights, Sprites])
@pytest.mark.parametrize("place", PARENTS)
def test_points_are_where_their_parent_puts_them_and_keep_their_radius(render, kind, place):
    world = []

    def below(root):
        parent = root.attach_new_node("parent")
        world.append(place(parent))
        parent.attach_new_node(kind("points", LOCAL, COLORS, RADII / (1 if kind is PointLights else 4)))

    picture = _picture(render, below)
    radii = RADII / (1 if kind is PointLights else 4)
    direct = _picture(render, lambda root: root.attach_new_node(kind("points", world[0], COLORS, radii)))
    assert_same_light(picture, direct)


@pytest.mark.parametrize("kind", [PointLights, Sprites])
def test_points_under_nested_parents_are_at_the_net_place(render, kind):
    """Turned below, stretched above, and moved between: (x, y, z) becomes (-2y + 1, 3x + 8.5, 4z)."""

    def below(root):
        outer = root.attach_new_node("outer")
        outer.set_scale(2, 3, 4)
        outer.set_pos(0, 8.5, 0)
        inner = outer.attach_new_node("inner")
        inner.set_h(90)
        inner.set_x(0.5)
        inner.attach_new_node(kind("points", [(-0.25, 0.5, 0.25)], (1, 0.5, 0.25), 3.0))

    picture = _picture(render, below)
    direct = _picture(
        render, lambda root: root.attach_new_node(kind("points", [(0, 7.75, 1)], (1, 0.5, 0.25), 3.0))
    )
    assert_same_light(picture, direct)


@pytest.mark.parametrize("kind", [PointLights, Sprites])
def test_a_point_nodes_own_transform_places_its_points(render, kind):
    def below(root):
        path = root.attach_new_node(kind("points", [(-0.5, 0.25, 0.5)], (1, 0.5, 0.25), 3.0))
        path.set_pos(0, 9, 0)
        path.set_h(90)
        path.set_scale(2)

    picture = _picture(render, below)
    direct = _picture(
        render, lambda root: root.attach_new_node(kind("points", [(-0.5, 8, 1)], (1, 0.5, 0.25), 3.0))
    )
    assert_same_light(picture, direct)


def test_one_light_under_a_scaled_parent_keeps_its_reach(render):
    """R = 3 at 2 before the wall: lit within sqrt(5) of the foot point, whatever the parent's scale."""
    scene = wall_scene(distance=10.0)
    parent = scene.root.attach_new_node("parent")
    parent.set_scale(4)
    parent.attach_new_node(PointLight("lamp", (1, 1, 1), 3.0)).set_pos(0.25, 2, -0.125)
    frame = render(scene, None, (96, 72), ("radiance", "position"))
    foot = np.hypot(frame.position[..., 0] - 1, frame.position[..., 2] + 0.5)
    lit = frame.radiance[..., 0] > 0
    assert lit[foot < 5**0.5 - 0.05].all()
    assert not lit[foot > 5**0.5 + 1e-4].any()


def test_points_and_camera_under_one_parent_move_together(render):
    """Where all hang under a turned and moved parent, the picture is the one at the origin."""
    expected = _picture(
        render, lambda root: root.attach_new_node(PointLights("l", [(1, 8, 0)], (1, 1, 1), 3))
    )
    scene = wall_scene(distance=10.0)
    parent = scene.root.attach_new_node("parent")
    parent.set_pos(5, -7, 3)
    parent.set_hpr(40, 25, -15)
    scene.root.attach_new_node(PointLights("l", [(1, 8, 0)], (1, 1, 1), 3))
    for child in list(scene.root.get_children()):
        if child != parent:
            child.reparent_to(parent)
    picture = render(scene, None, (96, 72), ("radiance",)).radiance
    assert np.abs(picture - expected).max() <= 1e-5 * expected.max()


# --- Colours ---

BASE = np.array([0.5, 0.8, 0.25])


def _albedo(render, dress, geom=None, **material):
    scene = wall_scene()
    scene.root.find("wall").remove_node()
    outer = scene.root.attach_new_node("outer")
    inner = outer.attach_new_node("inner")
    path = inner.attach_new_node(geom_node("wall", geom or wall(), Material("wall", (*BASE, 1), **material)))
    path.set_pos(0, 10, 0)
    dress(outer, inner, path)
    return render(scene, None, (4, 3), ("albedo",)).albedo[1, 1]


NODE, OTHER = (0.5, 0.25, 0.8, 1.0), (0.9, 0.1, 0.2, 1.0)


@pytest.mark.parametrize(
    ("dress", "expected"),
    [
        (lambda outer, inner, path: path.set_color(NODE), NODE),
        (lambda outer, inner, path: inner.set_color(NODE), NODE),
        (lambda outer, inner, path: outer.set_color(NODE), NODE),
        (lambda outer, inner, path: (outer.set_color(OTHER), inner.set_color(NODE)), NODE),
        (lambda outer, inner, path: (inner.set_color(OTHER), path.set_color(NODE)), NODE),
        (lambda outer, inner, path: (outer.set_color(NODE, 1), inner.set_color(OTHER)), NODE),
        (lambda outer, inner, path: (path.set_color(OTHER), outer.set_color(NODE), path.clear_color()), NODE),
        (lambda outer, inner, path: None, (1, 1, 1, 1)),
    ],
    ids=["own", "parent", "grandparent", "nearest", "own-wins", "priority", "cleared", "none"],
)
def test_the_color_that_holds_at_a_node_multiplies_the_base_color(render, dress, expected):
    albedo = _albedo(render, dress)
    assert np.abs(albedo - BASE * expected[:3]).max() <= 2 * 0.5 / 255


def test_a_nodes_color_replaces_vertex_colors_but_not_the_base_color(render):
    plain = wall()
    geom = type(plain)(
        plain.vertices, plain.triangles, plain.normals, plain.texcoords, np.tile(OTHER[:3], (4, 1))
    )
    assert np.abs(_albedo(render, lambda *_: None, geom) - BASE * OTHER[:3]).max() <= 2 * 0.5 / 255
    colored = _albedo(render, lambda outer, inner, path: inner.set_color(NODE), geom)
    assert np.abs(colored - BASE * NODE[:3]).max() <= 2 * 0.5 / 255


def test_the_alpha_of_a_nodes_color_counts_for_a_cut_out(render):
    half = (1.0, 1.0, 1.0, 0.4)
    gone = _albedo(render, lambda outer, inner, path: path.set_color(half), alpha_mode="mask")
    low = {"alpha_mode": "mask", "alpha_cutoff": 0.3}
    kept = _albedo(render, lambda outer, inner, path: path.set_color(half), **low)
    assert (gone == 0).all()
    assert np.abs(kept - BASE).max() <= 2 * 0.5 / 255

"""Points on surfaces: their areas, positions and normals are those of the surfaces, for any transform."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.plan.collect import collect
from firefly_sample.plan.surface_points import sample_surfaces
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import ALL_CAMERAS
from firefly_sample.scene.nodepath import NodePath
from tests.scenes import ball, geom_node, unit, wall

COUNT = 2048
TRANSFORMS = {
    "as it is": {},
    "moved and turned": {"pos": (3, -2, 8), "hpr": (30, 40, 50)},
    "enlarged": {"scale": (7, 7, 7)},
    "stretched": {"scale": (1, 3, 20)},
    "mirrored": {"scale": (-1, 2, 2)},
    "sheared": {"scale": (1, 4, 1), "hpr": (45, 0, 0), "outer": (1, 1, 3)},
}


def points_on(root):
    return sample_surfaces(collect(root, ALL_CAMERAS).instances, COUNT)


def placed(geom, pos=(0, 0, 0), hpr=(0, 0, 0), scale=(1, 1, 1), outer=(1, 1, 1), material=None):
    """A root with one instance of a Geom."""
    root = NodePath("root")
    above = root.attach_new_node("above")
    above.set_scale(*outer)
    path = above.attach_new_node(geom_node("thing", geom, material))
    path.set_pos(*pos)
    path.set_hpr(*hpr)
    path.set_scale(*scale)
    return root, path


def triangle_areas(geom, net):
    corners = (geom.vertices @ net[:3, :3] + net[3, :3])[geom.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)


@pytest.mark.parametrize("transform", TRANSFORMS.values(), ids=TRANSFORMS)
def test_areas_add_up_to_the_surfaces(transform):
    for geom, tolerance in ((wall(4.0, 3), 1e-12), (ball(), 2e-2)):
        root, path = placed(geom, **transform)
        exact = triangle_areas(geom, np.array(path.get_net_transform().get_mat())).sum()
        assert points_on(root).areas.sum() == pytest.approx(exact, rel=tolerance)


@pytest.mark.parametrize("transform", TRANSFORMS.values(), ids=TRANSFORMS)
def test_points_lie_on_the_surface_with_its_normals(transform):
    """On an ellipsoid: the gradient of its equation is the normal."""
    root, path = placed(ball(subdivisions=4), **transform)
    points = points_on(root)
    inverse = np.linalg.inv(np.array(path.get_net_transform().get_mat()))
    own = points.positions @ inverse[:3, :3] + inverse[3, :3]
    assert np.linalg.norm(own, axis=1) == pytest.approx(1.0, abs=5e-3)
    outward = unit(own @ inverse[:3, :3].T)
    assert np.linalg.norm(points.normals, axis=1) == pytest.approx(1.0, abs=1e-12)
    assert (points.normals * outward).sum(axis=1).min() > 0.99


def test_points_are_spread_evenly():
    """Each cell of a square has its share; a grid of instances aligned with the points has no gaps either."""
    root = NodePath("root")
    tile = geom_node("tile", wall(1.0))
    for x in range(32):
        for z in range(32):
            place = root.attach_new_node("place")
            place.set_pos(x, 0, z)
            place.attach_new_node(tile)
    points = points_on(root)
    cells = np.floor((points.positions[:, [0, 2]] + 0.5) / 4.0).astype(int)
    counts = np.bincount(cells[:, 0] * 8 + cells[:, 1], minlength=64)
    assert counts.sum() == COUNT
    assert np.abs(counts - COUNT / 64).max() <= 8
    within = (points.positions[:, [0, 2]] + 0.5) % 1.0
    counts, _, _ = np.histogram2d(*within.T, bins=4, range=[(0, 1), (0, 1)])
    assert np.abs(counts - COUNT / 16).max() <= 24


def test_a_large_and_a_small_thing_get_points_by_their_area():
    root = NodePath("root")
    for name, size in (("small", 1.0), ("large", 3.0)):
        root.attach_new_node(geom_node(name, wall(size)))
    points = points_on(root)
    assert np.bincount(points.instances) == pytest.approx([COUNT / 10, COUNT * 9 / 10], abs=2)


def test_a_two_sided_surface_has_points_on_both_sides():
    root, _ = placed(wall(2.0), material=Material("sheet", double_sided=True))
    points = points_on(root)
    assert len(points) == 2 * COUNT
    assert points.areas.sum() == pytest.approx(8.0)
    assert np.bincount((points.normals[:, 1] > 0).astype(int)).tolist() == [COUNT, COUNT]


def test_of_a_very_large_mesh_some_triangles_stand_for_all():
    geom = wall(6.0, 400)
    root, _ = placed(geom)
    points = points_on(root)
    assert len(geom.triangles) > 2**18
    assert points.areas.sum() == pytest.approx(36.0, rel=1e-3)
    counts, _, _ = np.histogram2d(*points.positions[:, [0, 2]].T, bins=4, range=[(-3, 3), (-3, 3)])
    assert np.abs(counts - COUNT / 16).max() <= 24


NOTHING = {
    "no geometry": None,
    "a line": Geom([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)]),
    "no triangles": Geom([(0, 0, 0)], np.zeros((0, 3), dtype=int)),
}


@pytest.mark.parametrize("geom", NOTHING.values(), ids=NOTHING)
def test_without_an_area_there_are_no_points(geom):
    root = NodePath("root") if geom is None else placed(geom)[0]
    assert len(points_on(root)) == 0


def test_a_triangle_without_area_gets_no_point():
    geom = Geom([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 1)], [(0, 1, 2), (0, 1, 3), (0, 1, 2)])
    root, _ = placed(geom)
    points = points_on(root)
    assert points.areas.sum() == pytest.approx(0.5)
    assert np.isfinite(points.positions).all()

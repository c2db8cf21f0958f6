"""The box and the sphere around a Geom's vertices."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firefly_sample.scene.geom import Geom, GeomNode

POINTS = arrays(np.float64, st.tuples(st.integers(1, 6), st.just(3)), elements=st.floats(-1e6, 1e6))


def check(geom):
    low, high = geom.bounds
    center, radius = geom.sphere
    assert low.tolist() == geom.vertices.min(axis=0).tolist()
    assert high.tolist() == geom.vertices.max(axis=0).tolist()
    assert center.tolist() == (0.5 * (low + high)).tolist()
    assert radius == np.linalg.norm(geom.vertices - center, axis=1).max()


@given(POINTS, st.floats(-3, 3))
def test_both_hold_every_vertex_and_follow_them(points, factor):
    geom = Geom(points, [(0, 0, 0)])
    check(geom)
    geom.set_vertices(factor * points)
    check(geom)


def test_without_vertices_there_is_no_place_and_no_size():
    geom = Geom(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    assert np.isnan(geom.bounds).all()
    center, radius = geom.sphere
    assert np.isnan(center).all()
    assert radius == 0.0


def test_geoms_can_be_removed():
    node = GeomNode("thing")
    node.add_geom(Geom(np.eye(3), [(0, 1, 2)]))
    node.remove_all_geoms()
    assert node.geoms == []

"""Triangles are clipped to the view, with their planes on the screen; pairs and circles are complete."""

from itertools import pairwise

import networkx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.plan.blending import candidates
from firefly_sample.plan.blending.candidates import Boxes, Sweep
from firefly_sample.plan.blending.graph import circles, taken
from firefly_sample.plan.blending.polygons import triangles_on_screen
from tests.painter import FAR, LENSES, NEAR, PERSPECTIVE, rays, triangle_distances

EVERY_LENS = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)


def anywhere(seed, count):
    """Triangles before, in and behind the view, large and small."""
    rng = np.random.default_rng(seed)
    sizes = 10.0 ** rng.uniform(-1.0, 1.5, (count, 1, 1))
    return rng.normal((0.0, 5.0, 0.0), 5.0, (count, 1, 3)) + sizes * rng.normal(size=(count, 3, 3))


@EVERY_LENS
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_polygons_cover_the_pixels_of_their_triangles_at_their_distances(lens, seed):
    triangles = anywhere(seed, 20)
    polygons = triangles_on_screen(triangles, np.arange(20), lens, NEAR, FAR)
    assert polygons.groups.tolist() == polygons.sources.tolist()
    expected = triangle_distances(triangles, lens)
    missing = np.setdiff1d(np.arange(20), polygons.sources)
    assert not np.isfinite(expected[missing]).any()
    places = rays(lens)[1 if lens.perspective else 0][:, [0, 2]] * max(lens.a, lens.c)
    for row, source in enumerate(polygons.sources):
        corners = polygons.corners[row, : polygons.counts[row]]
        assert (polygons.corners[row, polygons.counts[row] :] == corners[0]).all()
        edges = np.roll(corners, -1, axis=0) - corners
        away = places[:, None] - corners
        inside = (edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0] > 0.0).all(axis=1)
        seen = np.isfinite(expected[source])
        assert np.array_equal(inside, seen), "counter-clockwise, and the same pixels"
        q = polygons.planes[row, 0] + places[seen] @ polygons.planes[row, 1:]
        distances = 1.0 / q if lens.perspective else -q
        np.testing.assert_allclose(distances, expected[source][seen], rtol=1e-9)
        assert (distances <= polygons.farthest[row] * (1.0 + 1e-12)).all()


@EVERY_LENS
def test_triangles_without_an_area_on_the_screen_are_left_out(lens):
    """A point, a line, one seen edge-on, and those outside of each plane of the view."""
    eye_plane = lens.view_from_distance(
        np.array([0.3, 0.3, 0.3]), np.array([0.0, 0.5, 0.2]), np.array([4, 6, 9.0])
    )
    triangles = [
        [(0, 5, 0)] * 3,
        [(0, 5, 0), (1, 6, 1), (2, 7, 2)],
        eye_plane,
        [(0, -5, 0), (1, -5, 0), (0, -5, 1)],
        [(0, 200, 0), (1, 200, 0), (0, 200, 1)],
        [(90, 5, 0), (91, 5, 0), (90, 5, 1)],
        [(0, 5, -91), (1, 5, -90), (0, 5, -90)],
        [(0, 5, 0), (1, 5, 0), (0, 5, 1)],
    ]
    assert triangles_on_screen(triangles, 0, lens, NEAR, FAR).sources.tolist() == [7]


def test_a_triangle_around_the_whole_view_becomes_the_view():
    polygons = triangles_on_screen([(-900, 5, -900), (900, 5, -900), (0, 5, 900)], 0, PERSPECTIVE, NEAR, FAR)
    corners = polygons.corners[0, : polygons.counts[0]]
    expected = {(x, z) for x in (-1.6 / 1.2, 1.6 / 1.2) for z in (-1.0, 1.0)}
    assert {tuple(np.round(corner, 12)) for corner in corners} == {tuple(np.round(e, 12)) for e in expected}
    assert polygons.farthest == pytest.approx(5.0)


def some_boxes(rng, count):
    low = rng.uniform(-1.0, 1.0, (count, 2)).round(rng.integers(1, 4))
    return Boxes(low, low + 10.0 ** rng.uniform(-3.0, 0.3, (count, 2)))


def overlapping(a, b):
    return ((a.low[:, None] < b.high) & (b.low < a.high[:, None])).all(axis=2)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 60), others=st.integers(0, 60))
@settings(max_examples=60)
def test_the_sweep_finds_each_pair_once(seed, count, others):
    rng = np.random.default_rng(seed)
    a, b = some_boxes(rng, count), some_boxes(rng, others)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(candidates, "CHUNK", 7)
        own = [pair for part in Sweep(a) for pair in zip(*map(np.ndarray.tolist, part), strict=True)]
        mixed = [pair for part in Sweep(a, b) for pair in zip(*map(np.ndarray.tolist, part), strict=True)]
    expected = np.argwhere(np.triu(overlapping(a, a), 1)).tolist()
    assert sorted(sorted(pair) for pair in own) == expected
    assert [list(pair) for pair in sorted(mixed)] == np.argwhere(overlapping(a, b)).tolist()
    assert Sweep(a).count >= len(own)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 30), density=st.floats(0.0, 3.0))
@settings(max_examples=60)
def test_circles_are_the_strong_components(seed, n, density):
    rng = np.random.default_rng(seed)
    first, second = rng.integers(0, n, (2, int(density * n)))
    first, second = first[first != second], second[first != second]
    graph = networkx.DiGraph(zip(first.tolist(), second.tolist(), strict=True))
    expected = {frozenset(c) for c in networkx.strongly_connected_components(graph) if len(c) > 1}
    found = circles(n, first, second)
    assert {
        frozenset(np.flatnonzero(found.labels == k).tolist()) for k in set(found.labels) - {-1}
    } == expected
    inside = [any({i, j} <= circle for circle in expected) for i, j in zip(first, second, strict=True)]
    assert found.inside.tolist() == inside


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 40), density=st.floats(0.0, 3.0))
@settings(max_examples=60)
def test_all_edges_lead_onwards(seed, n, density):
    rng = np.random.default_rng(seed)
    names = rng.permutation(n)
    first, second = np.sort(rng.integers(0, max(n, 1), (2, int(density * n))), axis=0)
    first, second = names[first[first != second]], names[second[first != second]]
    groups = rng.integers(0, 4, n)
    order = taken(n, first, second, groups)
    place = np.empty(n, dtype=int)
    place[order] = np.arange(n)
    assert sorted(order) == list(range(n))
    assert (place[first] < place[second]).all()
    for here, there in pairwise(order):
        if groups[here] != groups[there]:  # nothing else of the group was free
            waiting = {*second[place[first] > place[here]]}
            assert {t for t in range(n) if place[t] > place[here] and groups[t] == groups[here]} <= waiting

"""Every pixel sees blended triangles back to front, wherever there is such an order."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.plan.blending import order as order_module
from firefly_sample.plan.blending.order import order_warnings, paint_order
from firefly_sample.plan.blending.polygons import discs_on_screen, triangles_on_screen
from tests.painter import FAR, LENSES, NEAR, PERSPECTIVE, crossing_pairs, triangle_distances, wrong_pairs

EVERY_LENS = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)


def no_discs(lens):
    return discs_on_screen(np.empty((0, 3)), 1.0, False, 0, lens, NEAR, FAR)


def ordered(triangles, lens, groups=0):
    """The paint order, and the rows of the triangles in it."""
    polygons = triangles_on_screen(triangles, groups, lens, NEAR, FAR)
    result = paint_order(polygons, no_discs(lens))
    assert np.array_equal(np.sort(result.order), np.arange(len(polygons)))
    assert not result.approximate
    return result, polygons.sources[result.order]


def assert_exact(triangles, lens, groups=0):
    result, sequence = ordered(triangles, lens, groups)
    assert (result.intersecting, result.in_circles) == (0, 0)
    distances = triangle_distances(triangles, lens)
    seen = np.flatnonzero(np.isfinite(distances).any(axis=1))
    assert set(seen) <= set(sequence), "a triangle that is seen is missing"
    assert wrong_pairs(distances, sequence) == set()
    return distances, sequence


def quad(a, b, c, d):
    return np.array([(a, b, c), (a, c, d)], dtype=np.float64)


def slabs(rng, count):
    """Triangles in slabs beside each other, tilted at random within: no two of different slabs intersect."""
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    frame = np.linalg.svd(axis[None])[2][1:]
    width = rng.uniform(0.3, 2.0)
    bottom = rng.permutation(count) - 0.5 * count
    across = rng.uniform(-6.0, 6.0, (count, 3, 2))
    height = (bottom[:, None] + rng.uniform(0.02, 0.98, (count, 3))) * width
    return height[..., None] * axis + across @ frame + (0.0, rng.uniform(2.0, 12.0), 0.0)


@EVERY_LENS
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 40))
@settings(max_examples=25)
def test_panes_in_slabs_at_any_angle_are_exact(lens, seed, count):
    """The slabs' walls separate them, so that there is an order; many cross the near plane and the sides."""
    rng = np.random.default_rng(seed)
    assert_exact(slabs(rng, count), lens, rng.integers(0, 3, count))


@EVERY_LENS
def test_the_order_of_centroids_is_wrong_where_ours_is_right(lens):
    """A large pane leans away from the eye; a small one stands close behind its near end."""
    large = quad((-3, 3, -2), (3, 3, -2), (3, 30, 3), (-3, 30, 3))
    small = quad((-0.5, 6, -2.2), (0.5, 6, -2.2), (0.5, 6, -1.6), (-0.5, 6, -1.6))
    triangles = np.concatenate((large, small))
    distances, _ = assert_exact(triangles, lens)
    by_centroid = np.argsort(-triangles[:, :, 1].mean(axis=1), kind="stable")
    by_farthest = np.argsort(-triangles[:, :, 1].max(axis=1), kind="stable")
    assert wrong_pairs(distances, by_centroid)
    assert wrong_pairs(distances, by_farthest)


@EVERY_LENS
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 14))
@settings(max_examples=25)
def test_only_intersecting_triangles_are_wrong_and_all_are_counted(lens, seed, count):
    """Any triangles at all: pixels disagree only about pairs that intersect, if none are in a circle."""
    rng = np.random.default_rng(seed)
    triangles = (
        rng.normal((0.0, 6.0, 0.0), (3.0, 4.0, 3.0), (count, 1, 3)) + rng.normal(size=(count, 3, 3)) * 2.0
    )
    result, sequence = ordered(triangles, lens)
    distances = triangle_distances(triangles, lens)
    assert len(crossing_pairs(distances)) <= result.intersecting <= count * (count - 1) / 2
    if not result.in_circles:
        assert len(wrong_pairs(distances, sequence)) <= result.intersecting


def bars():
    """Three long triangles, each of which lies on the next one: a circle."""
    result = []
    for turn in range(3):
        angle = 2.0 * np.pi * turn / 3.0
        along = np.array((np.cos(angle), 0.0, np.sin(angle)))
        across = np.array((-np.sin(angle), 0.0, np.cos(angle)))
        begin, end = -3.0 * along + 0.8 * across, 3.0 * along + 0.8 * across
        begin[1], end[1] = 7.0, 9.0
        result.append((begin, end + 0.4 * across, end - 0.4 * across))
    return np.array(result)


@EVERY_LENS
def test_three_bars_are_a_circle(lens):
    result, sequence = ordered(bars(), lens)
    assert (result.intersecting, result.in_circles) == (0, 3)
    assert len(wrong_pairs(triangle_distances(bars(), lens), sequence)) == 1
    assert list(order_warnings(result)) == [
        "some blended triangles have no right order (that overlap in circles: 3): "
        "transparency=exact needs none"
    ]


@EVERY_LENS
def test_a_circle_spoils_nothing_before_or_behind_it(lens):
    """One pane stands before the bars, and one behind them."""
    before = quad((-2, 4, -3), (2, 4, -3), (2, 5, 3), (-2, 5, 3))
    behind = quad((-2, 12, -3), (2, 12, -3), (2, 11, 3), (-2, 11, 3))
    triangles = np.concatenate((before, bars(), behind))
    result, sequence = ordered(triangles, lens)
    assert (result.intersecting, result.in_circles) == (0, 3)
    wrong = wrong_pairs(triangle_distances(triangles, lens), sequence)
    assert len(wrong) == 1
    assert all(2 <= thing <= 4 for pair in wrong for thing in pair)


@EVERY_LENS
def test_two_panes_through_each_other_are_counted_once(lens):
    a = [(-2, 5, -2), (2, 9, -2), (0, 7, 2)]
    b = [(-2, 9, -1.9), (2, 5, -1.9), (0, 7, 1.5)]
    result, _ = ordered([a, b], lens)
    assert (result.intersecting, result.in_circles) == (1, 0)
    assert "pairs that intersect: 1" in next(order_warnings(result))


def test_an_intersection_outside_the_view_does_not_count():
    """The panes cross to the left of the view; within it the flat one is behind."""
    flat = quad((-40, 8, -2), (5, 8, -2), (5, 8, 2), (-40, 8, 2))
    tilted = quad((-40, 9, -1), (5, 5, -1), (5, 5, 1), (-40, 9, 1))
    assert_exact(np.concatenate((tilted, flat)), PERSPECTIVE)


@EVERY_LENS
def test_an_intersecting_pair_is_ordered_by_its_deeper_side(lens):
    """The small pane pokes through the large one by a tenth of its depth."""
    large = [(-5, 8, -5), (5, 8, -5), (0, 8, 6)]
    small = [(-0.5, 7.1, -0.5), (0.5, 7.1, -0.5), (0, 8.1, 0.5)]
    for triangles, last in (([large, small], 1), ([small, large], 0)):
        result, sequence = ordered(triangles, lens)
        assert result.intersecting == 1
        assert sequence[-1] == last


@EVERY_LENS
def test_floor_and_ceiling_from_behind_the_eye(lens):
    """Both reach past the eye; panes stand below, between and above, in any order given."""
    floor = quad((-9, -5, -1), (9, -5, -1), (9, 90, -1.5), (-9, 90, -1.5))
    ceiling = quad((-9, -5, 1.5), (9, -5, 1.5), (9, 90, 1), (-9, 90, 1))
    panes = [
        quad((-2, y, z), (2, y + 1, z), (2, y + 1, z + h), (-2, y, z + h))
        for y, z, h in ((4, -3, 1.5), (5, -0.9, 1.5), (9, -0.8, 1.6), (6, 1.6, 1), (30, -8, 6), (40, 2, 8))
    ]
    triangles = np.concatenate((floor, *panes, ceiling))
    assert_exact(triangles, lens)
    assert_exact(triangles[::-1], lens)


def torus(around, across):
    """A tilted torus of triangles."""
    u, v = np.meshgrid(*(2.0 * np.pi * np.arange(k + 1) / k for k in (around, across)), indexing="ij")
    u[-1], v[:, -1] = 0.0, 0.0
    ring = 1.6 + 0.6 * np.cos(v)
    points = np.stack((ring * np.cos(u), ring * np.sin(u), 0.6 * np.sin(v)), axis=-1)
    points = points @ trimesh.transformations.rotation_matrix(0.9, (1.0, 0.3, 0.2))[:3, :3]
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))])


@EVERY_LENS
@pytest.mark.parametrize("shape", ["sphere", "torus", "two in each other", "bowl"])
def test_meshes_seen_through_are_exact(lens, shape):
    """Neighbours share edges and corners, and at the outline they fold over; inside and outside are seen."""
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=2.0).triangles
    smaller = trimesh.creation.icosphere(subdivisions=2, radius=1.1).triangles
    parts = {
        "sphere": [sphere],
        "torus": [torus(28, 12)],
        "two in each other": [sphere, smaller],
        "bowl": [sphere[(sphere @ (0.2, 0.1, -1.0) > -0.3).all(axis=1)]],
    }[shape]
    parts = [part + np.array((0.21, 5.3, -0.13)) for part in parts]
    groups = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    assert_exact(np.concatenate(parts), lens, groups)


@EVERY_LENS
def test_an_eye_within_a_sphere(lens):
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=7.0).triangles + np.array((0.3, 2.0, 0.1))
    inner = trimesh.creation.icosphere(subdivisions=2, radius=1.0).triangles + np.array((0.3, 4.0, 0.1))
    assert_exact(np.concatenate((sphere, inner)), lens)


@EVERY_LENS
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 20))
@settings(max_examples=20)
def test_things_in_one_plane_keep_the_given_order(lens, seed, count):
    """Of two that overlap in one plane the first given is drawn first, whatever their windings and depths."""
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    normal[1] += 0.5 * np.sign(normal[1])
    frame = np.linalg.svd(normal[None])[2][1:]
    triangles = rng.uniform(-3.0, 3.0, (count, 3, 2)) @ frame + (0.0, 6.0, 0.0)
    result, sequence = ordered(triangles.astype(np.float32), lens)
    assert (result.intersecting, result.in_circles) == (0, 0)
    seen = np.isfinite(triangle_distances(triangles, lens))
    for place, thing in enumerate(sequence):
        for earlier in sequence[:place]:
            assert earlier < thing or not (seen[earlier] & seen[thing]).any()


@EVERY_LENS
def test_nothing_and_one_thing(lens):
    result, sequence = ordered(np.empty((0, 3, 3)), lens)
    assert len(sequence) == 0
    assert result.runs.tolist() == [0]
    assert list(order_warnings(result)) == []
    result, sequence = ordered([[(0, 5, 0), (1, 5, 0), (0, 5, 1)]], lens)
    assert sequence.tolist() == [0]
    assert result.runs.tolist() == [0, 1]


def test_forty_panes_in_forty_groups_make_forty_draws():
    """Each pane of two triangles keeps them together, though others' are at the same distances."""
    panes = [quad((-2, y, -2), (2, y + 3, -2), (2, y + 3, 2), (-2, y, 2)) for y in np.linspace(20.0, 5.0, 40)]
    result, _ = ordered(np.concatenate(panes), PERSPECTIVE, np.repeat(np.arange(40), 2))
    assert len(result.runs) - 1 == 40


def test_things_that_are_free_are_drawn_with_their_groups():
    """Two spheres side by side, at the same distances: the start order mixes them, two draws do."""
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=1.0).triangles
    triangles = np.concatenate([sphere + np.array((x, 6.0, 0.1)) for x in (-1.2, 1.2)])
    groups = np.repeat([7, 3], len(sphere))
    _, sequence = assert_exact(triangles, PERSPECTIVE, groups)
    result, _ = ordered(triangles, PERSPECTIVE, groups)
    assert result.runs.tolist() == [0, len(sphere), 2 * len(sphere)]
    assert len(set(groups[sequence[: len(sphere)]])) == 1


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_runs_are_those_of_equal_groups(seed):
    rng = np.random.default_rng(seed)
    groups = rng.integers(-2, 3, 30)
    result, sequence = ordered(slabs(rng, 30), PERSPECTIVE, groups)
    own = groups[sequence]
    assert result.runs[-1] == len(own)
    for begin, end in zip(result.runs[:-1], result.runs[1:], strict=True):
        assert len(set(own[begin:end])) == 1
        assert end == len(own) or own[end] != own[begin]


def test_too_many_pairs_are_sorted_by_their_farthest_points(monkeypatch):
    monkeypatch.setattr(order_module, "MOST_PAIRS", 10)
    polygons = triangles_on_screen(slabs(np.random.default_rng(3), 40), 0, PERSPECTIVE, NEAR, FAR)
    result = paint_order(polygons, no_discs(PERSPECTIVE))
    assert result.approximate
    assert (np.diff(polygons.farthest[result.order]) <= 0.0).all()
    assert "more than 10 pairs may overlap" in next(order_warnings(result))

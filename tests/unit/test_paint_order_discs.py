"""Particles and sprites, which are discs that face the camera, are drawn between blended triangles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.plan.blending import order as order_module
from firefly_sample.plan.blending.order import order_warnings, paint_order
from firefly_sample.plan.blending.polygons import discs_on_screen, triangles_on_screen
from tests.painter import (
    FAR,
    LENSES,
    NEAR,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    disc_distances,
    triangle_distances,
    wrong_pairs,
)

EVERY_LENS = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)


def ordered(triangles, positions, radii, adds, lens):
    """The paint order, what pixels see of each thing, the sequence of given rows, and which add light."""
    triangles = np.reshape(triangles, (-1, 3, 3))
    polygons = triangles_on_screen(triangles, 0, lens, NEAR, FAR)
    discs = discs_on_screen(positions, radii, adds, 1, lens, NEAR, FAR)
    result = paint_order(polygons, discs)
    assert np.array_equal(np.sort(result.order), np.arange(len(polygons) + len(discs)))
    rows = np.concatenate((polygons.sources, len(triangles) + discs.sources))
    radii = np.broadcast_to(radii, len(positions))
    distances = np.concatenate((triangle_distances(triangles, lens), disc_distances(positions, radii, lens)))
    seen = np.flatnonzero(np.isfinite(distances).any(axis=1))
    sequence = rows[result.order]
    assert set(seen) <= set(sequence)
    flags = np.append(np.zeros(len(triangles), dtype=bool), np.broadcast_to(adds, len(positions)))
    return result, distances, sequence, flags


def leaning(y, lean, x=0.0):
    """A large pane of two triangles, `y` away at the middle, whose top is `lean` farther than its foot."""
    a, b, c, d = (
        (x + u, y + v * lean, v * 4.0) for u, v in ((-4.0, -0.5), (4.0, -0.5), (4.0, 0.5), (-4.0, 0.5))
    )
    return [(a, b, c), (a, c, d)]


def between(rng, count, lean, gaps):
    """Upright discs between panes that lean, which touch none of them."""
    z, x = rng.uniform(-1.5, 1.5, count), rng.uniform(-3.0, 3.0, count)
    radii = rng.uniform(0.05, 0.3, count)
    middle = rng.choice(gaps, count) + lean * z / 4.0
    # a disc of radius r spans lean*r/4 of a pane's distance
    slack = 0.5 - abs(lean) * radii / 4.0 - 0.02
    return np.stack((x, middle + rng.uniform(-1.0, 1.0, count) * slack, z), axis=1), radii


@EVERY_LENS
@pytest.mark.parametrize("chains", [False, True])
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 60), lean=st.floats(-4.0, 4.0))
@settings(max_examples=15)
def test_discs_between_leaning_panes_are_exact(lens, chains, seed, count, lean):
    """Near discs lie behind panes whose tops lean forwards, and far discs before them."""
    rng = np.random.default_rng(seed)
    panes = [triangle for y in (5.0, 6.0, 7.0) for triangle in leaning(y, lean)]
    positions, radii = between(rng, count, lean, (4.5, 5.5, 6.5, 7.5))
    adds = rng.random(count) < 0.5
    with pytest.MonkeyPatch.context() as patch:
        if chains:
            patch.setattr(order_module, "MOST_DISC_PAIRS", 0)
        result, distances, sequence, flags = ordered(panes, positions, radii, adds, lens)
    assert (result.intersecting, result.cut_discs, result.approximate) == (0, 0, False)
    if not chains:  # which also order discs that do not overlap, and so may close a circle
        assert (result.in_circles, result.discs_in_circles) == (0, 0)
    if not result.in_circles:
        assert wrong_pairs(distances, sequence, flags) == set()


@EVERY_LENS
def test_the_order_of_distances_is_wrong_where_ours_is_right(lens):
    """The disc below is nearer than the one above, yet behind the pane, and the one above is before it."""
    panes = leaning(8.0, -6.0)
    positions = np.array([(0.0, 9.8, -1.0), (0.0, 6.2, 1.0)])
    swapped = positions * (1.0, 1.0, -1.0)  # before the pane below, behind it above
    for places, behind in ((positions, True), (swapped, False)):
        places = places[::-1] if behind else places
        _, distances, sequence, flags = ordered(panes, places, 0.1, False, lens)
        assert wrong_pairs(distances, sequence, flags) == set()
    near_but_behind = np.array([(0.0, 6.9, 1.2), (0.0, 8.9, -1.2)])
    _, distances, sequence, flags = ordered(panes, near_but_behind, 0.1, False, lens)
    assert wrong_pairs(distances, sequence, flags) == set()
    by_distance = [3, 0, 1, 2]
    assert wrong_pairs(distances, by_distance, flags)


@EVERY_LENS
def test_discs_alone_are_sorted_by_distance_and_equal_ones_keep_their_order(lens):
    rng = np.random.default_rng(5)
    positions = np.stack((rng.normal(size=50), rng.integers(2, 9, 50), rng.normal(size=50)), axis=1)
    _, distances, sequence, _ = ordered([], positions, 0.8, False, lens)
    expected = np.argsort(-positions[:, 1], kind="stable")
    kept = np.isin(expected, sequence)
    assert sequence.tolist() == expected[kept].tolist()
    assert wrong_pairs(distances, sequence) == set()


@EVERY_LENS
def test_a_disc_that_a_pane_cuts_is_counted(lens):
    """The pane passes through the middle of the first disc, and behind the second one."""
    pane = [[(-4.0, 6.0, -4.0), (4.0, 6.0, -4.0), (0.0, 8.0, 4.0)]]
    result, *_ = ordered(pane, np.array([(0.0, 7.0, 0.0)]), 0.5, False, lens)
    assert (result.intersecting, result.cut_discs, result.in_circles) == (0, 1, 0)
    assert list(order_warnings(result)) == []
    result, *_ = ordered(pane, np.array([(0.0, 7.6, 0.0)]), 0.5, False, lens)
    assert result.cut_discs == 0


def test_only_the_circle_within_a_square_counts():
    """A pane that leans to the side meets the disc's plane in its square's corner, outside the circle."""
    # y = 8 + x + z: at the distance 10 that is the line x + z = 2, which is sqrt(2) from the middle
    corners = [(x, 8.0 + x + z, z) for x, z in ((-5.0, -1.5), (5.0, -5.0), (0.0, 6.0))]
    for radius, cut in ((1.41, 0), (1.42, 1)):
        result, *_ = ordered([corners], np.array([(0.0, 10.0, 0.0)]), radius, False, ORTHOGRAPHIC)
        assert result.cut_discs == cut


def test_a_corner_of_a_pane_counts_only_within_the_circle():
    """The pane's corner is beside the disc: they do not overlap, and the start order stays."""

    def run(reach):
        corner = np.array([(reach, 4.0, reach), (5.0, 4.0, reach), (reach, 4.0, 5.0)])
        polygons = triangles_on_screen(corner, 0, ORTHOGRAPHIC, NEAR, FAR)
        discs = discs_on_screen([(0.0, 5.0, 0.0)], 1.0, False, 0, ORTHOGRAPHIC, NEAR, FAR)
        edges = order_module._polygon_edges(polygons, discs)
        return len(edges.before)

    assert run(0.708) == 0
    assert run(0.706) == 1


def test_sprites_among_themselves_are_free_and_stay_in_one_draw():
    """Sprites only add light, so that two groups of them are two draws; those of particles alternate."""
    rng = np.random.default_rng(8)
    positions = np.stack((rng.normal(size=400), rng.uniform(3.0, 4.0, 400), rng.normal(size=400)), axis=1)
    groups = rng.integers(0, 2, 400)
    nothing = triangles_on_screen(np.empty((0, 3, 3)), 0, PERSPECTIVE, NEAR, FAR)
    result = paint_order(nothing, discs_on_screen(positions, 1.0, True, groups, PERSPECTIVE, NEAR, FAR))
    assert len(result.runs) - 1 == 2
    mixed = paint_order(nothing, discs_on_screen(positions, 1.0, False, groups, PERSPECTIVE, NEAR, FAR))
    assert len(mixed.runs) - 1 > 100


@EVERY_LENS
def test_discs_out_of_view_are_left_out(lens):
    """One step to a side, before the near plane and beyond the far one; a rim that reaches in is kept."""
    edge = lens.view_from_distance(np.array([1.0, -1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0, -1.0]), 4.0)
    away = np.array([(1.0, 0, 0), (-1.0, 0, 0), (0, 0, 1.0), (0, 0, -1.0)])
    kept = discs_on_screen(edge + 0.99 * away, 1.0, False, 0, lens, NEAR, FAR)
    assert kept.sources.tolist() == [0, 1, 2, 3]
    assert len(discs_on_screen(edge + 1.01 * away, 1.0, False, 0, lens, NEAR, FAR)) == 0
    depths = [(0.0, y, 0.0) for y in (-1.0, 0.9 * NEAR, 1.1 * NEAR, 0.9 * FAR, 1.1 * FAR)]
    assert discs_on_screen(depths, 0.01, False, 0, lens, NEAR, FAR).sources.tolist() == [2, 3]

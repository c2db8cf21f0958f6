"""What the cells of clusters hold: every light that reaches a pixel, and little else."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.plan.lights import clusters as module
from firefly_sample.plan.lights.bounds import screen_bounds
from firefly_sample.plan.lights.clusters import (
    cell_lights,
    cell_masks,
    find_clusters,
    list_lengths,
    make_grid,
    plan_clusters,
    slices_of,
)
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.light import Falloff

SIZE = (200, 120)


def view_of(lens, size=SIZE):
    return View(
        size, lens.constants("zero_to_one", True), True, lens.get_near(), lens.get_far(), np.eye(4), np.eye(4)
    )


def perspective(fov=50.0, near=0.5, far=200.0, shift=(0.0, 0.0)):
    lens = PerspectiveLens(fov=(fov, fov * 0.6), near=near, far=far)
    if any(shift):
        lens.set_film_offset(*shift)
    return lens


def balls(places, reaches):
    places = np.asarray(places, dtype=np.float64).reshape(-1, 3)
    reaches = np.broadcast_to(np.asarray(reaches, dtype=np.float64), len(places))
    return LightSet.make(
        "point", Falloff.RAMP_SQUARED, np.ones((len(places), 3)), positions=places, reaches=np.array(reaches)
    )


def cones(places, reaches, axes, degrees):
    axes = np.asarray(axes, dtype=np.float64)
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    openings = 2.0 * np.sin(np.radians(degrees) / 2.0) ** 2
    return LightSet.make(
        "spot",
        Falloff.ATTENUATION,
        np.ones((len(axes), 3)),
        positions=np.asarray(places, dtype=np.float64),
        reaches=np.asarray(reaches, dtype=np.float64),
        directions=axes,
        cones=np.stack([0.0 * openings, openings, 0.0 * openings], axis=1),
    )


def points_of(view, column, row, y):
    """View-space places behind pixels, counted from the lower left."""
    width, height = view.size
    return view.lens.view_from_distance(
        (column + 0.5) / (width / 2) - 1.0, (row + 0.5) / (height / 2) - 1.0, y
    )


def reached(lights, places):
    """Which lights reach which places, shape (places, lights): the plain definition."""
    way = places[:, None] - lights.positions[None]
    distance = np.linalg.norm(way, axis=2)
    inside = distance < lights.reaches
    if lights.kind == "spot":
        along = np.einsum("plc,lc->pl", way, lights.directions)
        inside &= along >= (1.0 - lights.cones[:, 1]) * distance
    return inside


LENSES = st.one_of(
    st.builds(
        perspective,
        st.sampled_from([0.1, 20.0, 50.0, 120.0, 170.0]),
        st.sampled_from([1e-3, 0.5, 5.0]),
        st.sampled_from([50.0, 1e4, np.inf]),
        st.sampled_from([(0.0, 0.0), (0.3, -0.2)]),
    ),
    st.builds(
        lambda width, near: OrthographicLens(film_size=(width, 0.6 * width), near=near, far=200.0),
        st.sampled_from([1.0, 30.0]),
        st.sampled_from([-20.0, 1.0]),
    ),
)


@settings(max_examples=150, deadline=None)
@given(LENSES, st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([1, 40, 200]))
def test_no_cell_lacks_a_light_that_reaches_one_of_its_pixels(lens, seed, spots, count):
    """Lights in view and beside it, across both planes, around the eye, tiny, huge and endless."""
    rng = np.random.default_rng(seed)
    view = view_of(lens)
    low, high = max(view.near, -20.0), min(view.far, 400.0)
    y = rng.uniform(low - 2.0, high + 2.0, count)
    spread = (
        np.maximum(np.abs(y), 1.0) / view.lens.a if view.lens.perspective else np.full(count, 1 / view.lens.a)
    )
    places = np.stack([rng.normal(0, 1, count) * spread, y, 0.6 * rng.normal(0, 1, count) * spread], axis=1)
    reaches = 10.0 ** rng.uniform(-2, 2.5, count)
    reaches[rng.random(count) < 0.03] = np.inf
    axes, degrees = (
        rng.normal(size=(count, 3)),
        rng.choice([0.05, 3.0, 20.0, 53.0, 90.0, 140.0, 180.0], count),
    )
    lights = cones(places, reaches, axes, degrees) if spots else balls(places, reaches)
    nearest, farthest = sorted(rng.uniform(low, high, 2))
    (cells,) = plan_clusters([lights], view, nearest, farthest)

    many = 400
    column, row = rng.integers(0, SIZE[0], many), rng.integers(0, SIZE[1], many)
    depth = rng.uniform(nearest, farthest, many)
    inside = reached(lights, points_of(view, column, row, depth))
    for i in np.flatnonzero(inside.any(axis=1)):
        held = cell_lights(cells, int(column[i]), int(row[i]), float(np.float32(depth[i])))
        missing = set(np.flatnonzero(inside[i])) - set(held)
        assert not missing, (column[i], row[i], depth[i], missing)
    lengths = list_lengths(cells, column, row, depth)
    few = range(0, many, 20)
    assert [len(cell_lights(cells, int(column[i]), int(row[i]), depth[i])) for i in few] == list(lengths[few])


@pytest.mark.parametrize(
    "lens", [perspective(), OrthographicLens(film_size=(30.0, 18.0), near=1.0, far=60.0)]
)
def test_a_ball_has_few_cells_more_than_it_meets(lens):
    """At most half as many pixels again as it covers, where cells are small against it."""
    view = view_of(lens, (800, 480))
    lights = balls([(1.0, 20.0, -1.0)], 5.0)
    (cells,) = plan_clusters([lights], view, 2.0, 50.0)
    rng = np.random.default_rng(0)
    column, row = rng.integers(0, 800, 40_000), rng.integers(0, 480, 40_000)
    depth = rng.uniform(14.0, 26.0, 40_000)
    pairs = reached(lights, points_of(view, column, row, depth)).sum()
    held = list_lengths(cells, column, row, depth).sum()
    assert pairs <= held <= 1.5 * pairs


def test_a_narrow_cone_is_a_cone_and_not_the_ball_around_it():
    view = view_of(perspective(), (800, 480))
    lights = cones([(-6.0, 20.0, -2.0)], [16.0], [(1.0, 0.3, 0.4)], np.array([8.0]))
    (cells,) = plan_clusters([lights], view, 2.0, 50.0)
    (round_about,) = plan_clusters([balls(lights.positions, lights.reaches)], view, 2.0, 50.0)
    rng = np.random.default_rng(0)
    column, row = rng.integers(0, 800, 200_000), rng.integers(0, 480, 200_000)
    depth = rng.uniform(15.0, 30.0, 200_000)
    pairs = reached(lights, points_of(view, column, row, depth)).sum()
    held = list_lengths(cells, column, row, depth).sum()
    assert 100 < pairs <= held <= 5 * pairs
    assert held <= 0.1 * list_lengths(round_about, column, row, depth).sum()


@pytest.mark.parametrize("spots", [False, True])
def test_what_lies_beside_the_view_is_in_no_cell(spots):
    view = view_of(perspective())
    places = [(100.0, 20.0, 0.0), (0.0, -30.0, 0.0), (0.0, 300.0, 0.0)]
    lights = cones(places, [5.0] * 3, [(1, 0, 0)] * 3, np.full(3, 30.0)) if spots else balls(places, 5.0)
    cells = plan_clusters([lights], view, 1.0, 250.0)
    for one in cells:
        columns, rows = one.grid.tiles
        assert not cell_masks(one, np.arange(columns), np.arange(rows)[:, None]).any()


def test_without_surfaces_or_without_lights_there_is_nothing():
    view = view_of(perspective())
    assert plan_clusters([balls([(0, 10, 0)], 5.0)], view, math.inf, -math.inf) == ()
    assert plan_clusters([], view, 1.0, 50.0) == ()
    sun = LightSet.make("directional", Falloff.ATTENUATION, np.ones((1, 3)))
    assert plan_clusters([sun], view, 1.0, 50.0) == ()


def test_many_lights_make_cells_larger_and_lose_none(monkeypatch):
    rng = np.random.default_rng(3)
    lights = balls(rng.uniform((-8, 5, -5), (8, 40, 5), (3000, 3)), 4.0)
    view = view_of(perspective(), (800, 480))
    fine = make_grid([lights], view, 4.0, 45.0)
    monkeypatch.setattr(module, "MOST_WORDS", 20_000)
    coarse = make_grid([lights], view, 4.0, 45.0)
    assert coarse.tile > fine.tile
    assert coarse.slices < fine.slices
    cells = find_clusters(lights, coarse, view)
    assert cells.masks.size <= 20_000
    column, row = rng.integers(0, 800, 300), rng.integers(0, 480, 300)
    depth = rng.uniform(5.0, 40.0, 300)
    inside = reached(lights, points_of(view, column, row, depth))
    for i in range(300):
        held = cell_lights(cells, int(column[i]), int(row[i]), depth[i])
        assert set(np.flatnonzero(inside[i])) <= set(held)


@pytest.mark.parametrize(
    ("limit", "most"),
    [
        ("MOST_WORDS", 30_000),
        ("MOST_RECORDS", 4096),
        ("MOST_WORDS_PER_LINE", 128),
        ("MOST_WORDS_PER_LINE", 64),
    ],
)
@pytest.mark.parametrize("count", [3, 1000])
def test_words_keep_to_every_limit(monkeypatch, limit, most, count):
    """Those of few lights in many slices too, each of which begins with a whole texel."""
    rng = np.random.default_rng(3)
    lights = balls(rng.uniform((-8, 5, -5), (8, 40, 5), (count, 3)), 4.0)
    view = view_of(perspective(), (800, 480))
    monkeypatch.setattr(module, limit, most)
    (cells,) = plan_clusters([lights], view, 4.0, 45.0)
    taken = {
        "MOST_WORDS": cells.masks.size,
        "MOST_RECORDS": len(cells.members),
        "MOST_WORDS_PER_LINE": cells.masks.shape[1],
    }
    assert taken[limit] <= most


@pytest.mark.parametrize("size", [(1600, 1200), (800, 600), (80, 60)])
def test_a_larger_picture_has_more_tiles_and_the_same_slices(size):
    lights = balls([(0, 20, 0)], 15.0)
    one = make_grid([lights], view_of(perspective(), (400, 300)), 1.0, 50.0)
    grid = make_grid([lights], view_of(perspective(), size), 1.0, 50.0)
    assert np.array_equal(grid.edges, one.edges)
    assert (grid.tile, grid.tiles) == (8, (size[0] // 8, math.ceil(size[1] / 8)))


def test_a_cell_has_no_limit():
    view = view_of(perspective())
    lights = balls(np.tile([0.0, 20.0, 0.0], (5000, 1)), 3.0)
    (cells,) = plan_clusters([lights], view, 1.0, 50.0)
    assert np.array_equal(cell_lights(cells, 100, 60, 20.0), np.arange(5000))


def test_more_lights_than_a_shader_walks_come_in_parts():
    view = view_of(perspective())
    lights = balls(np.tile([0.0, 20.0, 0.0], (40_000, 1)), 3.0)
    parts = plan_clusters([lights], view, 1.0, 50.0)
    assert [len(part.lights) for part in parts] == [32768, 7232]


@settings(max_examples=50, deadline=None)
@given(LENSES, st.integers(0, 2**32 - 1))
def test_slices_take_in_all_that_lights_and_surfaces_share(lens, seed):
    rng = np.random.default_rng(seed)
    view = view_of(lens)
    y = rng.uniform(-10.0, 150.0, 5)
    reaches = rng.uniform(0.1, 30.0, 5)
    lights = balls(np.stack([np.zeros(5), y, np.zeros(5)], axis=1), reaches)
    nearest, farthest = sorted(rng.uniform(1.0, 100.0, 2))
    edges = make_grid([lights], view, nearest, farthest).edges
    assert (np.diff(edges) > 0).all()
    assert np.array_equal(edges, edges.astype(np.float32))
    # a rasterizer may put what is steep a little beyond the planes and beyond what holds it
    low = max(0.9995 * nearest, 0.6 * view.near, (y - reaches).min())
    high = min(1.0005 * farthest, 1.9 * view.far, (y + reaches).max())
    if low < high:
        assert edges[0] < low
        assert high < edges[-1]


def test_bounds_on_the_screen_are_those_of_a_ball():
    """Seen from the front, to the width of what perspective adds: tangents from the eye."""
    view = view_of(perspective())
    lights = balls([(0.0, 20.0, 0.0)], 4.0)
    (low, high), _ = screen_bounds(lights, view)
    tangent = math.tan(math.asin(4.0 / 20.0))
    middle, scale = SIZE[0] / 2, SIZE[0] / 2 * view.lens.a
    assert low[0] <= middle - scale * tangent
    assert high[0] >= middle + scale * tangent
    assert high[0] - low[0] <= 1.3 * 2 * scale * tangent


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([1, 2, 30, 96]), st.floats(1e-4, 1e3))
def test_slices_are_those_that_a_search_finds(seed, perspective, slices, deep):
    """By arithmetic, and yet to the last bit: ends on edges, beside them, outside of all, without end."""
    rng = np.random.default_rng(seed)
    low = rng.uniform(0.01, 5.0)
    edges = (
        low * (1.0 + deep) ** (np.arange(slices + 1) / slices)
        if perspective
        else np.linspace(low, low + deep, slices + 1)
    )
    edges = edges.astype(np.float32).astype(np.float64)
    ends = np.concatenate(
        [
            rng.choice(edges, 200),
            np.nextafter(rng.choice(edges, 200), rng.choice([-np.inf, np.inf], 200)),
            rng.uniform(edges[0] - deep, edges[-1] + deep, 200),
            [-1e30, 1e30, 0.0, -1.0, np.inf, -np.inf],
        ]
    )
    one, other = rng.permutation(ends), rng.permutation(ends)
    first, last = np.minimum(one, other), np.maximum(one, other)
    begin = np.searchsorted(edges, first, side="right") - 1
    end = np.searchsorted(edges, last, side="left") - 1
    meets = (end >= 0) & (begin < slices)
    begin, end = np.clip(begin, 0, slices - 1), np.clip(end, 0, slices - 1)
    found, counts = slices_of(edges, first, last, perspective)
    assert np.array_equal(counts, np.where(meets, end - begin + 1, 0))
    assert np.array_equal(found[meets], begin[meets])

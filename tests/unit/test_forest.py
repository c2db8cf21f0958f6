"""The forest scene: enough of it, nothing floats or intersects, and its parameters act."""

from __future__ import annotations

import gc
import hashlib
import math
import weakref
from collections import Counter

import numpy as np
import pytest

from firefly_sample.assets import asset_dir
from firefly_sample.errors import ParameterError
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import AmbientLight, PointLights
from firefly_sample.scene.parameter import KeyStep
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.traversal import iter_visible
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.forest import REACH, ForestScene
from firefly_sample.scenes.forest_layout import (
    _FALLEN_FEET,
    CAMERA,
    SPECIES,
    X_RANGE,
    Y_RANGE,
    clearing_distance,
    ground_height,
    ground_slope,
    place_forest,
)


@pytest.fixture(scope="module")
def forest() -> ForestScene:
    """One forest without fireflies; tests must leave it as it is."""
    return ForestScene(fireflies=0)


def lights_of(scene: ForestScene) -> PointLights:
    (node,) = [v.node for v in iter_visible(scene.root) if isinstance(v.node, PointLights)]
    return node


def world_points(scene: ForestScene, cut_out: bool):
    """For each placement: it, and the world positions of its solid (or leaf) vertices."""
    for kind in ("tree", "bush", "prop", "grass"):
        placements = [p for p in place_forest() if SPECIES[p.species].kind == kind]
        paths = scene.root.find(kind).get_children()
        assert len(paths) == len(placements)
        for path, placement in zip(paths, placements, strict=True):
            assert path.get_name() == placement.species
            geoms = [g.vertices for g, m in path.node().geoms if (m.alpha_mode == "mask") == cut_out]
            matrix = np.asarray(path.get_mat(scene.root))
            for vertices in geoms:
                yield placement, vertices @ matrix[:3, :3] + matrix[3, :3]


def test_triangles_and_kinds(forest: ForestScene) -> None:
    nodes = [visit.node for visit in iter_visible(forest.root) if isinstance(visit.node, GeomNode)]
    assert sum(len(geom.triangles) for node in nodes for geom, _ in node.geoms) >= 64_000
    trees_and_bushes = {node.name for node in nodes} & {
        name for name, species in SPECIES.items() if species.kind in ("tree", "bush")
    }
    assert len(trees_and_bushes) >= 9
    assert {"terrain", "stump", "rock", "fly agaric", "grass"} <= {node.name for node in nodes}


def test_triangles_in_view(forest: ForestScene) -> None:
    batches = build_plan(forest).batches
    drawn = sum(len(batch.geom.triangles) * len(batch.model_to_view) for batch in batches)
    assert 64_000 <= drawn <= 160_000


def test_repeated_models_share_geoms(forest: ForestScene) -> None:
    nodes = [visit.node for visit in iter_visible(forest.root) if isinstance(visit.node, GeomNode)]
    shown = Counter(node.name for node in nodes)
    assert shown["grass"] > 100
    for name in shown:
        assert len({tuple(id(g) for g, _ in node.geoms) for node in nodes if node.name == name}) == 1


def test_models_are_under_20_megabytes() -> None:
    sizes = {path.name: path.stat().st_size for path in asset_dir("models").glob("*.glb")}
    assert {f"{species.file}.glb" for species in SPECIES.values()} | {"terrain.glb"} <= set(sizes)
    assert sum(sizes.values()) < 20e6


def test_the_layout_is_the_one_that_the_terrain_was_darkened_under() -> None:
    """To a hundredth of a millimetre, if a unit is a metre; see models/builder/terrain.py."""
    lines = [
        f"{p.species} {p.x:.5f} {p.y:.5f} {p.z:.5f} {p.heading:.4f} {p.pitch:.4f} {p.roll:.4f} {p.scale:.6f}"
        for p in place_forest()
    ]
    assert lines[1] == "pine -39.00000 -118.00000 2.45173 40.0000 -0.0000 0.0000 1.000000"
    digest = hashlib.sha256("\n".join(lines).encode()).hexdigest()
    assert digest == "c031b2802afdd208ae01b6b99ef91456b769ab75248a1b5b2fc514ea8fcacb23"


def test_layout_is_the_same_every_time() -> None:
    first = place_forest()
    place_forest.cache_clear()
    assert place_forest() == first
    assert len(first) > 500


def test_terrain_follows_the_height_function(forest: ForestScene) -> None:
    ((geom, _),) = forest.root.find("terrain").node().geoms
    x, y, z = geom.vertices.T
    # glTF holds float32.
    np.testing.assert_allclose(z, ground_height(x, y), atol=1e-4)
    assert (x.min(), x.max(), y.min(), y.max()) == (*X_RANGE, *Y_RANGE)
    slope_x, slope_y = ground_slope(x, y)
    expected = np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(geom.normals, expected, atol=1e-5)
    middles = geom.vertices[geom.triangles].mean(axis=1)
    off = np.abs(middles[:, 2] - ground_height(middles[:, 0], middles[:, 1]))
    assert off[clearing_distance(middles[:, 0], middles[:, 1]) < 1.3].max() < 0.2
    assert off.max() < 1.0


def test_nothing_floats(forest: ForestScene) -> None:
    for placement, points in world_points(forest, cut_out=False):
        if placement.species == "stump" and points[:, 2].min() > placement.z + 2.0:
            continue  # the cut face and the axe stand on the stump
        over = points[:, 2] - ground_height(points[:, 0], points[:, 1])
        lowest = over[points[:, 2] < points[:, 2].min() + 0.05]
        assert lowest.max() < -0.1, placement
        assert over.max() > 0.3, placement
    for placement in place_forest():
        sunk = placement.z - float(ground_height(placement.x, placement.y))
        assert -2.0 < sunk <= -0.05, placement


def test_the_fallen_trunk_lies_along_its_whole_length(forest: ForestScene) -> None:
    path = forest.root.find("prop/fallen trunk")
    matrix = np.asarray(path.get_mat(forest.root))
    bark = path.node().geoms[0][0].vertices
    points = bark @ matrix[:3, :3] + matrix[3, :3]
    over = points[:, 2] - ground_height(points[:, 0], points[:, 1])
    rings = np.round(bark[:, 0] / 4.0).astype(int)
    assert np.ptp(rings) >= 10
    for ring in np.unique(rings[:140]):
        assert over[rings == ring].min() < -0.05
        assert over[rings == ring].max() > 1.0


def test_leaves_and_blades_are_above_the_ground(forest: ForestScene) -> None:
    for placement, points in world_points(forest, cut_out=True):
        over = points[:, 2] - ground_height(points[:, 0], points[:, 1])
        assert np.quantile(over, 0.5) > 0.3, placement
        assert (over < -2.0).mean() < 0.02, placement


def test_feet_cover_what_touches_the_ground(forest: ForestScene) -> None:
    for placement, points in world_points(forest, cut_out=False):
        if placement.species == "fallen trunk":
            continue
        over = points[:, 2] - ground_height(points[:, 0], points[:, 1])
        near = points[(over > -0.3) & (over < 1.2)]
        if len(near):
            reach = np.hypot(near[:, 0] - placement.x, near[:, 1] - placement.y).max()
            assert reach <= placement.foot + 0.05, placement


def test_no_two_feet_intersect() -> None:
    discs = [(p.x, p.y, p.foot) for p in place_forest() if p.foot > 0.0]
    discs = np.array([*discs, *_FALLEN_FEET])
    gaps = np.hypot(*(discs[:, None, k] - discs[None, :, k] for k in (0, 1)))
    gaps -= discs[:, None, 2] + discs[None, :, 2]
    own = np.arange(len(discs))
    gaps[own, own] = np.inf
    gaps[-len(_FALLEN_FEET) :, -len(_FALLEN_FEET) :] = np.inf
    assert gaps.min() >= 0.0


def test_grass_keeps_off_feet() -> None:
    discs = np.array([*((p.x, p.y, p.foot) for p in place_forest() if p.foot > 0.0), *_FALLEN_FEET])
    for tuft in (p for p in place_forest() if SPECIES[p.species].kind == "grass"):
        assert (np.hypot(discs[:, 0] - tuft.x, discs[:, 1] - tuft.y) - discs[:, 2]).min() > 0.0


def test_everything_is_on_the_terrain_and_behind_the_near_plane(forest: ForestScene) -> None:
    for placement in place_forest():
        assert X_RANGE[0] + 5.0 < placement.x < X_RANGE[1] - 5.0, placement
        assert Y_RANGE[0] + 5.0 < placement.y < Y_RANGE[1] - 5.0, placement
    for cut_out in (False, True):
        for placement, points in world_points(forest, cut_out):
            assert np.linalg.norm(points - np.array(CAMERA), axis=1).min() > 50.0, placement


def test_camera_and_lens_are_the_originals(forest: ForestScene) -> None:
    np.testing.assert_allclose(np.array(forest.camera.get_pos()), [-9.112, -211.077, 46.951])
    np.testing.assert_allclose(np.array(forest.camera.get_hpr()), [0.0, -7.5, 2.4], atol=1e-9)
    lens = forest.lens
    assert (lens.get_near(), lens.get_far()) == (50.0, 500.0)
    assert math.isclose(lens.get_aspect_ratio(), 4.0 / 3.0, rel_tol=1e-4)
    assert math.isclose(lens.get_vfov(), 30.0, rel_tol=1e-6)


def test_no_fireflies_and_many(forest: ForestScene) -> None:
    assert len(lights_of(forest).evaluate(0.0)) == 0
    assert build_plan(forest).counts.in_scene == 0
    assert build_plan(ForestScene()).counts.in_scene == 500


def test_lights_are_the_fireflies() -> None:
    scene = ForestScene(seed=3, fireflies=40, firefly_size=1.5)
    state = scene.fireflies.at(2.5)
    arrays = lights_of(scene).evaluate(2.5)
    np.testing.assert_array_equal(arrays.positions, state.positions)
    np.testing.assert_allclose(arrays.radii, 25.0 * 1.1 * 1.5 * state.sizes, rtol=1e-12)
    assert REACH == 25.0 * 1.1
    np.testing.assert_allclose(arrays.colors, state.colors, rtol=0)


def test_more_fireflies_never_move_the_first_ones() -> None:
    few, many = ForestScene(fireflies=30), ForestScene(fireflies=600)
    for time in (0.0, 11.3):
        a, b = lights_of(few).evaluate(time), lights_of(many).evaluate(time)
        np.testing.assert_array_equal(a.positions, b.positions[:30])
        np.testing.assert_array_equal(a.colors, b.colors[:30])
        np.testing.assert_array_equal(a.radii, b.radii[:30])


def test_live_parameters() -> None:
    scene = ForestScene(fireflies=10)
    lights = lights_of(scene)
    before = lights.evaluate(1.0)
    scene.set("fireflies", 25)
    assert len(lights.evaluate(1.0)) == 25
    scene.set("fireflies", 10)
    scene.set("firefly_size", 2.0)
    np.testing.assert_allclose(lights.evaluate(1.0).radii, 2.0 * before.radii, rtol=1e-12)
    scene.set("seed", 8)
    assert not np.array_equal(lights.evaluate(1.0).positions, before.positions)
    scene.set("seed", 7)
    np.testing.assert_array_equal(lights.evaluate(1.0).positions, before.positions)


def test_ambient_zero_is_black() -> None:
    scene = ForestScene(fireflies=0)
    (moon,) = [v.node for v in iter_visible(scene.root) if isinstance(v.node, AmbientLight)]
    full = moon.get_color().copy()
    assert full.min() > 0.0
    scene.set("ambient", 0.5)
    np.testing.assert_allclose(moon.get_color(), 0.5 * full, rtol=1e-12)
    names = {v.node.name for v in iter_visible(scene.root) if isinstance(v.node, Sprites)}
    assert names == {"haze", "insects"}
    scene.set("ambient", 0.0)
    assert not moon.get_color().any()
    assert scene.background.horizon == scene.background.zenith == (0.0, 0.0, 0.0)
    names = {v.node.name for v in iter_visible(scene.root) if isinstance(v.node, Sprites)}
    assert names == {"insects"}
    scene.set("ambient", 1.0)
    np.testing.assert_array_equal(moon.get_color(), full)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fireflies", -1),
        ("fireflies", 2.5),
        ("firefly_size", 0.0),
        ("ambient", math.nan),
        ("seed", -3),
        ("trees", 4),
    ],
)
def test_wrong_parameters(forest: ForestScene, name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=name):
        forest.set(name, value)
    with pytest.raises(ParameterError, match=name):
        build_scene(find_scene("forest"), **{name: value})


def test_plugin_declares_its_keys() -> None:
    plugin = find_scene("forest")
    parameters = {parameter.name: parameter for parameter in plugin.parameters}
    assert list(parameters)[:3] == ["seed", "fireflies", "firefly_size"]
    assert all(parameter.live for parameter in parameters.values())

    def keys(name: str) -> dict[str, KeyStep]:
        return {key.key: key for key in parameters[name].keys}

    assert (keys("fireflies")["up"].factor, keys("fireflies")["down"].factor) == (1.111, 0.9)
    assert (keys("firefly_size")["right"].factor, keys("firefly_size")["left"].factor) == (1.111, 0.9)
    assert parameters["fireflies"].default == 500
    assert parameters["seed"].default == 7


def test_a_scene_that_nobody_holds_is_freed_at_once() -> None:
    scene = ForestScene(fireflies=3)
    watched = weakref.ref(scene.root.find("tree").node())
    gc.disable()
    try:
        del scene
        assert watched() is None
    finally:
        gc.enable()

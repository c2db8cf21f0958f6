"""The walking figure: made again it is equal, its skin is sound, and its walk is one."""

from __future__ import annotations

import importlib
import json
import struct
import sys

import numpy as np
import pytest

from firefly_sample import load_model
from firefly_sample.assets import asset_dir
from tests.last_digits import move_last_digits

MODELS = asset_dir("models")
KEPT = MODELS / "walker.glb"
SIDES = ("left", "right")


@pytest.fixture(scope="module")
def scripts():
    """The script models/make_models.py, and the module of the gait."""
    before = list(sys.path)
    sys.path.insert(0, str(MODELS))
    try:
        yield importlib.import_module("make_models"), importlib.import_module("builder.gait")
    finally:
        sys.path[:] = before


@pytest.fixture(scope="module")
def model():
    return load_model(KEPT)


def contents(path):
    """A .glb file's accessors and header."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    header, body = json.loads(data[20 : 20 + length]), data[20 + length + 8 :]
    kinds = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5126: "<f4"}
    arrays = []
    for accessor in header["accessors"]:
        view = header["bufferViews"][accessor["bufferView"]]
        start, kind = view["byteOffset"], kinds[accessor["componentType"]]
        arrays.append(np.frombuffer(body[start : start + view["byteLength"]], kind))
    return arrays, header


def seen_at(model, name, times):
    """Where a node is, (n, 3), in the model's space."""
    places = []
    for time in times:
        model.node().update(time)
        places.append(model.find(f"**/{name}").get_pos(model))
    return np.array(places)


def test_made_again_by_another_processor_is_equal(scripts, tmp_path, monkeypatch):
    move_last_digits(monkeypatch)
    arrays, header = contents(scripts[0].make(tmp_path, ("walker",))["walker"])
    kept_arrays, kept_header = contents(KEPT)
    assert header == kept_header
    for one, other in zip(arrays, kept_arrays, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_file_is_small_and_complete(model):
    assert KEPT.stat().st_size < 60_000
    assert list(model.node().animations) == ["walk"]
    assert [warning for warning in model.node().warnings if "roughness" not in warning] == []


def test_the_skin_is_sound():
    arrays, header = contents(KEPT)
    (mesh,), (skin,) = header["meshes"], header["skins"]
    attributes = mesh["primitives"][0]["attributes"]
    joints, weights = (
        arrays[attributes[name]].reshape(-1, 4).astype(int) for name in ("JOINTS_0", "WEIGHTS_0")
    )
    assert (weights.sum(axis=1) == 255).all()
    assert joints.max() < len(skin["joints"]) == 13
    assert set(np.unique(joints[weights > 0])) == set(range(13))


def test_the_figure_stands_on_the_ground_and_faces_outwards(model):
    model.node().play(None)
    model.node().update(0.0)
    ((geom, material),) = model.find("body").node().geoms
    low, high = geom.bounds
    np.testing.assert_allclose(low[2], 0.0, atol=2e-3)
    assert 1.7 < high[2] < 1.9
    np.testing.assert_allclose(low[0], -high[0], atol=2e-3)
    assert not material.double_sided
    assert len(np.unique(geom.triangles)) == len(geom.vertices)
    a, b, c = (geom.vertices[corner] for corner in geom.triangles.T)
    side = (np.cross(b - a, c - a) * geom.normals[geom.triangles].mean(axis=1)).sum(axis=1)
    assert (side > 0.0).mean() > 0.99
    model.node().play("walk")


def test_the_walk_begins_where_it_ends():
    arrays, header = contents(KEPT)
    (animation,) = header["animations"]
    for sampler in animation["samplers"]:
        keys = arrays[sampler["input"]]
        values = arrays[sampler["output"]].reshape(len(keys), -1)
        np.testing.assert_allclose(values[0], values[-1], rtol=0, atol=2e-6)


def test_the_right_side_does_half_a_cycle_later_what_the_left_does(model, scripts):
    gait = scripts[1]
    times = np.linspace(0.0, gait.SECONDS, 10, endpoint=False) + 1e-3
    for joint in ("shin", "foot", "forearm"):
        left = seen_at(model, f"left {joint}", times)
        right = seen_at(model, f"right {joint}", times + gait.SECONDS / 2)
        np.testing.assert_allclose(left * (-1, 1, 1), right, rtol=0, atol=3e-3)


def test_feet_do_not_slide_nor_sink(model, scripts):
    """The lowest point of the foot on the ground goes back with the speed of the walk."""
    gait = scripts[1]
    times = np.linspace(0.14, 0.33, 12) * gait.SECONDS  # its sole lies flat
    places = seen_at(model, "left foot", times)
    speeds = np.diff(places[:, 1]) / np.diff(times)
    np.testing.assert_allclose(speeds, gait.SPEED, rtol=0.06)
    np.testing.assert_allclose(places[:, 2], gait.ANKLE, rtol=0, atol=2e-3)
    for time in np.linspace(0.0, gait.SECONDS, 24):
        model.node().update(time)
        ((geom, _),) = model.find("body").node().geoms
        assert abs(geom.bounds[0][2]) < 0.004


def test_hips_bob_twice_and_arms_swing_against_the_legs(model, scripts):
    gait = scripts[1]
    times = np.linspace(0.0, gait.SECONDS, 40, endpoint=False)
    height = seen_at(model, "hips", times)[:, 2]
    spectrum = np.abs(np.fft.rfft(height - height.mean()))
    assert np.argmax(spectrum) == 2
    assert 0.03 < np.ptp(height) < 0.07
    for name in SIDES:
        leg, arm = seen_at(model, f"{name} foot", times)[:, 1], seen_at(model, f"{name} forearm", times)[:, 1]
        assert np.corrcoef(leg, arm)[0, 1] < -0.8


def test_knees_and_elbows_bend_one_way_only(model, scripts):
    gait = scripts[1]
    for time in np.linspace(0.0, gait.SECONDS, 40):
        model.node().update(time)
        for name in SIDES:
            shin, forearm = (
                model.find(f"**/{name} {part}").get_mat()[:3, :3] for part in ("shin", "forearm")
            )
            # where the bone's end goes, which points down at rest: a shin backwards (+Y), a forearm forwards
            assert (-shin[2])[1] > 0.0
            assert (-forearm[2])[1] < 0.0

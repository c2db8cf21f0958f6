"""The models to be looked at by themselves: made again they are equal, and each follows glTF's rules.

They are read here by the letter of the format, without the package's reader.
"""

from __future__ import annotations

import io
import json
import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from firefly_sample.assets import asset_dir
from tests.last_digits import move_last_digits

MODELS = asset_dir("models")
NAMES = ("bonsai", "lantern", "orrery")
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
STEEPEST = {"i1": 127, "i2": 32767, "u1": 255, "u2": 65535}


class Contents:
    """A .glb file's description and arrays."""

    def __init__(self, path: Path) -> None:
        self.bytes = data = path.read_bytes()
        magic, version, length, size, kind = struct.unpack_from("<4sIII4s", data)
        assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
        self.json = json.loads(data[20 : 20 + size])
        body_size, body_kind = struct.unpack_from("<I4s", data, 20 + size)
        assert body_kind == b"BIN\0"
        assert size % 4 == body_size % 4 == 0
        self.body = data[28 + size :]
        assert len(self.body) == body_size >= self.json["buffers"][0]["byteLength"]

    def view(self, index: int) -> tuple[bytes, int]:
        """The bytes of a view and its stride, 0 where rows follow each other."""
        view = self.json["bufferViews"][index]
        start, end = view["byteOffset"], view["byteOffset"] + view["byteLength"]
        assert 0 <= start < end <= len(self.body)
        assert start % 4 == 0
        return self.body[start:end], view.get("byteStride", 0)

    def rows(self, index: int) -> np.ndarray:
        """An accessor's values as they are stored, (n, width)."""
        accessor = self.json["accessors"][index]
        data, stride = self.view(accessor["bufferView"])
        dtype, width = np.dtype(COMPONENTS[accessor["componentType"]]), WIDTHS[accessor["type"]]
        stride = stride or width * dtype.itemsize
        assert (accessor["count"] - 1) * stride + width * dtype.itemsize <= len(data)
        return np.ndarray((accessor["count"], width), dtype, data, 0, (stride, dtype.itemsize)).copy()

    def values(self, index: int) -> np.ndarray:
        """An accessor's values, from -1 to 1 where it is normalised."""
        rows = self.rows(index)
        if not self.json["accessors"][index].get("normalized"):
            return rows.astype(float)
        return np.maximum(rows / STEEPEST[rows.dtype.str[1:]], -1.0)

    def image(self, index: int) -> np.ndarray:
        image = Image.open(io.BytesIO(self.view(self.json["images"][index]["bufferView"])[0]))
        return np.asarray(image.convert("RGBA"))

    def primitives(self) -> list[dict]:
        return [primitive for mesh in self.json["meshes"] for primitive in mesh["primitives"]]


@pytest.fixture(scope="module", params=NAMES)
def contents(request: pytest.FixtureRequest) -> Contents:
    return Contents(MODELS / f"{request.param}.glb")


@pytest.mark.parametrize("name", NAMES)
def test_made_again_by_another_processor_is_equal(
    maker, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    move_last_digits(monkeypatch)
    made, kept = Contents(maker.make(tmp_path, (name,))[name]), Contents(MODELS / f"{name}.glb")
    # the bytes of a JPEG may differ between versions of its encoder, and with them where the views are
    for part in sorted({*made.json, *kept.json} - {"buffers", "bufferViews"}):
        assert made.json[part] == kept.json[part], part
    for k in range(len(kept.json["accessors"])):
        np.testing.assert_array_equal(made.rows(k), kept.rows(k))
    for k in range(len(kept.json.get("images", []))):
        np.testing.assert_array_equal(made.image(k), kept.image(k))


def test_sizes(contents: Contents) -> None:
    assert len(contents.bytes) < 300_000
    counts = [contents.json["accessors"][p["indices"]]["count"] // 3 for p in contents.primitives()]
    drawn = 0
    first = 0
    for k, mesh in enumerate(contents.json["meshes"]):
        own = sum(counts[first : first + len(mesh["primitives"])])
        first += len(mesh["primitives"])
        drawn += own * sum(node.get("mesh") == k for node in contents.json["nodes"])
    assert 5_000 < drawn < 30_000


def test_all_together_are_small() -> None:
    assert sum((MODELS / f"{name}.glb").stat().st_size for name in NAMES) < 700_000


def test_accessors_are_as_described(contents: Contents) -> None:
    positions = {p["attributes"]["POSITION"] for p in contents.primitives()}
    for k, accessor in enumerate(contents.json["accessors"]):
        rows = contents.rows(k)
        view = contents.json["bufferViews"][accessor["bufferView"]]
        if view.get("target") == 34962:
            assert view.get("byteStride", rows.shape[1] * rows.itemsize) % 4 == 0
        assert np.isfinite(rows).all()
        assert k not in positions or "min" in accessor
        if "min" in accessor:
            assert accessor["min"] == rows.min(axis=0).tolist()
            assert accessor["max"] == rows.max(axis=0).tolist()


def test_surfaces_are_sound(contents: Contents) -> None:
    for primitive in contents.primitives():
        attributes = primitive["attributes"]
        points, normals = contents.values(attributes["POSITION"]), contents.values(attributes["NORMAL"])
        counts = {contents.json["accessors"][index]["count"] for index in attributes.values()}
        assert counts == {len(points)}
        triangles = contents.rows(primitive["indices"]).reshape(-1, 3).astype(int)
        # every vertex is used, and none that is not there
        np.testing.assert_array_equal(np.unique(triangles), np.arange(len(points)))
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=0.013)
        a, b, c = (points[triangles[:, k]] for k in range(3))
        face = np.cross(b - a, c - a)
        material = contents.json["materials"][primitive["material"]]
        if not material.get("doubleSided"):
            towards = np.einsum("ij,ij->i", face, normals[triangles].sum(axis=1))
            assert (towards >= 0.0).mean() > 0.995
        if "TEXCOORD_0" not in attributes:
            assert "baseColorTexture" not in material["pbrMetallicRoughness"]
            assert "emissiveTexture" not in material


def test_nodes_are_trees_with_names(contents: Contents) -> None:
    nodes = contents.json["nodes"]
    children = [child for node in nodes for child in node.get("children", [])]
    roots = contents.json["scenes"][0]["nodes"]
    assert sorted(children + roots) == list(range(len(nodes)))
    # a child is made after its parent, so that there is no way round
    assert all(child > k for k, node in enumerate(nodes) for child in node.get("children", []))
    names = [node["name"] for node in nodes]
    assert len(set(names)) == len(names)
    for node in nodes:
        if "rotation" in node:
            assert abs(np.linalg.norm(node["rotation"]) - 1.0) < 1e-6


def test_references_exist(contents: Contents) -> None:
    found = contents.json
    lights = found.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    for node in found["nodes"]:
        assert 0 <= node.get("mesh", 0) < len(found["meshes"])
        assert 0 <= node.get("camera", 0) <= len(found.get("cameras", []))
        if "extensions" in node:
            assert node["extensions"]["KHR_lights_punctual"]["light"] in range(len(lights))
    used = {primitive["material"] for primitive in contents.primitives()}
    assert used == set(range(len(found["materials"])))
    assert {texture["source"] for texture in found.get("textures", [])} == set(
        range(len(found.get("images", [])))
    )


def test_extensions_are_named(contents: Contents) -> None:
    def within(value: object) -> set[str]:
        if isinstance(value, list):
            return set().union(*map(within, value))
        if not isinstance(value, dict):
            return set()
        return set(value.get("extensions", {})).union(*map(within, value.values()))

    named = set(contents.json["extensionsUsed"])
    assert within(contents.json) == named - {"KHR_mesh_quantization"}
    assert contents.json["extensionsRequired"] == ["KHR_mesh_quantization"]


def test_animations_loop(contents: Contents) -> None:
    for animation in contents.json.get("animations", []):
        ends = set()
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            times, values = contents.values(sampler["input"])[:, 0], contents.values(sampler["output"])
            assert times[0] == 0.0
            assert (np.diff(times) > 0.0).all()
            assert len(values) == len(times)
            ends.add(times[-1])
            first, last = values[0], values[-1]
            if channel["target"]["path"] == "rotation":
                np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
                # each step is less than half a turn, and no reader has to choose between two ways
                assert all(abs(one @ other) > 0.2 for one, other in pairwise(values))
                last = last * np.sign(first @ last)
            np.testing.assert_allclose(last, first, atol=1e-6)
        assert len(ends) == 1


def turns(contents: Contents, node: str) -> float:
    """Turns of a node about the vertical in its animation, counter-clockwise from above."""
    (animation,) = contents.json["animations"]
    index = [other["name"] for other in contents.json["nodes"]].index(node)
    (channel,) = [c for c in animation["channels"] if c["target"]["node"] == index]
    x, y, z, w = contents.values(animation["samplers"][channel["sampler"]]["output"]).T
    np.testing.assert_allclose([x, z], 0.0, atol=1e-7)
    step = 2.0 * np.arctan2(y[1:] * w[:-1] - w[1:] * y[:-1], w[1:] * w[:-1] + y[1:] * y[:-1])
    return float(np.sum((step + np.pi) % (2.0 * np.pi) - np.pi) / (2.0 * np.pi))


def test_the_wheels_of_the_orrery_fit_their_teeth() -> None:
    contents = Contents(MODELS / "orrery.glb")
    for teeth in (30, 48):
        name = "pinion of 30" if teeth == 30 else "pinion of 12"
        here, there = turns(contents, f"wheel of {teeth}"), turns(contents, name)
        assert here > 0.0
        assert abs(here * teeth + there * (60 - teeth)) < 1e-5
    # a planet turns as fast as its wheel
    assert abs(turns(contents, "venus arm") - turns(contents, "wheel of 30")) < 1e-6
    assert abs(turns(contents, "saturn arm") - turns(contents, "wheel of 48")) < 1e-6
    inwards = ["saturn", "jupiter", "mars", "earth", "venus", "mercury"]
    rates = [turns(contents, f"{name} arm") for name in inwards]
    assert rates == sorted(rates)


def test_the_orrery_shares_meshes_and_mirrors_some() -> None:
    contents = Contents(MODELS / "orrery.glb")
    meshes = [node["mesh"] for node in contents.json["nodes"] if "mesh" in node]
    assert len(meshes) > 2 * len(set(meshes))
    cradles = [node for node in contents.json["nodes"] if node["name"].startswith("cradle")]
    assert [np.prod(node.get("scale", 1.0)) < 0.0 for node in cradles] == [False, True, False, True]
    assert any("COLOR_0" in primitive["attributes"] for primitive in contents.primitives())


def test_the_lantern_glows() -> None:
    contents = Contents(MODELS / "lantern.glb")
    (glass,) = [made for made in contents.json["materials"] if "emissiveTexture" in made]
    assert glass["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] > 1.0
    assert glass["alphaMode"] == "BLEND"
    amber = contents.json["textures"][glass["pbrMetallicRoughness"]["baseColorTexture"]["index"]]
    alpha = contents.image(amber["source"])[..., 3] / 255.0
    assert 0.4 < alpha.min() < 0.6 < 0.9 < alpha.max()  # glass, and paint on it
    lights = contents.json["extensions"]["KHR_lights_punctual"]["lights"]
    assert [light["type"] for light in lights].count("point") == 2
    assert "directional" in [light["type"] for light in lights]
    (camera,) = contents.json["cameras"]
    assert camera["type"] == "perspective"


def test_the_dents_of_the_lantern_face_outwards() -> None:
    contents = Contents(MODELS / "lantern.glb")
    (iron,) = [made for made in contents.json["materials"] if "normalTexture" in made]
    assert iron["pbrMetallicRoughness"]["metallicFactor"] == 1.0
    source = contents.json["textures"][iron["normalTexture"]["index"]]["source"]
    normals = contents.image(source)[..., :3] / 255.0 * 2.0 - 1.0
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1.0).mean() < 0.02  # JPEG blurs the ridges
    assert normals[..., 2].min() > 0.5
    np.testing.assert_allclose(normals.mean(axis=(0, 1))[:2], 0.0, atol=0.01)  # it repeats, so it is level


def test_the_bonsai_has_cut_out_leaves_and_repeating_textures() -> None:
    contents = Contents(MODELS / "bonsai.glb")
    (leaves,) = [made for made in contents.json["materials"] if made.get("alphaMode") == "MASK"]
    assert leaves["doubleSided"]
    texture = contents.json["textures"][leaves["pbrMetallicRoughness"]["baseColorTexture"]["index"]]
    pixels = contents.image(texture["source"])
    assert 0.1 < (pixels[..., 3] >= 128).mean() < 0.6
    # colour goes on below the cut, or mipmaps would have dark rims
    rim = (pixels[..., 3] < 128) & (pixels[..., 3] > 0)
    assert pixels[rim][:, :3].mean() > 0.7 * pixels[pixels[..., 3] >= 128][:, :3].mean()
    slots = [made["pbrMetallicRoughness"].get("baseColorTexture", {}) for made in contents.json["materials"]]
    scales = [slot["extensions"]["KHR_texture_transform"]["scale"] for slot in slots if "extensions" in slot]
    assert len(scales) == 2
    assert max(max(scale) for scale in scales) > 1.0

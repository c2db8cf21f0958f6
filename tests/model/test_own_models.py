"""The committed models of the scenes: made again they are equal, and each is sound."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from firefly_sample.assets import asset_dir
from firefly_sample.model.load import load_model
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.traversal import iter_visible
from tests.last_digits import move_last_digits

MODELS = asset_dir("models")
SHOWPIECES = ("bonsai", "lantern", "orrery", "walker")
"""They have their own tests: `test_showpieces` and `test_walker`."""
FILES = sorted(path for path in MODELS.glob("*.glb") if path.stem not in SHOWPIECES)
QUICK = (
    "birch",
    "bulb",
    "dead_tree",
    "fallen_trunk",
    "grass",
    "mushrooms",
    "plinth",
    "rocks",
    "stump",
)
"""Those that take a few seconds each."""


def contents(path: Path) -> tuple[list[np.ndarray], list[np.ndarray], dict]:
    """A .glb file's accessors, decoded images and header, read without trimesh."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    header = json.loads(data[20 : 20 + length])
    body = data[20 + length + 8 :]
    views = [
        body[view.get("byteOffset", 0) : view.get("byteOffset", 0) + view["byteLength"]]
        for view in header["bufferViews"]
    ]
    kinds = {5121: "<u1", 5125: "<u4", 5126: "<f4"}
    arrays = [
        np.frombuffer(views[accessor["bufferView"]], kinds[accessor["componentType"]])
        for accessor in header["accessors"]
    ]
    pixels = [np.asarray(Image.open(io.BytesIO(views[image["bufferView"]]))) for image in header["images"]]
    return arrays, pixels, header


def linear(pixels: np.ndarray) -> np.ndarray:
    """Linear colour from sRGB codes."""
    c = np.arange(256) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)[pixels[..., :3]]


@pytest.mark.parametrize("name", QUICK)
def test_made_again_by_another_processor_is_equal(
    maker, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    move_last_digits(monkeypatch)
    made = maker.make(tmp_path, (name,))[name]
    arrays, pixels, header = contents(made)
    kept_arrays, kept_pixels, kept_header = contents(MODELS / f"{name}.glb")
    assert len(arrays) == len(kept_arrays) > 0
    for one, other in zip(arrays, kept_arrays, strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(pixels) == len(kept_pixels) > 0
    for one, other in zip(pixels, kept_pixels, strict=True):
        np.testing.assert_array_equal(one, other)
    for part in ("nodes", "meshes", "materials"):
        assert header[part] == kept_header[part]


def test_the_script_makes_exactly_the_committed_files(maker) -> None:
    assert sorted(maker.MODELS) == [path.stem for path in FILES]
    assert sorted(maker.SHOWPIECES) == list(SHOWPIECES)


def test_unknown_model_is_named(maker, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert maker.main([str(tmp_path / "out"), "palm"]) == 2
    assert "no model 'palm': there are oak, birch" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_geometry_is_sound(path: Path) -> None:
    nodes = [v.node for v in iter_visible(load_model(path)) if isinstance(v.node, GeomNode) and v.node.geoms]
    assert nodes
    for node in nodes:
        for geom, material in node.geoms:
            lengths = np.linalg.norm(geom.normals, axis=1)
            np.testing.assert_allclose(lengths, 1.0, atol=1e-4)
            assert material.texture is not None
            assert material.double_sided == (material.alpha_mode == "mask")
            # White vertex colours would cost an attribute and change nothing.
            assert geom.colors is None or 0.0 <= geom.colors.min() < geom.colors.max() <= 1.0
            # Every vertex is used, and hardly a triangle is without area.
            assert len(np.unique(geom.triangles)) == len(geom.vertices)
            a, b, c = (geom.vertices[geom.triangles[:, k]] for k in range(3))
            area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
            assert (area < 1e-6).mean() < 0.02


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_solid_surfaces_face_outwards(path: Path) -> None:
    """Normals that are not bent agree with the winding of the triangles."""
    for visit in iter_visible(load_model(path)):
        for geom, material in getattr(visit.node, "geoms", ()):
            if material.alpha_mode == "mask":
                continue
            a, b, c = (geom.vertices[geom.triangles[:, k]] for k in range(3))
            face = np.cross(b - a, c - a)
            side = np.einsum("ij,ij->i", face, geom.normals[geom.triangles].mean(axis=1))
            assert (side >= 0.0).mean() > 0.99, (path.name, geom.name)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_textures_are_plausible(path: Path) -> None:
    _, pictures, header = contents(path)
    for pixels, material in zip(pictures, header["materials"], strict=True):
        assert max(pixels.shape[:2]) <= (2048 if path.stem == "terrain" else 1024)
        cut_out = pixels.shape[2] == 4
        assert material["alphaMode"] == ("MASK" if cut_out else "OPAQUE")
        albedo = linear(pixels)
        if cut_out:
            assert material["alphaCutoff"] == 0.5
            there = pixels[..., 3] >= 128
            assert 0.05 < there.mean() < 0.7
            # Colour goes on below the cut, or mipmaps would have dark rims.
            rim = (pixels[..., 3] < 128) & (pixels[..., 3] > 0)
            assert albedo[rim].mean() > 0.5 * albedo[there].mean()
            albedo = albedo[there]
            assert albedo[..., 1].mean() > albedo[..., 2].mean()
        assert 0.02 < albedo.mean() < 0.5


def vertices_of(name: str) -> dict[str, np.ndarray]:
    """All vertices of a model by the name of the node that holds them."""
    found: dict[str, list[np.ndarray]] = {}
    for path in load_model(MODELS / f"{name}.glb").get_children():
        parts = [v.node for v in iter_visible(path) if isinstance(v.node, GeomNode)]
        found[path.get_name()] = [geom.vertices for part in parts for geom, _ in part.geoms]
    return {node: np.concatenate(parts) for node, parts in found.items()}


def test_the_cat_is_one_small_mesh_that_sits_on_the_ground() -> None:
    nodes = [v.node for v in iter_visible(load_model(MODELS / "cat.glb")) if isinstance(v.node, GeomNode)]
    ((geom, _),) = [pair for node in nodes for pair in node.geoms]
    low, high = geom.bounds
    assert len(geom.triangles) <= 1100
    np.testing.assert_allclose([low[2], high[2]], [0.0, 1.0], atol=2e-3)
    assert np.abs([low[:2], high[:2]]).max() < 0.425
    # It faces -Y: its head is in front of its middle.
    assert geom.vertices[geom.vertices[:, 2] > 0.9][:, 1].mean() < 0.0


def test_planets_are_unit_spheres_and_bulbs_have_their_radius() -> None:
    planets = vertices_of("planets")
    assert sorted(planets) == ["gas giant", "moon", "ocean planet", "ringed planet", "rocky planet"]
    for name, vertices in planets.items():
        radius = np.linalg.norm(vertices, axis=1)
        ball = radius[np.abs(radius - 1.0) < 0.1]
        np.testing.assert_allclose(ball, 1.0, atol=1e-6)
        assert (len(ball) == len(radius)) == (name != "ringed planet")
    (bulb,) = vertices_of("bulb").values()
    np.testing.assert_allclose(np.linalg.norm(bulb, axis=1), 0.2, atol=3e-8)


def test_the_plinth_is_a_unit_box_below_the_origin() -> None:
    (vertices,) = vertices_of("plinth").values()
    np.testing.assert_allclose(vertices.min(axis=0), [-0.5, -0.5, -1.0], atol=1e-6)
    np.testing.assert_allclose(vertices.max(axis=0), [0.5, 0.5, 0.0], atol=1e-6)


def test_bark_tiles_without_a_seam() -> None:
    _, (bark, _), _ = contents(MODELS / "birch.glb")
    if bark.shape[2] == 4:
        bark = contents(MODELS / "birch.glb")[1][1]
    values = linear(bark)
    for axis in (0, 1):
        steps = np.abs(np.diff(values, axis=axis)).mean()
        wrap = np.abs(np.take(values, 0, axis) - np.take(values, -1, axis)).mean()
        assert wrap < 1.6 * steps


def test_ground_does_not_repeat() -> None:
    """No shift of the ground's texture looks like the ground: its autocorrelation has one peak."""
    _, (pixels,), _ = contents(MODELS / "terrain.glb")
    values = linear(pixels).mean(axis=2).reshape(512, 4, 512, 4).mean(axis=(1, 3))
    # Take the large tones away first: two shady woods look alike, and that is not tiling.
    spectrum = np.fft.fft2(values - values.mean())
    frequency = np.hypot(np.fft.fftfreq(512)[:, None], np.fft.fftfreq(512)[None, :])
    spectrum[frequency < 1.0 / 40.0] = 0.0
    correlation = np.fft.ifft2(np.abs(spectrum) ** 2).real
    correlation /= correlation[0, 0]
    y, x = (
        np.minimum(np.arange(512), 512 - np.arange(512))[:, None],
        np.minimum(np.arange(512), 512 - np.arange(512)),
    )
    assert np.abs(correlation[np.hypot(y, x) > 40.0]).max() < 0.15

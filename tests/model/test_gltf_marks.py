"""Points and lines of glTF files: their materials, and where they are seen (glTF 2.0, section 3.9.7)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firefly_sample import Renderer, Scene
from firefly_sample.model.load import load_model
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.nodepath import NodePath
from tests.model.gltf_files import GltfFile
from tests.model.quads import NORMALS, TRIANGLES, UVS, picture

CORNERS = np.float32([[-1.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 1.5, 0], [-1.5, 1.5, 0]])
"""In glTF's axes, in a picture of 4 x 4 pixels at the middles of pixels."""
GREY = np.full((2, 2, 3), 128, np.uint8)
TANGENTS = np.float32([[1, 0, 0, 1]] * 4)


def marks(folder: Path, material: dict[str, Any] | None = None, **primitive: Any) -> NodePath:
    """A file of one mesh: a primitive of points, or of what is given, and a quad of the same material."""
    file = GltfFile()
    if material is not None:
        if material.pop("bumps", False):
            material["normalTexture"] = {"index": picture(file, GREY)}
        primitive["material"] = file.add("materials", name="paint", **material)
    own = file.primitive(**{"POSITION": CORNERS, "TEXCOORD_0": UVS, "mode": 0} | primitive)
    solid = {"POSITION": CORNERS, "NORMAL": NORMALS, "TEXCOORD_0": UVS, "indices": TRIANGLES.ravel()}
    quad = file.primitive(**solid, **{key: primitive[key] for key in primitive.keys() & {"material"}})
    file.node(mesh=file.mesh(own, quad))
    return load_model(file.write(folder / "marks.glb"))


def parts(model: NodePath) -> list[tuple[Any, Any]]:
    (path,) = model.find_all_matches("**/+GeomNode")
    node = path.node()
    assert isinstance(node, GeomNode)
    return list(node.geoms)


RED = {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}, "bumps": True}


def test_without_normals_they_show_their_colour_without_light(tmp_path: Path) -> None:
    (geom, material), (_, solid) = parts(marks(tmp_path, {**RED, "doubleSided": True}))
    assert (geom.mode, material.unlit, material.metallic) == ("points", True, None)
    assert (material.name, material.base_color.tolist()) == ("paint", [1, 0, 0, 1])
    assert (solid.unlit, solid.metallic, solid.normal_texture is None) == (False, 1.0, False)


def test_emission_that_they_lack_is_named(tmp_path: Path) -> None:
    model = marks(tmp_path, {"emissiveFactor": [0, 1, 0]})
    assert model.node().warnings == ("points and lines without normals do not emit, of materials: 'paint'",)
    assert marks(tmp_path, {"emissiveFactor": [0, 1, 0]}, NORMAL=NORMALS).node().warnings == ()


@pytest.mark.parametrize("tangents", [False, True])
def test_with_normals_they_are_lit_and_with_tangents_bumped(tmp_path: Path, tangents: bool) -> None:
    given = {"NORMAL": NORMALS} | ({"TANGENT": TANGENTS} if tangents else {})
    (geom, material), (_, solid) = parts(marks(tmp_path, dict(RED), mode=3, **given))
    assert geom.mode == "lines"
    assert (geom.normals == (0, -1, 0)).all()
    assert (material.unlit, material.metallic) == (False, 1.0)
    assert (material.normal_texture is not None, geom.tangents is not None) == (tangents, tangents)
    assert (material is solid) == tangents


def seen(model: NodePath) -> np.ndarray:
    """The mask of the pixels that are red in a picture of 4 x 4 pixels."""
    scene = Scene()
    model.reparent_to(scene.root)
    scene.camera.set_y(-5)
    scene.camera.node().lens = OrthographicLens(film_size=(4, 4), near=1, far=10)
    with Renderer((4, 4)) as renderer:
        radiance = renderer.render(scene, outputs=("radiance",)).radiance
    return radiance[..., 0] > 0


PICTURES = {
    0: ["#.#.", "....", "#.#.", "...."],
    1: ["###.", "....", "###.", "...."],
    2: ["###.", "#.#.", "###.", "...."],
    3: ["###.", "..#.", "###.", "...."],
}


@pytest.mark.parametrize("mode", PICTURES)
def test_they_are_drawn_where_they_are(tmp_path: Path, mode: int) -> None:
    """Corners of a square: points, two sides, all around, and all but the last side."""
    model = marks(tmp_path, dict(RED), mode=mode)
    (node,) = (path.node() for path in model.find_all_matches("**/+GeomNode"))
    del node.geoms[1:]  # without the quad
    drawn = seen(model)
    expected = np.array([[pixel == "#" for pixel in row] for row in PICTURES[mode]])
    ends = np.zeros((4, 4), dtype=bool)
    ends[0:3:2, 0:3:2] = mode != 0  # OpenGL decides about the last pixel of a line
    assert (drawn == expected)[~ends].all()


def test_morphed_points_move(tmp_path: Path) -> None:
    file = GltfFile()
    moved = np.float32([[1, 0, 0]] * 4)
    own = file.primitive(POSITION=CORNERS, mode=0, targets=[{"POSITION": moved}])
    file.node(mesh=file.mesh(own, weights=[1.0]))
    drawn = seen(load_model(file.write(tmp_path / "moved.glb")))
    assert drawn.tolist() == [[c == "#" for c in row] for row in (".#.#", "....", ".#.#", "....")]


def test_a_kept_model_has_them_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(2):
        (geom, material), (solid, _) = parts(marks(tmp_path, dict(RED), mode=1))
        assert (geom.mode, geom.indices.tolist(), material.unlit) == ("lines", [[0, 1], [2, 3]], True)
        assert solid.mode == "triangles"

"""COLLADA files: tree, materials, textures, and what is not drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model import dae_model
from firefly_sample.model.data import ModelData
from firefly_sample.model.readers import read_here
from firefly_sample.srgb import srgb_to_linear
from tests.model.format_files import dae
from tests.model.png_files import png

PHONG = """<phong><emission><color>0 0.5 0 1</color></emission><ambient><color>1 1 1 1</color></ambient>
<diffuse><color>0.5 0.25 1 1</color></diffuse><specular><color>0.2 0.2 0.2 1</color></specular>
<shininess><float>40</float></shininess>{}</phong>"""
TEXTURED = '<lambert><diffuse><texture texture="p" texcoord="uv"/></diffuse></lambert>'


def read(folder: Path, data: bytes, limit: float = 100.0) -> ModelData:
    """Read a file in this process: the other one is tested with all formats."""
    path = folder / "model.dae"
    path.write_bytes(data)
    return read_here(path, "dae", None, limit)


def test_the_tree_has_the_names_of_the_file(tmp_path: Path) -> None:
    model = read(tmp_path, dae())
    assert [(node.name, node.parent, node.geoms) for node in model.nodes] == [
        ("Branch", -1, ()),
        ("Leaf", 0, (0,)),
    ]
    assert [geom.name for geom in model.geoms] == ["Tetra"]
    assert model.losses == []


@pytest.mark.parametrize("up", ["X_UP", "Y_UP", "Z_UP"])
def test_matrices_are_turned_like_vertices(up: str, tmp_path: Path) -> None:
    matrix = "<matrix>0 -1 0 7  1 0 0 8  0 0 1 9  0 0 0 1</matrix>"
    moved = dae(up).replace(b'name="Leaf">', f'name="Leaf">{matrix}'.encode())
    model, plain = read(tmp_path, moved), read(tmp_path, dae(up))
    vertices = plain.geoms[0].arrays["vertices"]
    assert (model.geoms[0].arrays["vertices"] == vertices).all()
    leaf = model.nodes[1].matrix
    assert leaf is not None
    rows = np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [7, 8, 9, 1.0]])
    turned = np.eye(4)
    turned[:3, :3] = {
        "X_UP": [[0, 0, 1], [-1, 0, 0], [0, -1, 0]],
        "Y_UP": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        "Z_UP": np.eye(3),
    }[up]
    points = np.column_stack([vertices, np.ones(len(vertices))])
    assert np.allclose(points @ leaf, points @ turned.T @ rows @ turned, atol=1e-15)


def test_a_geometry_with_the_same_materials_is_shared(tmp_path: Path) -> None:
    start, end = b'<node id="branch" name="Branch">', b"</node></visual_scene>"
    text = dae()
    branch = text[text.index(start) : text.index(end) + len(b"</node>")]
    twice = text.replace(branch, branch + branch.replace(b"branch", b"second").replace(b'"leaf"', b'"leaf2"'))
    model = read(tmp_path, twice)
    assert len(model.geoms) == 1
    assert [node.geoms for node in model.nodes if node.geoms] == [(0,), (0,)]


def test_materials(tmp_path: Path) -> None:
    transparent = (
        "<transparent><color>1 1 1 0.5</color></transparent><transparency><float>0.5</float></transparency>"
    )
    (material,) = read(tmp_path, dae(effect=PHONG.format(transparent))).materials
    half, quarter, fifth = (float(srgb_to_linear(code)) for code in (0.5, 0.25, 0.2))
    assert material.name == "Paint"
    assert material.base_color == pytest.approx((half, quarter, 1, 0.25))
    assert material.emission == pytest.approx((0, half, 0))
    assert material.specular == pytest.approx((fifth, fifth, fifth))
    assert material.shininess == 40
    assert (material.alpha_mode, material.double_sided) == ("blend", True)


@pytest.mark.parametrize(
    ("transparent", "opacity"),
    [
        ("", 1.0),
        ('<transparent opaque="RGB_ZERO"><color>0.5 0.5 0.5 1</color></transparent>'
         "<transparency><float>0.5</float></transparency>", 0.75),
        ("<transparency><float>0.25</float></transparency>", 1.0),  # of no colour
    ],
)  # fmt: skip
def test_opacity(transparent: str, opacity: float, tmp_path: Path) -> None:
    (material,) = read(tmp_path, dae(effect=PHONG.format(transparent))).materials
    assert material.base_color[3] == pytest.approx(opacity, abs=1e-6)


def test_textures(tmp_path: Path) -> None:
    (tmp_path / "wood.png").write_bytes(png(np.array([[[255, 0, 0]]], dtype=np.uint8), 2, 8))
    model = read(tmp_path, dae(effect=TEXTURED))
    (material,) = model.materials
    assert material.texture == 0
    assert material.base_color == (1, 1, 1, 1)
    assert model.images[0].decode().tolist() == [[[255, 0, 0, 255]]]
    with pytest.raises(ModelError, match="has 1x1 pixels, more than max_texture_megapixels=1e-07"):
        read(tmp_path, dae(effect=TEXTURED), 1e-7)


@pytest.mark.parametrize(
    ("data", "loss"),
    [
        (dae(effect=TEXTURED), "textures not found in the model's folder: 'wood.png'"),
        (
            dae(effect=TEXTURED).replace(b"wood.png", b"file:///etc/passwd"),
            "textures not found in the model's folder",
        ),
        (
            dae(effect=PHONG.format("<reflectivity><float>0.5</float></reflectivity>")),
            "reflections of materials: 'Paint'",
        ),
        (dae().replace(b"</mesh>", b"<spline/></mesh>"), "Unknown geometry tag"),
        (dae().replace(b'symbol="M"', b'symbol="N"'), "materials that are bound to nothing: 'M'"),
    ],
)
def test_what_is_not_drawn_is_named(data: bytes, loss: str, tmp_path: Path) -> None:
    try:
        losses = "; ".join(read(tmp_path, data).losses)
    except ModelError as error:
        losses = str(error)
    assert loss in losses


def test_cameras_and_lights_are_named(tmp_path: Path) -> None:
    light = (
        '<library_lights><light id="sun"><technique_common><directional><color>1 1 1</color></directional>'
        "</technique_common></light></library_lights>"
    )
    data = dae(extra=light).replace(b'name="Leaf">', b'name="Leaf"><instance_light url="#sun"/>')
    assert read(tmp_path, data).losses == ["cameras and lights of COLLADA files: 'Leaf'"]


ENTITY = b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]>'


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"rubbish", "damaged .dae file"),
        (dae()[:700], "damaged .dae file"),
        (ENTITY + dae()[dae().index(b"<COLLADA") :], "has a document type declaration"),
        (dae().replace(b"<p>0 2 1", b"<p>0 2 9"), "holds no triangles"),
        (dae().replace(b"<p>0 2 1", b"<p>0 2 -1"), "has a negative index"),
        (dae().replace(b"0.0 0.0 3.0", b"0.0 0.0 inf"), "not finite"),
        (
            dae().replace(b'name="Leaf">', b'name="Leaf"><scale>1 1 nan</scale>'),
            "node 'Leaf' has a transform",
        ),
    ],
)
def test_damage_is_one_line(data: bytes, line: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=line) as caught:
        read(tmp_path, data)
    assert "\n" not in str(caught.value)


def test_nodes_of_nodes_of_nodes_are_bounded(tmp_path: Path, monkeypatch) -> None:
    """Twenty nodes, each with two instances of the next, are a million nodes."""
    monkeypatch.setattr(dae_model, "MOST_NODES", 1000)
    nodes = "".join(
        f'<node id="n{level}"><instance_node url="#n{level - 1}"/><instance_node url="#n{level - 1}"/></node>'
        for level in range(1, 20)
    )
    library = f'<library_nodes><node id="n0"/>{nodes}</library_nodes>'
    data = dae(extra=library).replace(b'name="Leaf">', b'name="Leaf"><instance_node url="#n19"/>')
    with pytest.raises(ModelError, match="has more than 1000 nodes: simplify it"):
        read(tmp_path, data)

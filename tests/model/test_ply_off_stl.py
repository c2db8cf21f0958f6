"""PLY, OFF and STL files written here."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model.data import ModelData
from firefly_sample.model.trimesh_files import read_with_trimesh
from firefly_sample.srgb import srgb_to_linear
from tests.model.format_files import VERTICES, ply_binary, stl_binary, stl_text
from tests.model.png_files import png

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0)]
XYZ = "".join(f"property float {name}\n" for name in "xyz")


def read(folder: Path, name: str, data: bytes | str) -> ModelData:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_with_trimesh(path, None, 100)


def ply(vertices: str, faces: str, vertex: str = "", face: str = "", comments: str = "") -> str:
    """A text file: rows of vertices and faces, and more properties of either."""
    head = f"ply\nformat ascii 1.0\n{comments}element vertex {len(vertices.splitlines())}\n{XYZ}{vertex}"
    head += (
        f"element face {len(faces.splitlines())}\nproperty list uchar int vertex_indices\n{face}end_header\n"
    )
    return head + vertices + faces


TRIANGLE = "0 0 0\n1 0 0\n0 1 0\n"


def corner_values(model: ModelData, what: str) -> np.ndarray:
    arrays = model.geoms[0].arrays
    return arrays[what][arrays["triangles"]]


@pytest.mark.parametrize("order", ["little", "big"])
def test_binary_faces_of_different_lengths(order: str, tmp_path: Path) -> None:
    """As Blender writes a ball: trimesh refuses it."""
    sign = {"little": "<", "big": ">"}[order]
    head = f"ply\nformat binary_{order}_endian 1.0\nelement vertex 5\n{XYZ}element face 2\n"
    head += "property uchar flag\nproperty list uchar uint vertex_indices\nend_header\n"
    data = head.encode() + np.array(POINTS, f"{sign}f4").tobytes()
    data += struct.pack(f"{sign}BB4I", 0, 4, 0, 1, 2, 3) + struct.pack(f"{sign}BB3I", 0, 3, 3, 2, 4)
    model = read(tmp_path, "a.ply", data)
    assert corner_values(model, "vertices").tolist() == [
        [list(POINTS[index]) for index in triangle] for triangle in ((0, 1, 2), (0, 2, 3), (3, 2, 4))
    ]


def test_ply_big_endian_is_as_little_endian(tmp_path: Path) -> None:
    big, little = (read(tmp_path, "a.ply", ply_binary(order)) for order in ("big", "little"))
    assert (corner_values(big, "vertices") == corner_values(little, "vertices")).all()


@pytest.mark.parametrize(
    ("kind", "codes"),
    [
        ("uchar", (255, 128, 0)),
        ("ushort", (65535, 128 * 257, 0)),
        ("float", (1, 128 / 255, 0)),
        ("int", (255, 128, 0)),
    ],
)
def test_ply_colors_are_display_colors_of_any_type(kind: str, codes: tuple, tmp_path: Path) -> None:
    vertex = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    rows = "".join(f"{row} {' '.join(map(str, codes))}\n" for row in TRIANGLE.splitlines())
    model = read(tmp_path, "a.ply", ply(rows, "3 0 1 2\n", vertex))
    assert np.allclose(model.geoms[0].arrays["colors"], [[1, srgb_to_linear(128 / 255), 0, 1]], atol=1e-6)


def test_ply_colors_of_faces_split_vertices(tmp_path: Path) -> None:
    face = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue", "alpha"))
    faces = "3 0 1 2 255 0 0 255\n3 0 2 3 0 0 255 51\n"
    model = read(tmp_path, "a.ply", ply("0 0 0\n1 0 0\n1 1 0\n0 1 0\n", faces, face=face))
    assert corner_values(model, "colors").tolist() == [[[1, 0, 0, 1]] * 3, [[0, 0, 1, 0.2]] * 3]
    assert model.materials[0].alpha_mode == "blend"
    assert len(model.geoms[0].arrays["vertices"]) == 6


def test_ply_normals_are_used(tmp_path: Path) -> None:
    vertex = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz"))
    rows = "".join(f"{row} 0 3 4\n" for row in TRIANGLE.splitlines())
    model = read(tmp_path, "a.ply", ply(rows, "3 0 1 2\n", vertex))
    assert np.allclose(model.geoms[0].arrays["normals"], [0, 0.6, 0.8], atol=1e-15)


@pytest.mark.parametrize("names", [("u", "v"), ("s", "t"), ("texture_u", "texture_v")])
def test_ply_texture(names: tuple[str, str], tmp_path: Path) -> None:
    (tmp_path / "red.png").write_bytes(png(np.array([[[255, 0, 0]]], dtype=np.uint8), 2, 8))
    vertex = "".join(f"property float {name}\n" for name in names)
    comments = "comment TextureFile red.png\n"
    rows = "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n"
    model = read(tmp_path, "a.ply", ply(rows, "3 0 1 2\n", vertex, comments=comments))
    assert corner_values(model, "texcoords").tolist() == [[[0, 0], [1, 0], [0, 1]]]
    assert model.images[0].decode().tolist() == [[[255, 0, 0, 255]]]
    assert model.materials[0].base_color == (1, 1, 1, 1)


def test_ply_texture_coordinates_of_corners(tmp_path: Path) -> None:
    face = "property list uchar float texcoord\n"
    faces = "3 0 1 2 6 0 0 1 0 1 1\n4 0 2 3 1 8 .5 .5 .5 .5 .5 .5 .5 .5\n"
    model = read(tmp_path, "a.ply", ply("0 0 0\n1 0 0\n1 1 0\n0 1 0\n", faces, face=face))
    found = corner_values(model, "texcoords").tolist()
    assert found[0] == [[0, 0], [1, 0], [1, 1]]
    assert found[1:] == [[[0.5, 0.5]] * 3] * 2


def test_ply_strips(tmp_path: Path) -> None:
    head = f"ply\nformat ascii 1.0\nelement vertex 5\n{XYZ}element tristrips 1\n"
    head += "property list int int vertex_indices\nend_header\n"
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in POINTS)
    model = read(tmp_path, "a.ply", f"{head}{rows}8 0 1 3 2 -1 3 2 4\n")
    expected = [(0, 1, 3), (3, 1, 2), (3, 2, 4)]
    found = corner_values(model, "vertices")
    assert found.tolist() == [[list(POINTS[index]) for index in triangle] for triangle in expected]
    assert (np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2] > 0).all()


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"plx\n", "not a PLY file"),
        (b"ply\nformat ascii 1.0\n", "its header has no end"),
        (
            b"ply\nformat ascii 1.0\nnonsense\nend_header\n",
            "this line of its header cannot be read: nonsense",
        ),
        (b"ply\nelement vertex 0\nend_header\n", "lacks a format"),
        (ply(TRIANGLE, "3 0 1 3\n"), r"a face uses vertex 3 of 3, counted from 0"),
        (ply(TRIANGLE, "3 0 1 -1\n"), "a face uses vertex -1 of 3"),
        (ply(TRIANGLE, "2 0 1\n"), "a face has 2 corners"),
        (ply(TRIANGLE, "9 0 1 2\n"), "cut short, or a list's length is wrong"),
        (ply_binary()[:-1], "cut short"),
        (
            f"ply\nformat ascii 1.0\nelement vertex 4000000000\n{XYZ}end_header\n1 2 3\n",
            "promises 4000000000 of 'vertex'",
        ),
        (ply(TRIANGLE, ""), "holds no triangles, so there is nothing to draw; not drawn: points$"),
        (ply("0 0 nan\n1 0 0\n0 1 0\n", "3 0 1 2\n"), "not finite"),
    ],
)
def test_damaged_ply_files(data: bytes | str, line: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=line):
        read(tmp_path, "a.ply", data)


def test_other_tables_of_ply_are_named(tmp_path: Path) -> None:
    text = ply(TRIANGLE, "3 0 1 2\n").replace(
        "end_header\n", "element edge 1\nproperty int vertex1\nend_header\n"
    )
    model = read(tmp_path, "a.ply", f"{text}0\n")
    assert model.losses == ["tables of PLY files other than vertices, faces and strips: 'edge'"]


def test_off_has_colors_normals_and_texture_coordinates(tmp_path: Path) -> None:
    rows = "0 0 0 0 3 4 255 0 0 255 0 0\n1 0 0 0 3 4 255 0 0 255 1 0\n0 1 0 0 3 4 255 0 0 255 0 1\n"
    arrays = read(tmp_path, "a.off", f"STCNOFF # all of it\n3 1 0\n{rows}3 0 1 2\n").geoms[0].arrays
    assert np.allclose(arrays["normals"], [0, 0.6, 0.8], atol=1e-15)
    assert (arrays["colors"] == [1, 0, 0, 1]).all()
    assert arrays["texcoords"][arrays["triangles"]].tolist() == [[[0, 0], [1, 0], [0, 1]]]


def test_off_colors_of_faces(tmp_path: Path) -> None:
    text = "OFF 4 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 0 1.0 0\n3 0 2 3 0 0 255\n4 0 1 2 3\n"
    found = corner_values(read(tmp_path, "a.off", text), "colors")
    assert found[:, 0].tolist() == [[0, 1, 0, 1], [0, 0, 1, 1], [0.8, 0.8, 0.8, 1], [0.8, 0.8, 0.8, 1]]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("ON\n", "its first word is not OFF"),
        ("OFF\n", "does not say how many"),
        ("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "cut short: it promises 3 vertices and 2 faces"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "a face uses vertex 3 of 3"),
        ("OFF\n3 1 0\n0 0 x\n1 0 0\n0 1 0\n3 0 1 2\n", "damaged OFF file"),
        ("OFF BINARY\n", "only text files of three dimensions"),
        ("CNOFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "damaged OFF file"),
    ],
)
def test_damaged_off_files(text: str, line: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=line):
        read(tmp_path, "a.off", text)


def test_stl_triangles_become_one_surface(tmp_path: Path) -> None:
    angle = 2 * np.pi * np.arange(25) / 24
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(25)], axis=1)
    low, high = ring, ring + np.array([0.0, 0.0, 1.0])
    corners = np.concatenate(
        [np.stack([low[:-1], low[1:], high[1:]], 1), np.stack([low[:-1], high[1:], high[:-1]], 1)]
    )
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in corners)
    data = b"x".ljust(80) + struct.pack("<I", len(corners)) + rows
    arrays = read(tmp_path, "a.stl", data).geoms[0].arrays
    outwards = arrays["vertices"] * [1, 1, 0]
    assert ((arrays["normals"] * outwards).sum(axis=1) > 0.99).all()


def test_a_binary_stl_may_begin_with_solid(tmp_path: Path) -> None:
    model = read(tmp_path, "a.stl", b"solid" + stl_binary()[5:])
    assert len(model.geoms[0].arrays["triangles"]) == 4


def test_solids_of_a_text_stl_are_nodes(tmp_path: Path) -> None:
    model = read(tmp_path, "a.stl", stl_text() + stl_text().replace(b"tetra", b"other part"))
    assert [node.name for node in model.nodes] == ["tetra", "other part"]
    assert (corner_values(model, "vertices") <= VERTICES.max(axis=0)).all()


def test_colors_of_stl_are_named(tmp_path: Path) -> None:
    data = bytearray(stl_binary())
    data[84 + 48] = 31
    assert read(tmp_path, "a.stl", bytes(data)).losses == ["attributes (colours) of STL triangles"]


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (stl_binary()[:-1], r"it promises 4 triangles and has 3\.98"),
        (
            stl_binary()[:80] + b"\xff\xff\xff\xff" + stl_binary()[84:],
            "promises 4294967295 triangles and has 4",
        ),
        (b"", "cut short: it has 0 bytes"),
        (stl_text()[:-20], "damaged STL file"),
        (stl_text().replace(b"vertex", b"vertx", 1), "cannot be read: vertx"),
        (stl_text().replace(b"1.0", b"1.x", 1), "has no numbers: vertex"),
        (b"solid a\nendsolid a\n", "holds no triangles"),
    ],
)
def test_damaged_stl_files(data: bytes, line: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=line):
        read(tmp_path, "a.stl", data)

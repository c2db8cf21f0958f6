"""PLY, OFF and STL files written here: what trimesh reads of them, and what is named since it does not."""

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
NORMALS = "".join(f"property float {name}\n" for name in ("nx", "ny", "nz"))
CODES = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
TRIANGLE = "0 0 0\n1 0 0\n0 1 0\n"
SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def read(folder: Path, name: str, data: bytes | str, limit: float = 100) -> ModelData:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_with_trimesh(path, None, limit)


def ply(vertices: str, faces: str, vertex: str = "", face: str = "", comments: str = "") -> str:
    """A text file: rows of vertices and faces, and more properties of either."""
    head = f"ply\nformat ascii 1.0\n{comments}element vertex {len(vertices.splitlines())}\n{XYZ}{vertex}"
    head += (
        f"element face {len(faces.splitlines())}\nproperty list uchar int vertex_indices\n{face}end_header\n"
    )
    return head + vertices + faces


def beside(rows: str, *more: str) -> str:
    """Rows with more numbers: one text for all of them, or one for each."""
    lines = rows.splitlines()
    texts = more if len(more) > 1 else more * len(lines)
    return "".join(f"{line} {text}\n" for line, text in zip(lines, texts, strict=True))


def corner_values(model: ModelData, what: str) -> np.ndarray:
    arrays = model.geoms[0].arrays
    return arrays[what][arrays["triangles"]]


def mixed_binary_ply(lengths: tuple[int, ...]) -> bytes:
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex 5\n{XYZ}element face {len(lengths)}\n"
    head += "property list uchar uint vertex_indices\nend_header\n"
    rows = b"".join(struct.pack(f"<B{length}I", length, *range(length)) for length in lengths)
    return head.encode() + np.array(POINTS, "<f4").tobytes() + rows


@pytest.mark.parametrize("lengths", [(4, 3), (4, 3, 5)])
def test_binary_ply_with_unlike_faces_is_one_line(lengths: tuple[int, ...], tmp_path: Path) -> None:
    """Also where lengths add up to what they would be if all were as long as the first."""
    with pytest.raises(
        ModelError, match=r"a\.ply: .* different numbers of corners, .*: export triangles, or"
    ):
        read(tmp_path, "a.ply", mixed_binary_ply(lengths))


def test_text_ply_with_unlike_faces(tmp_path: Path) -> None:
    model = read(tmp_path, "a.ply", ply(f"{SQUARE}0.5 2 0\n", "4 0 1 2 3\n3 3 2 4\n5 0 1 2 4 3\n"))
    found = corner_values(model, "vertices")
    areas = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2] / 2
    assert len(areas) == 2 + 1 + 3
    assert areas.sum() == 1 + 0.5 + 1.5


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
@pytest.mark.parametrize("texcoords", ["", "property float s\nproperty float t\n"])
def test_ply_colors_are_display_colors_of_any_type(
    kind: str, codes: tuple, texcoords: str, tmp_path: Path
) -> None:
    """Also beside texture coordinates, as Blender writes them."""
    vertex = CODES.replace("uchar", kind) + texcoords
    row = f"{' '.join(map(str, codes))} {'0.5 0.5' if texcoords else ''}"
    model = read(tmp_path, "a.ply", ply(beside(TRIANGLE, row), "3 0 1 2\n", vertex))
    assert np.allclose(model.geoms[0].arrays["colors"], [[1, srgb_to_linear(128 / 255), 0, 1]], atol=1e-6)
    assert model.materials[0].base_color == (1, 1, 1, 1)
    assert model.losses == []


def test_ply_colors_of_faces_split_vertices(tmp_path: Path) -> None:
    face = f"{CODES}property uchar alpha\n"
    faces = "3 0 1 2 255 0 0 255\n3 0 2 3 0 0 255 51\n"
    model = read(tmp_path, "a.ply", ply(SQUARE, faces, face=face))
    assert corner_values(model, "colors").tolist() == [[[1, 0, 0, 1]] * 3, [[0, 0, 1, 0.2]] * 3]
    assert model.materials[0].alpha_mode == "blend"
    assert len(model.geoms[0].arrays["vertices"]) == 6
    assert model.losses == []


def test_ply_normals_are_used(tmp_path: Path) -> None:
    model = read(tmp_path, "a.ply", ply(beside(TRIANGLE, "0 3 4"), "3 0 1 2\n", NORMALS))
    assert np.allclose(model.geoms[0].arrays["normals"], [0, 0.6, 0.8], atol=1e-15)


def red_png(folder: Path) -> str:
    (folder / "red.png").write_bytes(png(np.array([[[255, 0, 0]]], dtype=np.uint8), 2, 8))
    return "comment TextureFile red.png\n"


@pytest.mark.parametrize("names", [("u", "v"), ("s", "t"), ("texture_u", "texture_v")])
def test_ply_texture(names: tuple[str, str], tmp_path: Path) -> None:
    """The vertices stand in another order than faces use them, and one is unused."""
    vertex = NORMALS + "".join(f"property float {name}\n" for name in names)
    rows = beside("5 5 5\n" + TRIANGLE, "0 0 1 9 9", "0 3 4 0 0", "0 0 1 1 0", "0 4 3 0 1")
    model = read(tmp_path, "a.ply", ply(rows, "3 3 1 2\n", vertex, comments=red_png(tmp_path)))
    assert corner_values(model, "vertices").tolist() == [[[0, 1, 0], [0, 0, 0], [1, 0, 0]]]
    assert corner_values(model, "texcoords").tolist() == [[[0, 1], [0, 0], [1, 0]]]
    assert np.allclose(corner_values(model, "normals"), [[[0, 0.8, 0.6], [0, 0.6, 0.8], [0, 0, 1]]])
    (material,) = model.materials
    assert material.base_color == (1, 1, 1, 1)
    image = model.images[model.textures[material.texture].image]
    assert (image.name, image.decode().tolist()) == ("red.png", [[[255, 0, 0, 255]]])
    assert model.losses == []


def test_ply_texture_coordinates_of_corners(tmp_path: Path) -> None:
    face = "property list uchar float texcoord\n"
    faces = "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 .5 .5 .5 .5 .5 .5\n"
    model = read(tmp_path, "a.ply", ply(SQUARE, faces, face=face, comments=red_png(tmp_path)))
    found = corner_values(model, "texcoords").tolist()
    assert found == [[[0, 0], [1, 0], [1, 1]], [[0.5, 0.5]] * 3]
    assert corner_values(model, "vertices").tolist() == [
        [[0, 0, 0], [1, 0, 0], [1, 1, 0]],
        [[0, 0, 0], [1, 1, 0], [0, 1, 0]],
    ]
    assert model.losses == []


def test_textures_of_ply_stay_in_the_folder_and_below_the_limit(tmp_path: Path) -> None:
    vertex = "property float s\nproperty float t\n"
    rows = beside(TRIANGLE, "0 0")
    text = ply(rows, "3 0 1 2\n", vertex, comments="comment TextureFile /etc/hostname\n")
    model = read(tmp_path, "a.ply", text)
    assert model.losses == ["textures not found in the model's folder: '/etc/hostname'"]
    assert model.materials[0].texture is None
    assert model.materials[0].base_color == (0.8, 0.8, 0.8, 1)
    text = ply(rows, "3 0 1 2\n", vertex, comments=red_png(tmp_path))
    with pytest.raises(ModelError, match=r"texture 'red\.png' has 1x1 pixels, more than max_texture"):
        read(tmp_path, "a.ply", text, 1e-7)


EDGE = "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
CORNERS = "property list uchar float texcoord\n"


@pytest.mark.parametrize(
    ("text", "loss"),
    [
        (
            ply(TRIANGLE, "3 0 1 2\n").replace("end_header\n", EDGE) + "0 1\n",
            "tables of PLY files other than vertices and faces: 'edge'",
        ),
        (
            ply(beside(TRIANGLE, "1 0.5"), "3 0 1 2\n", "property float confidence\nproperty float w\n"),
            "columns of the PLY table 'vertex' that are not known: 'confidence', 'w'",
        ),
        (
            ply(TRIANGLE, "3 0 1 2 0\n", face="property int texnumber\n"),
            "columns of the PLY table 'face' that are not known: 'texnumber'",
        ),
        (
            ply(SQUARE, "4 0 1 2 3 255 0 0\n", face=CODES),
            "colours of PLY faces that are no triangles, or beside colours of vertices or a texture",
        ),
        (
            ply(beside(TRIANGLE, "1 2 3"), "3 0 1 2 255 0 0\n", CODES, CODES),
            "colours of PLY faces that are no triangles, or beside colours of vertices or a texture",
        ),
        (
            ply(beside(SQUARE, "0 0 1"), "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 1 0 1 1 0 1\n", NORMALS, CORNERS),
            "colours and normals of PLY vertices with several texture coordinates",
        ),
        (
            ply(TRIANGLE, "3 0 1 2\n", comments="comment TextureFile a.png\ncomment TextureFile b.png\n"),
            "textures before the last: 'a.png'",
        ),
    ],
)
def test_what_is_not_drawn_of_ply_is_named(text: str, loss: str, tmp_path: Path) -> None:
    (tmp_path / "b.png").write_bytes(png(np.zeros((1, 1, 3), dtype=np.uint8), 2, 8))
    assert read(tmp_path, "a.ply", text).losses == [loss]


ARROW = "0 0 0\n2 -1 0\n0 2 0\n-2 -1 0\n"
CONCAVE = "the shapes of concave faces, which trimesh cuts as if they were convex"


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.ply", ply(ARROW, "4 1 2 3 0\n")),
        ("a.ply", ply(ARROW, "4 1 2 3 0\n3 0 1 2\n")),
        ("a.off", f"OFF\n4 2 0\n{ARROW}4 1 2 3 0\n3 0 1 2\n"),
        (
            "a.ply",
            f"ply\nformat binary_little_endian 1.0\nelement vertex 4\n{XYZ}element face 1\n"
            "property list uchar int vertex_index\nend_header\n".encode()
            + np.array(ARROW.split(), "<f4").tobytes()
            + struct.pack("<B4i", 4, 1, 2, 3, 0),
        ),
    ],
)
def test_concave_faces_are_named(name: str, data: bytes | str, tmp_path: Path) -> None:
    assert read(tmp_path, name, data).losses == [CONCAVE]


def test_ply_strips_are_no_triangles(tmp_path: Path) -> None:
    head = f"ply\nformat ascii 1.0\nelement vertex 4\n{XYZ}element tristrips 1\n"
    head += "property list int int vertex_indices\nend_header\n"
    with pytest.raises(
        ModelError, match=r"nothing to draw; not drawn: .*other than vertices and faces: 'tris"
    ):
        read(tmp_path, "a.ply", f"{head}{SQUARE}4 0 1 3 2\n")


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"plx\n", "not a PLY file"),
        (b"ply\nformat ascii 1.0\n", "its header has no end"),
        (b"ply\nelement vertex 0\nend_header\n", r"a\.ply"),
        (ply(TRIANGLE, "3 0 1 3\n"), "uses a vertex that is not there"),
        (ply(TRIANGLE, "3 0 1 -1\n"), "uses a vertex that is not there"),
        (ply(TRIANGLE, "3 0 1 x\n"), "damaged .ply file"),
        (ply_binary()[:-1], "it is cut short, or"),
        (ply(TRIANGLE, "3 0 1 2\n")[:-8], "cut short: its header promises 1 of 'face'"),
        (
            ply(TRIANGLE, "3 0 1 2\n").replace("face 1", "face 4000000000"),
            "cut short: its header promises 4000000000 of 'face'",
        ),
        (
            ply(TRIANGLE, "3 0 1 2\n").replace("vertex 3", "vertex 4000000000"),
            "promises 4000000000 of 'vertex'|damaged .ply",
        ),
        (ply_binary().replace(b"vertex 4", b"vertex 4000000000"), "it is cut short, or"),
        (ply(TRIANGLE, ""), "holds no triangles, so there is nothing to draw; not drawn: points: "),
        (ply("0 0 nan\n1 0 0\n0 1 0\n", "3 0 1 2\n"), "not finite"),
    ],
)
def test_damaged_ply_files(data: bytes | str, line: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=line):
        read(tmp_path, "a.ply", data)


def test_off_has_faces_of_any_number_of_corners(tmp_path: Path) -> None:
    model = read(tmp_path, "a.off", f"OFF # a comment\n5 2 0\n{SQUARE}\n0.5 2 0\n4 0 1 2 3\n3 3 2 4\n")
    found = corner_values(model, "vertices")
    areas = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2] / 2
    assert sorted(areas.tolist()) == [0.5, 0.5, 0.5]
    assert [node.name for node in model.nodes] == ["a"]
    assert model.losses == []


@pytest.mark.parametrize(
    ("text", "loss"),
    [
        (f"OFF\n4 1 0\n{SQUARE}3 0 1 2 255 0 0\n", "colours of OFF faces"),
        (f"OFF 4 2 0\n{SQUARE}3 0 1 2\n2 0 1\n", "faces with one or two corners: points and lines"),
        (
            f"COFF\n3 1 0\n{beside(TRIANGLE, '255 0 0 255')}3 0 1 2\n",
            "colours, normals and texture coordinates of OFF vertices",
        ),
        (
            f"STCNOFF\n3 1 0\n{beside(TRIANGLE, '0 0 1 1 0 0 0 0')}3 0 1 2\n",
            "colours, normals and texture coordinates of OFF vertices",
        ),
    ],
)
def test_what_is_not_drawn_of_off_is_named(text: str, loss: str, tmp_path: Path) -> None:
    model = read(tmp_path, "a.off", text)
    assert corner_values(model, "vertices").shape == (1, 3, 3)
    assert model.losses == [loss]
    assert model.materials[0].base_color == (0.8, 0.8, 0.8, 1)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "the file is empty"),
        ("ON\n", "its first word is not OFF"),
        ("4OFF\n1 0 0\n0 0 0 0\n", "no text of three dimensions"),
        ("OFF\n", "damaged .off file"),
        (f"OFF\n3 2 0\n{TRIANGLE}3 0 1 2\n", "cut short: it promises 3 vertices and 2 faces"),
        (f"OFF\n4000000000 1 0\n{TRIANGLE}3 0 1 2\n", "cut short: it promises 4000000000 vertices"),
        (f"OFF\n3 1 0\n{TRIANGLE}3 0 1 3\n", "damaged .off file"),
        (f"OFF\n3 1 0\n{TRIANGLE}3 0 1\n", "a face has not the corners that it promises: 3 0 1"),
        ("OFF\n3 1 0\n0 0 x\n1 0 0\n0 1 0\n3 0 1 2\n", "damaged .off file"),
        ("OFF BINARY\n", "no text of three dimensions"),
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
        (b"", "the file is empty"),
        (stl_text()[:-20], "damaged .stl file"),
        (stl_text() + stl_text()[:-20], "cut short: it has 8 triangles, 24 corners, and no end"),
        (stl_text().replace(b"vertex", b"vertx", 1), "it has 4 triangles, 11 corners"),
        (stl_text().replace(b"1.0", b"1.x", 1), "damaged .stl file"),
        (b"solid a\nendsolid a\n", "holds no triangles"),
    ],
)
def test_damaged_stl_files(data: bytes, line: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=line):
        read(tmp_path, "a.stl", data)

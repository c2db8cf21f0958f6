"""OBJ files and their material libraries, written here line by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model.data import ModelData
from firefly_sample.model.trimesh_files import read_with_trimesh
from firefly_sample.srgb import srgb_to_linear
from tests.model.png_files import png

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def red_png(alpha: int = 255) -> bytes:
    return png(np.array([[[255, 0, 0, alpha]]], dtype=np.uint8), 6, 8)


def read(folder: Path, text: str, limit: float = 100.0, **files: bytes | str) -> ModelData:
    """Read an OBJ file with Z up; keyword `a_png` is the file a.png beside it."""
    for name, content in files.items():
        data = content if isinstance(content, bytes) else content.encode()
        (folder / name.replace("_", ".")).write_bytes(data)
    path = folder / "model.obj"
    path.write_text(text)
    return read_with_trimesh(path, "z", limit)


def corners(model: ModelData, geom: int = 0) -> list[list[list[float]]]:
    arrays = model.geoms[geom].arrays
    return arrays["vertices"][arrays["triangles"]].tolist()


def test_negative_indices_count_back_from_their_own_line(tmp_path: Path) -> None:
    model = read(tmp_path, f"{TRIANGLE}f -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n")
    low = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert corners(model) == [low, [[x, y, 5] for x, y, _ in low]]


def test_objects_are_nodes_and_materials_their_geoms(tmp_path: Path) -> None:
    text = (
        f"mtllib m.mtl\n{TRIANGLE}v 0 0 1\no Left part\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 4\n"
        "o Right\nusemtl a\nf 2 3 4\no Left part\nusemtl a\nf 1 3 4\n"
    )
    model = read(tmp_path, text, m_mtl="newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n")
    assert [(node.name, node.parent, node.geoms) for node in model.nodes] == [
        ("Left part", -1, (0, 1)),
        ("Right", -1, (2,)),
    ]
    assert [model.materials[geom.material].name for geom in model.geoms] == ["a", "b", "a"]
    assert len(corners(model, 0)) == 2
    assert model.losses == []


def test_groups_are_nodes_where_there_are_no_objects(tmp_path: Path) -> None:
    model = read(tmp_path, f"{TRIANGLE}v 0 0 1\ng wheel\nf 1 2 3\ng axle\nf 1 2 4\n")
    assert [node.name for node in model.nodes] == ["wheel", "axle"]
    model = read(tmp_path, f"{TRIANGLE}v 0 0 1\no car\ng wheel\nf 1 2 3\ng axle\nf 1 2 4\n")
    assert [node.name for node in model.nodes] == ["car"]


def test_texture_coordinates_and_normals_have_indices_of_their_own(tmp_path: Path) -> None:
    text = (
        f"{SQUARE}vt 0 0\nvt 1 0 0.5\nvt 1 1\nvn 0 0 1\nvn 0 3 4\nf 1/1/1 2/2/1 3/3/2\nf 1/3/2 3/3/2 4/1/2\n"
    )
    arrays = read(tmp_path, text).geoms[0].arrays
    found = {what: arrays[what][arrays["triangles"]].tolist() for what in ("texcoords", "normals")}
    assert found["texcoords"] == [[[0, 0], [1, 0], [1, 1]], [[1, 1], [1, 1], [0, 0]]]
    up, tilted = [0, 0, 1], [0, 0.6, 0.8]
    assert np.allclose(found["normals"], [[up, up, tilted], [tilted, tilted, tilted]], atol=1e-15)
    assert len(arrays["vertices"]) == 5  # 3/3/2 is one corner in both


def test_a_normal_without_direction_means_none(tmp_path: Path) -> None:
    arrays = read(tmp_path, f"{TRIANGLE}vn 0 0 0\nf 1//1 2//1 3//1\n").geoms[0].arrays
    assert (arrays["normals"] == [0, 0, 1]).all()


def test_smoothing_groups(tmp_path: Path) -> None:
    roof = "v 0 0 0\nv 1 0 0\nv 0 1 1\nv 1 1 1\nv 0 2 0\nv 1 2 0\n{}f 1 2 4 3\nf 3 4 6 5\n"
    counts = {
        statement: len(read(tmp_path, roof.format(statement)).geoms[0].arrays["vertices"])
        for statement in ("", "s 1\n", "s off\n", "s 0\n")
    }
    # its two slopes meet at 90 degrees: sharp by itself, smooth in a group; s off parts all triangles
    assert counts == {"": 8, "s 1\n": 6, "s off\n": 12, "s 0\n": 12}


def test_faces_of_many_corners_and_lines_that_go_on(tmp_path: Path) -> None:
    arrow = "v 0 0 0\nv 2 -1 0\nv 0 2 0\nv -2 -1 0\nf 1 2 \\\n3 4\n"
    found = np.array(corners(read(tmp_path, arrow)))
    assert len(found) == 2
    areas = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])[:, 2] / 2
    assert (areas > 0).all()
    assert areas.sum() == 4.0  # a fan from the first corner of a turned copy would leave the arrow


def test_vertex_colors_are_display_colors(tmp_path: Path) -> None:
    model = read(tmp_path, "v 0 0 0 1 0.5 0\nv 1 0 0 1 0.5 0\nv 0 1 0 1 0.5 0\nf 1 2 3\n")
    assert np.allclose(model.geoms[0].arrays["colors"], [[1, srgb_to_linear(0.5), 0, 1]])
    assert model.materials[0].base_color == (1, 1, 1, 1)


MATERIAL = """# a comment
newmtl shiny brass
Ka 1 1 1
Kd 0.5 0.25 1
Ks 0.2
Ns 40
Ke 0 0.5 0
d 0.5
illum 2
newmtl dull
Kd 1 1 1
Ks 1 1 1
Ns 40
Tr 0.25
illum 1
"""


def test_materials(tmp_path: Path) -> None:
    text = f"mtllib m.mtl\n{TRIANGLE}usemtl shiny brass\nf 1 2 3\nusemtl dull\nf 1 3 2\n"
    model = read(tmp_path, text, m_mtl=MATERIAL)
    brass, dull = model.materials
    half, quarter, fifth = (float(srgb_to_linear(code)) for code in (0.5, 0.25, 0.2))
    assert brass.name == "shiny brass"
    assert brass.base_color == pytest.approx((half, quarter, 1, 0.5))
    assert brass.specular == pytest.approx((fifth, fifth, fifth))
    assert brass.shininess == 40
    assert brass.emission == pytest.approx((0, half, 0))
    assert (brass.alpha_mode, brass.double_sided) == ("blend", True)
    assert (dull.base_color, dull.specular, dull.shininess) == ((1, 1, 1, 0.75), (0, 0, 0), 0)
    assert model.losses == []


def test_materials_with_metal_roughness_and_a_normal_map(tmp_path: Path) -> None:
    library = "newmtl a\nKs 1 1 1\nNs 40\nPr 0.25\nPm 0\nnorm -bm 0.5 red.png\n"
    library += "newmtl b\nKs 1 1 1\nNs 40\nPm 0.75\nnewmtl c\nKs 1 1 1\nNs 40\nPm 0\n"
    corners = "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
    faces = "".join(f"usemtl {name}\nf 1/1/1 2/2/1 3/3/1\n" for name in "abc")
    model = read(tmp_path, f"mtllib m.mtl\n{TRIANGLE}{corners}{faces}", m_mtl=library, red_png=red_png())
    plastic, metal, phong = model.materials
    assert (plastic.metallic, plastic.roughness, plastic.normal_scale) == (0.0, 0.25, 0.5)
    assert model.images[model.textures[plastic.normal_texture].image].name == "red.png"
    assert (metal.metallic, metal.roughness, metal.normal_texture) == (0.75, 1.0, None)
    assert (phong.metallic, phong.specular, phong.shininess) == (None, (1.0, 1.0, 1.0), 40.0)
    assert plastic.specular == metal.specular == (0.0, 0.0, 0.0)
    assert model.losses == []
    mapped, *others = model.geoms
    # u grows along the file's x, which is ours; v along its y, our z; it faces the file's z, our -y
    assert mapped.arrays["tangents"].tolist() == [[1.0, 0.0, 0.0, 1.0]] * 3
    assert not any("tangents" in geom.arrays for geom in others)


@pytest.mark.parametrize(
    "name",
    [
        "red.png",
        "./red.png",
        "a b/../red.png",
        r"C:\textures\red.png",
        "/home/someone/red.png",
        "../x/red.png",
    ],
)
def test_textures_lie_in_the_folder(name: str, tmp_path: Path) -> None:
    """A path of another machine finds the file of that name beside the model."""
    (tmp_path / "a b").mkdir()
    text = f"mtllib m.mtl\n{TRIANGLE}vt 0 0\nusemtl a\nf 1/1 2/1 3/1\n"
    model = read(tmp_path, text, m_mtl=f"newmtl a\nKd 0 0 0\nmap_Kd {name}\n", red_png=red_png())
    (material,) = model.materials
    assert material.base_color == (1, 1, 1, 1)  # black times a texture is no one's wish
    image = model.images[model.textures[material.texture].image]
    assert (image.name, image.size) == ("red.png", (1, 1))
    assert image.decode().tolist() == [[[255, 0, 0, 255]]]
    assert model.losses == []


def test_options_of_textures(tmp_path: Path) -> None:
    library = "newmtl a\nmap_Kd -clamp on -s 1 1 1 -o 0 0 red.png\nmap_Ke red.png\nmap_d red.png\nd 1\n"
    library += "newmtl b\nmap_Kd -s 2 2 -bm 0.5 red.png\n"
    text = f"mtllib m.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\n"
    model = read(tmp_path, text, m_mtl=library, red_png=red_png())
    clamped, plain = model.materials
    assert model.textures[clamped.texture].wrap_u == "clamp"
    assert model.textures[plain.texture].wrap_u == "repeat"
    assert len(model.images) == 1
    assert clamped.emission == (1, 1, 1)
    assert clamped.emission_texture == plain.texture
    assert model.losses == ["offset, scaled or turbulent textures (-o, -s, -t) of materials: 'b'"]
    assert clamped.alpha_mode == "mask"


LOSSES = [
    ("mtllib gone.mtl\nusemtl a\n", "", "material libraries not found in the model's folder: 'gone.mtl'"),
    ("usemtl a\n", "", "materials not found in a library: 'a'"),
    ("", "p 1\nl 1 2\n", "points"),
    ("o thing\n", "l 1 2\n", "lines: 'thing'"),
    ("mtllib m.mtl\nusemtl m\n", "", "textures not found in the model's folder: 'gone.png'"),
    ("mtllib m.mtl\nusemtl m\n", "", "map_bump statements of materials: 'm'"),
    ("mtllib m.mtl\nusemtl m\n", "", "opacity textures other than the diffuse texture, of materials: 'm'"),
    ("mtllib ../../../../../../../../etc/passwd\n", "", "material libraries not found in the model's folder"),
]


@pytest.mark.parametrize(("before", "after", "loss"), LOSSES)
def test_what_is_not_drawn_is_named(before: str, after: str, loss: str, tmp_path: Path) -> None:
    library = "newmtl m\nmap_Kd gone.png\nmap_Bump gone.png\nmap_d other.png\nPm 0.0\nTf 1 1 1\n"
    model = read(tmp_path, f"{TRIANGLE}{before}f 1 2 3\n{after}", m_mtl=library)
    assert any(line.startswith(loss) for line in model.losses), model.losses
    assert not any(line.startswith(("pm ", "tf ")) for line in model.losses)


def test_links_out_of_the_folder_are_not_followed(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "secret.mtl").write_text("newmtl a\nKd 1 0 0\n")
    (inner / "m.mtl").symlink_to(tmp_path / "secret.mtl")
    model = read(inner, f"mtllib m.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n")
    assert model.materials[0].name == "plain"
    assert len(model.losses) == 2


def test_a_link_to_itself_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").symlink_to(tmp_path / "m.mtl")
    model = read(tmp_path, f"mtllib m.mtl\n{TRIANGLE}f 1 2 3\n")
    assert model.losses == ["material libraries not found in the model's folder: 'm.mtl'"]


def test_large_textures_are_refused_before_they_are_decoded(tmp_path: Path) -> None:
    large = png(np.zeros((40, 50, 4), dtype=np.uint8), 6, 8)[:60]  # only the header is whole
    files = {"m_mtl": "newmtl a\nmap_Kd big.png\n", "big_png": large}
    text = f"mtllib m.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n"
    with pytest.raises(
        ModelError, match=r"texture 'big\.png' has 50x40 pixels, more than max_texture_megapixels=0\.001"
    ):
        read(tmp_path, text, 0.001, **files)
    model = read(tmp_path, text, 0.002, **files)
    with pytest.raises(ModelError, match=r"the texture 'big\.png' is damaged"):
        model.images[0].decode()


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (f"{TRIANGLE}f 1 2 4\n", "a face uses number 4 of 3 vertices"),
        (f"{TRIANGLE}f 1/1 2/1 3/1\n", "uses number 1 of 0 texcoords"),
        (f"{TRIANGLE}f 1 2 0\n", r"line 4 cannot be read \(index 0, of 3 before this line\): f 1 2 0"),
        (f"{TRIANGLE}f 1 2 -4\n", r"line 4 cannot be read \(index -4, of 3 before this line\)"),
        (f"{TRIANGLE}f 1 2\n", r"line 4 cannot be read \(a face has three corners or more\)"),
        (f"{TRIANGLE}f 1 2 x\n", "line 4 cannot be read"),
        ("v 0 0\n", r"line 1 cannot be read \(vertices have 3 numbers\)"),
        ("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a number that is not finite"),
        ("v 0 0 1e31\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", r"above 1e\+30"),
        (TRIANGLE, "holds no triangles, so there is nothing to draw$"),
        (f"{TRIANGLE}l 1 2\n", "nothing to draw; not drawn: lines$"),
        ("", "the file is empty"),
    ],
)
def test_damage_is_one_line(text: str, line: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=line) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_a_damaged_material_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        ModelError, match=r"model\.obj: material 'a' is damaged: could not convert string to float: 'x'"
    ):
        read(tmp_path, f"mtllib m.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n", m_mtl="newmtl a\nKd x\n")


def test_vertices_that_no_face_uses_may_be_anything(tmp_path: Path) -> None:
    model = read(tmp_path, f"{TRIANGLE}v nan nan nan\nf 1 2 3\n")
    assert len(model.geoms[0].arrays["vertices"]) == 3

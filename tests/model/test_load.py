"""load_model on real .glb files that a second program, trimesh, writes here, whole and damaged."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial

from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import ModelError
from firefly_sample.model.load import load_model
from firefly_sample.scene.geom import GeomNode

VERTICES = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 5.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
UVS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.25, 0.75]])


def picture() -> np.ndarray:
    pixels = np.zeros((4, 2, 4), np.uint8)
    pixels[0, 0] = (255, 0, 0, 255)
    pixels[3, 1] = (0, 128, 255, 40)
    return pixels


def textured(name: str = "leaf", **material: object) -> trimesh.Trimesh:
    surface = PBRMaterial(name=name, baseColorTexture=Image.fromarray(picture()), **material)
    visual = trimesh.visual.TextureVisuals(uv=UVS, material=surface)
    return trimesh.Trimesh(VERTICES, FACES, visual=visual, process=False)


def write(path: Path, scene: trimesh.Scene | trimesh.Trimesh, **options: object) -> Path:
    path.write_bytes(scene.export(file_type="glb", **options))
    return path


def edit_header(path: Path, change) -> None:
    """Rewrite the JSON chunk of a .glb by `change(header)`."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    header = json.loads(data[20 : 20 + length])
    change(header)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + data[20 + length :]
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


def corners(array: np.ndarray) -> np.ndarray:
    """The rows of vertices, one for each corner of each face: a file without normals has flat faces."""
    return array[FACES.ravel()]


def geom_nodes(root) -> dict[str, GeomNode]:
    found, waiting = {}, [root]
    while waiting:
        path = waiting.pop()
        if isinstance(path.node(), GeomNode) and path.node().geoms:
            found[path.get_name()] = path.node()
        waiting.extend(path.get_children())
    return found


def test_turns_y_up_into_z_up(tmp_path: Path) -> None:
    root = load_model(write(tmp_path / "tetra.glb", trimesh.Trimesh(VERTICES, FACES, process=False)))
    assert root.get_name() == "tetra"
    (node,) = geom_nodes(root).values()
    ((geom, _),) = node.geoms
    np.testing.assert_array_equal(geom.vertices, corners(VERTICES[:, [0, 2, 1]] * [1.0, -1.0, 1.0]))
    np.testing.assert_array_equal(geom.triangles, np.arange(12).reshape(4, 3))
    low, high = root.get_tight_bounds()
    np.testing.assert_allclose(np.array(low), [0.0, -5.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.array(high), [2.0, 0.0, 3.0], atol=1e-12)


def test_normals_come_from_the_file_and_are_turned(tmp_path: Path) -> None:
    mesh = trimesh.Trimesh(VERTICES, FACES, vertex_normals=np.tile([0.0, 1.0, 0.0], (4, 1)), process=False)
    root = load_model(write(tmp_path / "up.glb", mesh, include_normals=True))
    ((geom, _),) = next(iter(geom_nodes(root).values())).geoms
    np.testing.assert_array_equal(geom.normals, np.tile([0.0, 0.0, 1.0], (4, 1)))


def test_transforms_and_names_are_kept(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    mesh = trimesh.Trimesh(VERTICES, FACES, process=False)
    turn = trimesh.transformations.euler_matrix(0.3, -0.8, 1.1)
    turn[:3, 3] = (7.0, 8.0, 9.0)
    scene.graph.update(frame_to="arm", frame_from=scene.graph.base_frame, matrix=turn)
    shift = np.diag([2.0, 2.0, 2.0, 1.0])
    scene.add_geometry(mesh, node_name="hand", geom_name="hand mesh", parent_node_name="arm", transform=shift)
    root = load_model(write(tmp_path / "arm.glb", scene))
    hand = root.find("**/arm/hand")
    assert not hand.is_empty()
    ((geom, _),) = hand.node().geoms
    there = np.c_[geom.vertices, np.ones(12)] @ np.asarray(hand.get_mat(root))
    expected = (np.c_[VERTICES, np.ones(4)] @ (turn @ shift).T)[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(there[:, :3], corners(expected), atol=2e-6)


def test_one_mesh_under_several_nodes_is_one_geom(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(textured(), node_name="first", geom_name="shared")
    for k in range(3):
        moved = trimesh.transformations.translation_matrix((k + 1.0, 0.0, 0.0))
        scene.graph.update(frame_to=f"more {k}", geometry="shared", matrix=moved)
    nodes = geom_nodes(load_model(write(tmp_path / "four.glb", scene)))
    assert sorted(nodes) == ["first", "more 0", "more 1", "more 2"]
    assert len({id(node.geoms[0][0]) for node in nodes.values()}) == 1
    assert len({id(node.geoms[0][1]) for node in nodes.values()}) == 1


def test_each_load_is_a_fresh_tree(tmp_path: Path) -> None:
    path = write(tmp_path / "again.glb", textured())
    first, second = load_model(path), load_model(path)
    assert first.node() is not second.node()
    first.set_pos(1.0, 2.0, 3.0)
    np.testing.assert_array_equal(np.array(second.get_pos()), [0.0, 0.0, 0.0])


def test_material_texture_and_coordinates(tmp_path: Path) -> None:
    mesh = textured(alphaMode="MASK", alphaCutoff=0.25, doubleSided=True)
    ((geom, material),) = next(iter(geom_nodes(load_model(write(tmp_path / "m.glb", mesh))).values())).geoms
    assert (material.name, material.alpha_mode, material.alpha_cutoff) == ("leaf", "mask", 0.25)
    assert material.double_sided
    np.testing.assert_array_equal(material.base_color, np.ones(4))
    assert material.texture is not None
    np.testing.assert_array_equal(material.texture.pixels, picture())
    np.testing.assert_allclose(geom.texcoords, corners(UVS), atol=1e-7)


def test_material_defaults_and_exact_dark_color(tmp_path: Path) -> None:
    path = write(tmp_path / "m.glb", textured("dark"))

    def darken(header: dict) -> None:
        header["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [0.001, 0.01, 0.1, 1.0]

    edit_header(path, darken)
    ((_, material),) = next(iter(geom_nodes(load_model(path)).values())).geoms
    # trimesh rounds the factor to 8 bits, which would make these 0, 0.0118 and 0.102.
    np.testing.assert_array_equal(material.base_color, [0.001, 0.01, 0.1, 1.0])
    assert (material.alpha_mode, material.alpha_cutoff, material.double_sided) == ("opaque", 0.5, False)


@pytest.mark.parametrize("with_texture", [True, False])
def test_vertex_colors(tmp_path: Path, with_texture: bool) -> None:
    codes = np.array([[255, 0, 51, 255], [0, 255, 102, 255], [10, 20, 30, 255], [1, 2, 3, 255]], np.uint8)
    mesh = textured() if with_texture else trimesh.Trimesh(VERTICES, FACES, process=False)
    if with_texture:
        mesh.visual.vertex_attributes["color"] = codes
    else:
        mesh.visual.vertex_colors = codes
    ((geom, _),) = next(iter(geom_nodes(load_model(write(tmp_path / "c.glb", mesh))).values())).geoms
    assert geom.colors is not None
    np.testing.assert_array_equal(geom.colors, corners(codes[:, :3] / 255.0))


def test_primitives_of_one_mesh_are_geoms_of_one_node(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(textured("bark"), node_name="tree", geom_name="tree")
    scene.add_geometry(textured("leaf"), node_name="rest", geom_name="rest")
    path = write(tmp_path / "two.glb", scene)

    def merge(header: dict) -> None:
        header["meshes"][0]["primitives"] += header["meshes"][1]["primitives"]
        header["nodes"] = [node for node in header["nodes"] if node.get("mesh") == 0]
        header["scenes"][0]["nodes"] = [0]

    edit_header(path, merge)
    nodes = geom_nodes(load_model(path))
    assert list(nodes) == ["tree"]
    assert [material.name for _, material in nodes["tree"].geoms] == ["bark", "leaf"]


INTERRUPTED = """
import os, signal, sys

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it


class Knock:
    def find_spec(self, name, path=None, target=None):
        if name == "PIL":
            os.kill(os.getpid(), signal.SIGINT)


sys.meta_path.insert(0, Knock())
from firefly_sample.assets import model_path
from firefly_sample.model.load import load_model

try:
    load_model(model_path("cat.glb"))
except KeyboardInterrupt:
    print("interrupted")
sys.meta_path.pop(0)
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
load_model(model_path("cat.glb"))
"""


def test_ctrl_c_is_heard_while_an_image_is_decoded() -> None:
    env = {**os.environ, VARIABLE: "off"}  # a model that is kept needs no image
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, env=env)
    assert (done.returncode, done.stdout) == (0, "interrupted\n"), done.stderr


def test_gltf_is_read_without_trimesh(tmp_path: Path) -> None:
    path = write(tmp_path / "m.glb", textured())
    code = (
        f"import sys; from firefly_sample import load_model; load_model({str(path)!r}); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {"trimesh", "moderngl", "scipy"}.isdisjoint(done.stdout.split())


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"absent\.glb: no such file$"):
        load_model(tmp_path / "absent.glb")


def test_folder_is_not_a_model(tmp_path: Path) -> None:
    (tmp_path / "folder.glb").mkdir()
    for path in (tmp_path, tmp_path / "folder.glb"):
        with pytest.raises(ModelError, match=f"^model {path}: "):
            load_model(path)


@pytest.mark.parametrize("content", [b"PNG\r\n", b"solid " * 40])
def test_not_gltf(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "wrong.glb"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=r"wrong\.glb: neither binary glTF \(\.glb\) nor JSON"):
        load_model(path)


@pytest.mark.parametrize("keep", [8, 19, 30, 400, -1])
def test_truncated(tmp_path: Path, keep: int) -> None:
    path = write(tmp_path / "cut.glb", textured())
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(ModelError, match=r"cut\.glb: truncated"):
        load_model(path)


def test_wrong_version(tmp_path: Path) -> None:
    path = write(tmp_path / "old.glb", textured())
    data = bytearray(path.read_bytes())
    data[4] = 1
    path.write_bytes(data)
    with pytest.raises(ModelError, match=r"old\.glb: glTF version 1, expected 2"):
        load_model(path)


def test_damaged_header(tmp_path: Path) -> None:
    path = write(tmp_path / "bad.glb", textured())
    data = bytearray(path.read_bytes())
    data[25:35] = b"\x00" * 10
    path.write_bytes(data)
    with pytest.raises(ModelError, match=r"bad\.glb: damaged JSON"):
        load_model(path)


def _index_out_of_range(header: dict) -> None:
    header["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 99


def _buffer_too_short(header: dict) -> None:
    header["bufferViews"][1]["byteLength"] = 10**6


def _own_ancestor(header: dict) -> None:
    for node in header["nodes"]:
        node["children"] = list(range(len(header["nodes"])))


@pytest.mark.parametrize("damage", [_index_out_of_range, _buffer_too_short, _own_ancestor])
def test_damaged_content(tmp_path: Path, damage) -> None:
    path = write(tmp_path / "bad.glb", textured())
    edit_header(path, damage)
    with pytest.raises(ModelError, match=r"bad\.glb: ") as caught:
        load_model(path)
    assert "\n" not in str(caught.value)


def test_triangle_index_out_of_range(tmp_path: Path) -> None:
    path = write(tmp_path / "bad.glb", textured())
    data = path.read_bytes()
    indices = FACES.astype("<u4").tobytes()
    assert data.count(indices) == 1
    path.write_bytes(data.replace(indices, (FACES + 50).astype("<u4").tobytes()))
    with pytest.raises(
        ModelError, match=r"bad\.glb: meshes\[0\].* has the index 53, but there are 4 vertices"
    ):
        load_model(path)


@pytest.mark.parametrize("damage", ["first bytes", "last bytes"])
def test_damaged_texture(tmp_path: Path, damage: str) -> None:
    path = write(tmp_path / "bad.glb", textured())
    data = bytearray(path.read_bytes())
    start = data.index(b"\x89PNG")
    where = slice(start, start + 8) if damage == "first bytes" else slice(start + 40, start + 60)
    data[where] = bytes(where.stop - where.start)
    path.write_bytes(data)
    with pytest.raises(
        ModelError, match=r"bad\.glb: image 'image 0' of material 'leaf' (cannot be read|is damaged): "
    ):
        load_model(path)


def test_a_cloud_of_points(tmp_path: Path) -> None:
    scene = trimesh.Scene([trimesh.PointCloud(VERTICES)])
    root = load_model(write(tmp_path / "points.glb", scene))
    assert root.node().warnings == ()
    (node,) = (path.node() for path in root.find_all_matches("**/+GeomNode"))
    ((geom, material),) = node.geoms
    assert (geom.mode, material.unlit) == ("points", True)
    assert len(geom.indices) == len(VERTICES)


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan"), "many"])
def test_a_limit_of_textures_is_a_number_above_zero(tmp_path: Path, limit: object) -> None:
    with pytest.raises(ModelError, match="max_texture_megapixels must be a number above 0, got"):
        load_model(tmp_path / "m.glb", max_texture_megapixels=limit)

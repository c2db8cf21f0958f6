"""Draco and meshopt: decoded by their packages, read from what is uncompressed, or refused by name."""

from __future__ import annotations

import random
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.accessors import read_accessor
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.meshes import read_primitive
from firefly_sample.scene.transforms import vectors_from_gltf
from tests.model.gltf_files import COMPONENT_TYPES, TYPES, GltfFile
from tests.model.mutations import mutated_bytes

DRACO, MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"
SIDE = 8
POINTS = np.float32([[x, np.sin(x), y] for y in range(SIDE) for x in range(SIDE)])
UV = POINTS[:, [0, 2]] / (SIDE - 1)
COLORS = np.uint8([[3 * i, 255 - i, i, 255] for i in range(SIDE * SIDE)])
JOINTS = np.uint8([[i % 5, i % 3, 0, 0] for i in range(SIDE * SIDE)])
WEIGHTS = np.float32([[0.25, 0.75, 0, 0]] * SIDE * SIDE)
CELLS = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
TRIANGLES = np.concatenate(
    [
        np.stack([CELLS[:-1, :-1], CELLS[1:, :-1], CELLS[:-1, 1:]], axis=-1).reshape(-1, 3),
        np.stack([CELLS[:-1, 1:], CELLS[1:, :-1], CELLS[1:, 1:]], axis=-1).reshape(-1, 3),
    ]
)


@pytest.fixture
def _no_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DracoPy", "meshoptimizer"):
        monkeypatch.setitem(sys.modules, name, None)  # an import raises ImportError


def described(array: np.ndarray, **properties: Any) -> dict[str, Any]:
    """An accessor without bytes."""
    kind = {"componentType": COMPONENT_TYPES[array.dtype.str[1:]], "type": TYPES[array.shape[1:]]}
    return {"count": len(array)} | kind | properties


# Draco


def draco_file(data: bytes, ids: dict[str, int], **accessors: dict[str, Any]) -> GltfFile:
    file = GltfFile()
    given = {name: file.add("accessors", **each) for name, each in accessors.items()}
    extension = {"bufferView": file.view(data), "attributes": ids}
    file.mesh(indices=given.pop("indices"), **given, extensions={DRACO: extension})
    return file


def draco_grid() -> GltfFile:
    """The grid with all its attributes, of which positions are quantised to 16 bits by the encoder."""
    pytest.importorskip("DracoPy")
    import DracoPy

    data = DracoPy.encode(
        POINTS,
        TRIANGLES.astype(np.uint32),
        quantization_bits=16,
        preserve_order=True,
        generic_attributes={11: UV, 12: COLORS, 13: JOINTS, 14: WEIGHTS},
    )
    (position,) = [each for each in DracoPy.decode(data).attributes if each["attribute_type"] == 0]
    return draco_file(
        data,
        {"POSITION": position["unique_id"], "TEXCOORD_0": 11, "COLOR_0": 12, "JOINTS_0": 13, "WEIGHTS_0": 14},
        POSITION=described(POINTS),
        TEXCOORD_0=described(UV),
        COLOR_0=described(COLORS, normalized=True),
        JOINTS_0=described(JOINTS),
        WEIGHTS_0=described(WEIGHTS),
        indices=described(TRIANGLES.ravel().astype(np.uint16)),
    )


def read_grid(file: GltfFile, folder: Path) -> dict[str, np.ndarray]:
    found = read_primitive(Document.open(file.write(folder / "a.glb")), 0, 0, ((0, None),))
    assert found.arrays is not None
    return found.arrays


def test_draco_meshes_have_every_attribute_and_their_triangles(tmp_path: Path) -> None:
    found = read_grid(draco_grid(), tmp_path)
    corners = TRIANGLES.ravel()  # without normals, so the vertices are the corners of triangles, in order
    np.testing.assert_allclose(found["vertices"], vectors_from_gltf(POINTS[corners]), atol=SIDE / 2**16)
    np.testing.assert_array_equal(found["texcoords"], UV[corners] * [1.0, -1.0] + [0.0, 1.0])
    np.testing.assert_array_equal(found["colors"], COLORS[corners] / 255.0)
    weighted = WEIGHTS[corners] > 0
    np.testing.assert_array_equal(found["joints"], np.where(weighted, JOINTS[corners], 0))
    np.testing.assert_array_equal(found["joint_weights"], WEIGHTS[corners])


def test_attributes_beside_draco_are_read_as_usual(tmp_path: Path) -> None:
    file = draco_grid()
    (primitive,) = file.json["meshes"][0]["primitives"]
    primitive["attributes"]["NORMAL"] = file.accessor(np.float32([[0, 0, 1]] * len(POINTS)))
    found = read_grid(file, tmp_path)
    np.testing.assert_array_equal(found["normals"], [[0, -1, 0]] * len(POINTS))
    np.testing.assert_array_equal(found["triangles"], TRIANGLES)


def test_draco_that_does_not_fit_its_accessors(tmp_path: Path) -> None:
    file = draco_grid()
    file.json["accessors"][0]["count"] = 5
    with pytest.raises(ModelError, match=r"attributes\.POSITION: has the shape \(64, 3\), but its accessor"):
        read_grid(file, tmp_path)
    file = draco_grid()
    extension = file.json["meshes"][0]["primitives"][0]["extensions"][DRACO]
    extension["attributes"]["TEXCOORD_0"] = 99
    with pytest.raises(ModelError, match=r"attributes\.TEXCOORD_0: there is no attribute 99"):
        read_grid(file, tmp_path)
    del extension["bufferView"]
    with pytest.raises(ModelError, match="bufferView: is missing"):
        read_grid(file, tmp_path)


def test_damaged_draco(tmp_path: Path) -> None:
    file, chance, lines = draco_grid(), random.Random(1), []
    data = file.data
    for _ in range(150):
        file.data = mutated_bytes(data, chance).ljust(len(data), b"\0")[: len(data)]
        try:
            read_grid(file, tmp_path)
        except ModelError as error:
            lines.append(str(error))
    assert len(lines) > 20
    assert not any("\n" in line for line in lines)


@pytest.mark.usefixtures("_no_packages")
def test_draco_without_its_package_names_the_way_out(tmp_path: Path) -> None:
    file = draco_file(
        b"DRACO" + bytes(59),
        {"POSITION": 0},
        POSITION=described(POINTS),
        indices=described(np.uint16([0, 1, 2])),
    )
    with pytest.raises(ModelError, match=rf"{DRACO}: needs the package DracoPy: run .*pip install") as raised:
        read_grid(file, tmp_path)
    assert "\n" not in str(raised.value)


@pytest.mark.usefixtures("_no_packages")
def test_draco_without_its_package_is_ignored_where_it_is_optional(tmp_path: Path) -> None:
    file = GltfFile()
    extension = {"bufferView": file.view(b"DRACO"), "attributes": {"POSITION": 0}}
    file.mesh(POSITION=POINTS[:3], extensions={DRACO: extension})
    np.testing.assert_array_equal(read_grid(file, tmp_path)["vertices"], vectors_from_gltf(POINTS[:3]))


# meshopt


def meshopt_file(array: np.ndarray, data: bytes, fallback: bool = False, **extension: Any) -> GltfFile:
    """An accessor of a compressed view; its placeholder buffer has data only with `fallback`."""
    file = GltfFile()
    stride = array.dtype.itemsize * int(np.prod(array.shape[1:]))
    view = file.view(data)
    about = file.json["bufferViews"][view]
    file.json["bufferViews"][view] = {
        "buffer": 1,
        "byteLength": array.nbytes,
        "extensions": {MESHOPT: about | {"byteStride": stride, "count": len(array), **extension}},
    }
    file.add("accessors", bufferView=view, **described(array))
    placeholder: dict[str, Any] = {"byteLength": array.nbytes, "extensions": {MESHOPT: {"fallback": True}}}
    if fallback:
        placeholder["uri"] = "data:," + "".join(f"%{byte:02x}" for byte in array.tobytes())
    file.json["buffers"] = [{"byteLength": len(file.data)}, placeholder]
    return file


def read_meshopt(file: GltfFile, folder: Path) -> np.ndarray:
    return read_accessor(Document.open(file.write(folder / "a.glb")), 0, "here")


def test_meshopt_attributes(tmp_path: Path) -> None:
    meshoptimizer = pytest.importorskip("meshoptimizer")
    for array in (POINTS, WEIGHTS, COLORS, UV.astype(np.float32)):
        size = array.dtype.itemsize * array.shape[1]
        data = meshoptimizer.encode_vertex_buffer(array, len(array), size)
        found = read_meshopt(meshopt_file(array, bytes(data), mode="ATTRIBUTES"), tmp_path)
        np.testing.assert_array_equal(found, array)


@pytest.mark.parametrize("dtype", [np.uint16, np.uint32])
def test_meshopt_indices(tmp_path: Path, dtype: type) -> None:
    meshoptimizer = pytest.importorskip("meshoptimizer")
    array = TRIANGLES.ravel().astype(dtype)
    wide = array.astype(np.uint32)
    data = meshoptimizer.encode_index_buffer(wide, len(wide), len(POINTS))
    found = read_meshopt(meshopt_file(array, bytes(data), mode="TRIANGLES"), tmp_path)
    np.testing.assert_array_equal(  # the codec may turn the corners of a triangle, and keeps its winding
        [np.roll(row, -int(row.argmin())) for row in found.reshape(-1, 3)],
        [np.roll(row, -int(row.argmin())) for row in TRIANGLES],
    )
    data = meshoptimizer.encode_index_sequence(wide, len(wide), len(POINTS))
    found = read_meshopt(meshopt_file(array, bytes(data), mode="INDICES"), tmp_path)
    np.testing.assert_array_equal(found, array)


def test_meshopt_filters(tmp_path: Path) -> None:
    """Known answers of the extension's appendix B, for stored codes that need no rounding."""
    meshoptimizer = pytest.importorskip("meshoptimizer")
    cases = [
        # EXPONENTIAL: an exponent of 8 bits above a mantissa of 24, both signed
        (
            np.int32([[3 | (0 << 24), 5 | (2 << 24), -1 & 0xFFFFFF]]).view(np.float32),
            "EXPONENTIAL",
            [3, 20, -1],
        ),
        # OCTAHEDRAL: x and y of the octahedron in units of the third number
        (np.int8([[0, 0, 127, 0]]), "OCTAHEDRAL", [0, 0, 127, 0]),
        (np.int8([[127, 0, 127, 0]]), "OCTAHEDRAL", [127, 0, 0, 0]),
        (np.int16([[0, -32767, 32767, 7]]), "OCTAHEDRAL", [0, -32767, 0, 7]),
        # QUATERNION: three components times sqrt(2), the scale, and in two bits which one was left out
        (np.int16([[0, 0, 0, 32764 | 3]]), "QUATERNION", [0, 0, 0, 32767]),
        (np.int16([[0, 0, 0, 32764 | 0]]), "QUATERNION", [32767, 0, 0, 0]),
    ]
    for array, chosen, expected in cases:
        size = array.dtype.itemsize * array.shape[1]
        data = meshoptimizer.encode_vertex_buffer(array, len(array), size)
        file = meshopt_file(array, bytes(data), mode="ATTRIBUTES", filter=chosen)
        np.testing.assert_array_equal(read_meshopt(file, tmp_path), [expected])


@pytest.mark.parametrize(
    "wrong",
    [
        {"mode": "POINTS"},
        {"mode": "TRIANGLES"},  # whose elements have 2 or 4 bytes
        {"mode": "ATTRIBUTES", "filter": "QUATERNION"},  # whose elements have 8
        {"mode": "ATTRIBUTES", "filter": "NEW"},
        {"mode": "ATTRIBUTES", "count": 10**9},
        {"mode": "ATTRIBUTES", "byteStride": 300},
        {"mode": "ATTRIBUTES", "byteLength": 10**9},
        {"mode": "ATTRIBUTES"},  # and bytes that are no stream
        {},
    ],
)
def test_wrong_meshopt(tmp_path: Path, wrong: dict[str, Any]) -> None:
    pytest.importorskip("meshoptimizer")
    with pytest.raises(ModelError, match=rf"bufferViews\[0\]\.extensions\.{MESHOPT}"):
        read_meshopt(meshopt_file(POINTS, b"\xa0" + bytes(40), **wrong), tmp_path)


@pytest.mark.usefixtures("_no_packages")
def test_meshopt_without_its_package(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=rf"{MESHOPT}: needs the package meshoptimizer: run .*pip install"):
        read_meshopt(meshopt_file(POINTS, b"\xa0", mode="ATTRIBUTES"), tmp_path)
    found = read_meshopt(meshopt_file(POINTS, b"\xa0", fallback=True, mode="ATTRIBUTES"), tmp_path)
    np.testing.assert_array_equal(found, POINTS)

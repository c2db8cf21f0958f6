"""The script's glTF writer: another program reads what it wrote."""

from __future__ import annotations

import io
import json
import math
import struct

import numpy as np
import pytest
import trimesh

from models.gltf_writer import ARRAY_BUFFER, REPEAT, Gltf, turn, y_up


def chunks(data: bytes) -> tuple[dict, bytes]:
    """The description and the buffer of a .glb file."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    assert size % 4 == 0
    rest = data[20 + size :]
    if rest:
        (body_size,) = struct.unpack_from("<I", rest)
        assert rest[4:8] == b"BIN\0"
        assert body_size == len(rest) - 8
        assert body_size % 4 == 0
    return json.loads(data[20 : 20 + size]), rest[8:]


def test_another_program_reads_meshes_and_nodes() -> None:
    gltf = Gltf()
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], float)
    red = gltf.material("red", (1.0, 0.0, 0.0, 1.0))
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    colors = np.full((4, 4), 128, np.uint8)
    mesh = gltf.mesh([gltf.primitive(corners, faces, material=red, COLOR_0=colors)], "tetrahedron")
    above = gltf.node("above", translation=(0.0, 5.0, 0.0))
    gltf.node("below", above, mesh=mesh, rotation=turn((0, 0, 1), 90.0), scale=(2.0, 2.0, 2.0))
    scene = trimesh.load(io.BytesIO(gltf.glb()), file_type="glb", process=False)
    (read,) = scene.dump()
    # (x, y, z) is doubled, becomes (-y, x, z) and goes up by five
    moved = 2.0 * np.stack([-corners[:, 1], corners[:, 0], corners[:, 2]], 1) + (0.0, 5.0, 0.0)
    np.testing.assert_allclose(read.vertices, moved, atol=1e-6)
    np.testing.assert_array_equal(read.faces, faces)
    assert sorted(scene.graph.nodes) == ["above", "below", "world"]


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.uint16])
@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_rows_of_attributes_start_at_four_bytes(dtype: type, width: int) -> None:
    gltf = Gltf()
    gltf.accessor([1], "u1")
    values = np.arange(5 * width).reshape(5, width).astype(dtype)
    gltf.accessor(values, values.dtype.str[1:], ARRAY_BUFFER)
    header, body = chunks(gltf.glb())
    view = header["bufferViews"][1]
    size = width * values.itemsize
    stride = view.get("byteStride", size)
    assert view["byteOffset"] % 4 == stride % 4 == 0
    for k, row in enumerate(values):
        start = view["byteOffset"] + k * stride
        assert body[start : start + size] == row.tobytes()


def test_extensions_are_named_and_shared_times_are_written_once() -> None:
    gltf = Gltf()
    picture = gltf.texture(gltf.image(b"\x89PNG...", "picture"), wrapS=REPEAT)
    gltf.material("lit", texture=gltf.slot(picture, 1, scale=[2.0, 2.0]), emission=(1, 1, 1), strength=4.0)
    node = gltf.node("lamp", light=gltf.light("point", (1.0, 0.5, 0.0), 30.0))
    times = [0.0, 1.0]
    spin = turn((0, 1, 0), [0.0, 90.0])
    channels = [
        (node, "rotation", times, spin),
        (node, "translation", times, [(0, 0, 0), (0, 1, 0)], "STEP"),
    ]
    gltf.animation(channels, "turn")
    header, _ = chunks(gltf.glb())
    assert header["extensionsUsed"] == [
        "KHR_texture_transform",
        "KHR_materials_emissive_strength",
        "KHR_lights_punctual",
    ]
    assert header["nodes"][0]["extensions"] == {"KHR_lights_punctual": {"light": 0}}
    first, second = header["animations"][0]["samplers"]
    assert first["input"] == second["input"]
    assert header["accessors"][first["input"]]["min"] == [0.0]
    assert header["accessors"][first["input"]]["max"] == [1.0]
    assert second["interpolation"] == "STEP"
    assert header["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] == 1


def test_a_gltf_file_holds_its_buffer_or_names_it() -> None:
    gltf = Gltf()
    gltf.accessor([1.0, 2.0])
    held = json.loads(gltf.gltf())["buffers"][0]
    assert held == {"byteLength": 8, "uri": "data:application/octet-stream;base64,AACAPwAAAEA="}
    assert json.loads(gltf.gltf("data.bin"))["buffers"][0]["uri"] == "data.bin"


def test_axes_and_turns() -> None:
    np.testing.assert_array_equal(y_up([(1, 0, 0), (0, 1, 0), (0, 0, 1)]), [(1, 0, 0), (0, 0, -1), (0, 1, 0)])
    half = math.sqrt(0.5)
    np.testing.assert_allclose(turn((0, 2, 0), 90.0), (0.0, half, 0.0, half))
    assert turn((0, 0, 1), [0.0, 45.0, 90.0]).shape == (3, 4)

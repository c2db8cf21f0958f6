"""A damaged file gives arrays or a ModelError of one line, and nothing else."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.accessors import read_accessor
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.meshes import count_targets, read_primitive
from tests.model.gltf_files import GltfFile
from tests.model.mutations import mutated_bytes, mutated_json

CORNERS = np.float32([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 5], [1, 1, 1], [4, 0, 1]])
WIDTHS = {"vertices": 3, "normals": 3, "texcoords": 2, "texcoords_1": 2, "colors": 4}


def whole_file() -> GltfFile:
    """A file with one of everything that is read here."""
    file = GltfFile()
    file.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    mixed = file.view(np.arange(6 * 24, dtype=np.uint8).tobytes(), byteStride=24)
    quantised = file.add("accessors", bufferView=mixed, componentType=5122, count=6, type="VEC3")
    uv = file.add(
        "accessors", bufferView=mixed, byteOffset=8, componentType=5123, count=6, type="VEC2", normalized=True
    )
    sparse = file.add(
        "accessors",
        componentType=5126,
        count=6,
        type="VEC3",
        sparse={
            "count": 2,
            "indices": {"bufferView": file.view(bytes([1, 3])), "componentType": 5121},
            "values": {"bufferView": file.view(CORNERS[:2].tobytes())},
        },
    )
    file.accessor(np.eye(4, dtype=np.float32)[None])
    strip = file.primitive(
        POSITION=CORNERS,
        NORMAL=CORNERS + 1,
        TEXCOORD_0=uv,
        COLOR_0=np.uint8([[9, 99, 255, 0]] * 6),
        JOINTS_0=np.uint8([[0, 1, 2, 3]] * 6),
        WEIGHTS_0=np.float32([[0.5, 0.5, 0, 0]] * 6),
        indices=np.uint16([0, 1, 2, 3, 5, 4]),
        targets=[{"POSITION": sparse, "NORMAL": sparse}, {"POSITION": CORNERS}],
        mode=5,
    )
    flat = file.primitive(POSITION=quantised, TEXCOORD_0=uv, targets=[{"POSITION": sparse}] * 2)
    file.node(mesh=file.mesh(strip, flat, name="all", weights=[0.5, 0.25]))
    return file


def read_all(path: Path) -> Counter[str]:
    """Read everything, check what comes, and count what was read and refused."""
    done: Counter[str] = Counter()

    def attempt(read: Callable[[], Any]) -> Any:
        try:
            found = read()
        except ModelError as error:
            message = str(error)
        else:
            done["read"] += 1
            return found
        assert message.startswith("model ")
        assert "\n" not in message
        assert len(message) < 1000
        done["refused"] += 1
        return None

    document = attempt(lambda: Document.open(path))
    if document is None:
        return done
    for kind, read in (("bufferViews", document.read_buffer_view), ("accessors", read_accessor_of(document))):
        for index in range(attempt(lambda kind=kind: document.count(kind)) or 0):
            attempt(lambda read=read, index=index: read(index, "here"))
    for mesh, each in enumerate(attempt(lambda: document.items("meshes")) or []):
        attempt(lambda each=each: count_targets(each))
        for number in range(len(attempt(lambda each=each: each.objects("primitives")) or [])):
            found = attempt(
                lambda mesh=mesh, number=number: read_primitive(
                    document, mesh, number, ((0, None), (1, None))
                )
            )
            if found is not None and found.arrays is not None:
                check(found.arrays)
    return done


def read_accessor_of(document: Document) -> Callable[[int, str], Any]:
    return lambda index, where: read_accessor(document, index, where)


def check(arrays: dict[str, np.ndarray]) -> None:
    """What a `Geom` asks for: shapes that fit, indices in range and finite numbers."""
    count = len(arrays["vertices"])
    assert arrays["triangles"].shape[1] == 3
    assert 0 <= arrays["triangles"].min() <= arrays["triangles"].max() < count
    for name, array in arrays.items():
        assert np.isfinite(array).all(), name
        if name in WIDTHS:
            assert array.shape == (count, WIDTHS[name]), name
        if name.startswith("morph_"):
            assert array.shape[1:] == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(arrays["normals"], axis=1), 1.0, atol=1e-12)
    if "joints" in arrays:
        assert arrays["joints"].shape == arrays["joint_weights"].shape
        np.testing.assert_allclose(arrays["joint_weights"].sum(axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
def test_the_whole_file_is_read(tmp_path: Path, name: str) -> None:
    assert read_all(whole_file().write(tmp_path / name))["refused"] == 0


@pytest.mark.parametrize("seed", range(6))
def test_values_of_json(tmp_path: Path, seed: int) -> None:
    chance, file, done = random.Random(seed), whole_file(), Counter[str]()
    file.json["buffers"] = [{"byteLength": len(file.data)}]
    original = file.json
    for _ in range(60):
        file.json = mutated_json(original, chance)
        done += read_all(file.write(tmp_path / "a.glb"))
    assert done["read"] > 100
    assert done["refused"] > 10


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
def test_bytes_of_the_file(tmp_path: Path, name: str, seed: int) -> None:
    chance, path, done = random.Random(seed), tmp_path / name, Counter[str]()
    data = whole_file().write(path).read_bytes()
    for _ in range(60):
        path.write_bytes(mutated_bytes(data, chance))
        done += read_all(path)
    assert done["read"]
    assert done["refused"]


@pytest.mark.parametrize("seed", range(3))
def test_bytes_of_the_data(tmp_path: Path, seed: int) -> None:
    """Only the buffer is damaged, so that the JSON leads everywhere."""
    chance, done = random.Random(seed), Counter[str]()
    for _ in range(60):
        file = whole_file()
        file.data = mutated_bytes(file.data, chance).ljust(len(file.data), b"\xff")[: len(file.data)]
        done += read_all(file.write(tmp_path / "a.glb"))
    assert done["read"] > 1000


def test_every_truncation(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    data = whole_file().write(path).read_bytes()
    for length in range(0, len(data), 7):
        path.write_bytes(data[:length])
        assert read_all(path) == {"refused": 1}


def test_json_without_its_end(tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(json.dumps({"asset": {"version": "2.0"}, "meshes": [{"primitives": [{}]}]}).encode())
    assert read_all(path)["refused"] == 1

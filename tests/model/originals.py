"""Whole model files, one of everything that is read, from which damaged ones are made."""

from __future__ import annotations

import io
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tests.model import format_files
from tests.model.gltf_files import GltfFile
from tests.model.png_files import png
from tests.model.scene_files import CORNERS, TRIANGLES, add_camera

MODELS = Path(__file__).parents[2] / "models"
OWN = ("bulb", "cat", "walker", "lantern", "bonsai")
UV = CORNERS[:, :2] * 0.5
NORMALS = (CORNERS / np.linalg.norm(CORNERS, axis=1, keepdims=True)).astype(np.float32)
Original = Callable[[Path], Path]
"""Writes files into a folder, and returns the one that is the model."""


def images() -> list[bytes]:
    """A picture in every kind of file that glTF and Pillow know."""
    chance = np.random.default_rng(1)
    color = chance.integers(0, 256, (8, 8, 3), dtype=np.uint8)
    made = [png(color, 2, 8, interlaced=True), png(chance.integers(0, 65536, (4, 4, 1)), 0, 16)]
    for kind in ("PNG", "JPEG", "WEBP"):
        kept = io.BytesIO()
        Image.fromarray(color).save(kept, kind)
        made.append(kept.getvalue())
    kept = io.BytesIO()
    Image.fromarray(color).quantize(4).save(kept, "PNG")
    return [*made, kept.getvalue()]


def rich_file(inside: bool = True) -> GltfFile:
    """A file with textures, materials, a skin, morph targets, animations, instances, cameras and lights."""
    file = GltfFile()
    file.json["extensionsUsed"] = [
        "KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_emissive_strength",
        "EXT_mesh_gpu_instancing", "KHR_mesh_quantization", "KHR_materials_clearcoat",
    ]  # fmt: skip
    for number, data in enumerate(images()):
        view = {"bufferView": file.view(data), "mimeType": "image/png"}
        file.add("images", **(view if inside else {"uri": f"image%20{number}.png"}))
        file.add("textures", source=number, sampler=file.add("samplers", wrapS=33071, minFilter=9987))
    materials = [_material(file, number) for number in range(6)]
    still = [file.mesh(_box(file, material), name=f"box {material}") for material in materials]
    for place, mesh in enumerate(still):
        file.node(name=f"box {place}", mesh=mesh, translation=[3.0 * place, 0, 0], rotation=[0, 0.6, 0, 0.8])
    _add_quantised(file)
    _add_instances(file, still[0])
    _add_figure(file)
    add_camera(file, "eye", translation=[6.0, 3.0, 30.0])
    lens = {"xmag": 9.0, "ymag": 9.0, "znear": 0.1, "zfar": 99.0}
    camera = file.add("cameras", type="orthographic", orthographic=lens)
    file.node(name="plan", camera=camera, matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 6, 3, 40, 1])
    lights: list[dict[str, Any]] = [
        {"type": "point", "intensity": 300.0, "range": 40.0, "color": [1, 0.5, 0.2]},
        {"type": "spot", "intensity": 900.0, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.7}},
        {"type": "directional", "intensity": 2.0, "name": "sun"},
    ]
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    for light in range(3):
        extension = {"KHR_lights_punctual": {"light": light}}
        file.node(name=f"light {light}", translation=[4.0 * light, 6, 6], extensions=extension)
    return file


def _material(file: GltfFile, number: int) -> int:
    transform = {"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 2]}}
    return file.add(
        "materials",
        name=f"paint {number}",
        alphaMode=("OPAQUE", "MASK", "BLEND")[number % 3],
        alphaCutoff=0.4,
        doubleSided=number % 2 == 0,
        emissiveFactor=[0.2, 0.1, 0.0],
        emissiveTexture={"index": (number + 1) % 6, "texCoord": 1},
        normalTexture={"index": number, "scale": 0.5},
        occlusionTexture={"index": number},
        extensions={
            "KHR_materials_emissive_strength": {"emissiveStrength": 3.0},
            "KHR_materials_clearcoat": {"clearcoatFactor": 1.0},
        },
        pbrMetallicRoughness={
            "baseColorFactor": [0.9, 0.8, 0.7, 0.9],
            "baseColorTexture": {"index": number, "extensions": transform},
            "metallicFactor": 0.5,
            "roughnessFactor": 0.3,
            "metallicRoughnessTexture": {"index": number},
        },
    )


def _box(file: GltfFile, material: int) -> dict[str, Any]:
    return file.primitive(
        POSITION=CORNERS,
        NORMAL=NORMALS,
        TEXCOORD_0=UV,
        TEXCOORD_1=np.uint16(UV * 100),
        COLOR_0=np.uint8([[200, 150, 100, 255]] * 8),
        indices=TRIANGLES.ravel(),
        material=material,
    )


def _add_quantised(file: GltfFile) -> None:
    """A strip and a fan of positions in mixed bytes, of which a sparse accessor replaces some."""
    mixed = np.zeros((8, 12), dtype=np.int8)
    mixed[:, :3] = CORNERS
    view = file.view(mixed.tobytes(), byteStride=12)
    replaced = {
        "count": 2,
        "indices": {"bufferView": file.view(bytes([1, 3])), "componentType": 5121},
        "values": {"bufferView": file.view(np.int8([[1, 1, 1, 0], [2, 2, 2, 0]]).tobytes())},
    }
    position = file.add("accessors", bufferView=view, componentType=5120, count=8, type="VEC3")
    sparse = file.add("accessors", bufferView=view, componentType=5120, count=8, type="VEC3", sparse=replaced)
    strips = [file.primitive(POSITION=position, mode=5), file.primitive(POSITION=sparse, mode=6)]
    file.node(name="strips", mesh=file.mesh(*strips), translation=[0, 6, 0], scale=[0.5, 0.5, 0.5])


def _add_instances(file: GltfFile, mesh: int) -> None:
    attributes = {
        "TRANSLATION": file.accessor(np.float32([[x, -6, 0] for x in range(0, 20, 4)])),
        "ROTATION": file.accessor(np.float32([[0, 0, 0, 1]] * 5)),
        "SCALE": file.accessor(np.float32([[0.5, 1, 2]] * 5)),
    }
    file.node(name="many", mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})


def _add_figure(file: GltfFile) -> None:
    """A skinned box with two morph targets, moved by every kind of channel."""
    weights = np.float32([[1, 0, 0, 0] if y < 2 else [0.3, 0.7, 0, 0] for _, y, _ in CORNERS])
    primitive = file.primitive(
        POSITION=CORNERS,
        NORMAL=NORMALS,
        JOINTS_0=np.uint8([[0, 1, 0, 0]] * 8),
        WEIGHTS_0=weights,
        indices=TRIANGLES.ravel(),
        targets=[{"POSITION": CORNERS * 0.5, "NORMAL": NORMALS * 0.1}, {"POSITION": -CORNERS * 0.25}],
    )
    root = file.node(name="hip", translation=[0, 12, 0])
    upper = file.node(name="chest", parent=root, translation=[0, 2, 0])
    binds = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    binds[1, 1, 3] = -2.0
    skin = file.add("skins", joints=[root, upper], inverseBindMatrices=file.accessor(binds), skeleton=root)
    shape = file.mesh(primitive, name="figure", weights=[0.5, 0.0])
    figure = file.node(name="figure", mesh=shape, skin=skin)
    times = file.accessor(np.float32([0, 0.5, 2]))
    turns = [[0, 0, math.sin(a), math.cos(a)] for a in (0.0, 0.4, 0.8)]
    outputs = [
        (root, "translation", "LINEAR", [[0, 12, 0], [1, 13, 0], [2, 12, 0]]),
        (upper, "rotation", "LINEAR", turns),
        (upper, "scale", "STEP", [[1, 1, 1], [1, 2, 1], [1, 1, 1]]),
        (upper, "translation", "CUBICSPLINE", [[0, 2, 0]] * 9),
        (figure, "weights", "LINEAR", [0, 0, 1, 0, 0, 1]),
    ]
    samplers, channels = [], []
    for number, (node, path, interpolation, values) in enumerate(outputs):
        output = file.accessor(np.float32(values))
        samplers.append({"input": times, "output": output, "interpolation": interpolation})
        channels.append({"sampler": number, "target": {"node": node, "path": path}})
    file.add("animations", name="walk", samplers=samplers, channels=channels)
    file.add("animations", samplers=samplers[:1], channels=channels[:1])


def _own(name: str) -> Original:
    return lambda folder: Path(shutil.copy(MODELS / f"{name}.glb", folder))


def _rich(name: str) -> Original:
    return lambda folder: rich_file().write(folder / name)


def _beside(folder: Path) -> Path:
    for number, data in enumerate(images()):
        (folder / f"image {number}.png").write_bytes(data)
    return rich_file(inside=False).write(folder / "beside.gltf", beside=True)


def _draco(folder: Path) -> Path:
    from tests.model.test_gltf_compression import draco_grid

    file = draco_grid()
    file.node(mesh=0)
    return file.write(folder / "draco.glb")


def _meshopt(folder: Path) -> Path:
    import meshoptimizer

    from tests.model.test_gltf_compression import POINTS, meshopt_file

    data = meshoptimizer.encode_vertex_buffer(POINTS, len(POINTS), 12)
    file = meshopt_file(POINTS, bytes(data), mode="ATTRIBUTES")
    file.node(mesh=file.mesh(file.primitive(POSITION=0)))
    return file.write(folder / "meshopt.glb")


def _obj(folder: Path) -> Path:
    (folder / "wood grain.png").write_bytes(images()[2])
    (folder / "paint.mtl").write_text(
        "newmtl wood\nKd 0.8 0.7 0.6\nKs 0.2 0.2 0.2\nNs 40\nKe 0.1 0 0\nd 0.9\n"
        "map_Kd -s 2 2 1 wood grain.png\nnewmtl plain\nKd 1 0 0\nillum 2\n"
    )
    corners = "".join(f"v {x} {y} {z} 1 0.5 0.2\n" for x, y, z in CORNERS.tolist())
    corners += "".join(f"vt {u} {v}\n" for u, v in UV.tolist()) + "vn 0 0 1\nvn 0 1 0\n"
    sides = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
    faces = "".join("f " + " ".join(f"{at}/{at}/1" for at in side) + "\n" for side in sides[:3])
    faces += "usemtl plain\ns 1\n" + "".join("f " + " ".join(map(str, side)) + "\n" for side in sides[3:])
    path = folder / "box.obj"
    path.write_text(f"mtllib paint.mtl\no box\n{corners}usemtl wood\n{faces}f -1 -2 -3\nl 1 2\n")
    return path


def _zip_of_gltf(folder: Path) -> Path:
    inner = rich_file().write(folder / "inner.glb")
    path = folder / "archive.zip"
    path.write_bytes(format_files.zipped({"a/inner.glb": inner.read_bytes(), "a/notes.txt": b"none"}))
    inner.unlink()
    return path


def _format(suffix: str) -> Original:
    return lambda folder: format_files.write(folder, suffix)


def _binary_ply(folder: Path) -> Path:
    path = folder / "binary.ply"
    path.write_bytes(format_files.ply_binary("big"))
    return path


GLTF: dict[str, Original] = {
    "rich.glb": _rich("rich.glb"),
    "rich.gltf": _rich("rich.gltf"),
    "beside.gltf": _beside,
    "draco.glb": _draco,
    "meshopt.glb": _meshopt,
    **{f"{name}.glb": _own(name) for name in OWN},
}
OTHERS: dict[str, Original] = {
    "box.obj": _obj,
    "archive.zip": _zip_of_gltf,
    "binary.ply": _binary_ply,
    **{suffix: _format(suffix) for suffix in format_files.SUFFIXES if suffix != "obj"},
}
ISOLATED = ("dae", "zae", "3mf", "3dxml", "xaml", "step", "stp", "ctm")
"""Formats that are read in a process of their own, which takes a second or more."""

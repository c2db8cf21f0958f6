"""A box on the ground as a glTF file, with whatever a test adds to it."""

from __future__ import annotations

import numpy as np

from tests.model.gltf_files import GltfFile

CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (0, 4) for z in (-1, 1)], dtype=np.float32)
"""2 wide, 4 high and 2 deep, in glTF's axes."""
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))], dtype=np.uint16)


def box_file() -> GltfFile:
    """A file with a node "box"; it has the index 0."""
    file = GltfFile()
    file.node(name="box", mesh=file.mesh(POSITION=CORNERS, indices=TRIANGLES.ravel()))
    return file


def add_camera(file: GltfFile, name: str, **node: object) -> int:
    """Add a camera that looks along glTF's -Z, with 60 degrees from top to bottom."""
    lens = {"yfov": np.pi / 3, "aspectRatio": 2.0, "znear": 0.5, "zfar": 50.0}
    camera = file.add("cameras", type="perspective", perspective=lens)
    return file.node(name=name, camera=camera, **node)


def add_sun(file: GltfFile, name: str = "sun", **node: object) -> int:
    """Add a directional light of KHR_lights_punctual that shines along glTF's -Z."""
    file.json["extensionsUsed"] = ["KHR_lights_punctual"]
    lights = file.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})[
        "lights"
    ]
    lights.append({"type": "directional", "intensity": 3.0})
    light = {"KHR_lights_punctual": {"light": len(lights) - 1}}
    return file.node(name=name, extensions=light, **node)


def add_slide(file: GltfFile, name: str, distance: float, seconds: float = 2.0) -> None:
    """Add an animation that moves the box along x, and back at its end."""
    times = np.array([0.0, seconds], dtype=np.float32)
    places = np.array([(0.0, 0.0, 0.0), (distance, 0.0, 0.0)], dtype=np.float32)
    sampler = {"input": file.accessor(times), "output": file.accessor(places)}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    file.add("animations", name=name, samplers=[sampler], channels=[channel])

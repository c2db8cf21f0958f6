"""One quad in a glTF file, with a material and textures, for tests of everything but shapes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from firefly_sample.model.data import ModelData
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.reader import read_gltf
from tests.model.gltf_files import GltfFile

CORNERS = np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
"""In glTF's axes: the quad faces +Z, our -Y."""
TRIANGLES = np.uint16([[0, 1, 2], [0, 2, 3]])
UVS = np.float32([[0, 1], [1, 1], [1, 0], [0, 0]])
"""The whole picture, upright."""
NORMALS = np.float32([[0, 0, 1]] * 4)


def quad(file: GltfFile, **properties: Any) -> int:
    """Add the quad as a mesh, with normals, so that its vertices stay as they are."""
    given = {"POSITION": CORNERS, "NORMAL": NORMALS, "TEXCOORD_0": UVS, "indices": TRIANGLES.ravel()}
    return file.mesh(**{**given, **properties})


def reflected(
    base: Any, light: Any, cosine: float, metallic: float = 0.0, roughness: float = 1.0
) -> np.ndarray:
    """Return the radiance of a surface that is seen head-on, by glTF's appendix B.3 with N = V.

    `base` is the colour, `light` the irradiance (lux) of a plane that faces the light, `cosine` that of the
    light's angle.
    """
    base, a2 = np.asarray(base, float), roughness**4
    half = np.sqrt(0.5 + 0.5 * cosine)  # V.H = N.H: H lies in the middle between N and L
    start = 0.04 * (1.0 - metallic) + base * metallic
    fresnel = start + (1.0 - start) * (1.0 - half) ** 5
    density = a2 / (np.pi * (half * half * (a2 - 1.0) + 1.0) ** 2)
    masking = 2.0 * cosine / (cosine + np.sqrt(a2 + (1.0 - a2) * cosine * cosine))
    f = (1.0 - fresnel) * (1.0 - metallic) * base / np.pi + fresnel * density * masking / (4.0 * cosine)
    return f * np.asarray(light) * cosine


def picture(file: GltfFile, pixels: Any, **sampler: int) -> int:
    """Add a texture of these pixels, with a sampler if any of its properties is given."""
    data = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(data, "PNG")
    image = file.add("images", bufferView=file.view(data.getvalue()), mimeType="image/png")
    made = {"source": image}
    if sampler:
        made["sampler"] = file.add("samplers", **sampler)
    return file.add("textures", **made)


def shaded(file: GltfFile, **material: Any) -> GltfFile:
    """A file with one quad of this material."""
    file.node(mesh=quad(file, material=file.add("materials", **{"name": "paint", **material})))
    return file


def read(file: GltfFile, tmp_path: Path, **options: Any) -> ModelData:
    return read_gltf(Document.open(file.write(tmp_path / "model.glb")), **options)

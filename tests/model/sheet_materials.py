"""Small glTF files, each with one property of a surface: the contact sheet's last row."""

from __future__ import annotations

import math

import numpy as np
from PIL import Image

from models.gltf_writer import Gltf
from tests.model.sheet_shapes import CORAL, GOLD, TEAL, ball, card, cube, encoded, picture


def add(gltf, arrays, material, name, **node):
    """Add a node with one mesh of (points, normals, texcoords, triangles)."""
    points, normals, texcoords, triangles = arrays
    made = gltf.primitive(points, triangles, material=material, NORMAL=normals, TEXCOORD_0=texcoords)
    gltf.node(name, mesh=gltf.mesh([made]), **node)


def texture(gltf, values):
    """A texture of an array (h, w, 3) of 0 to 1."""
    codes = np.round(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
    return gltf.texture(gltf.image(encoded(Image.fromarray(codes))))


def metals():
    """Rough things above, smooth ones below; metal on the right."""
    gltf = Gltf()
    for x, metallic in ((-0.62, 0.0), (0.62, 1.0)):
        for y, roughness in ((0.62, 0.7), (-0.62, 0.25)):
            made = gltf.material(color=(*GOLD, 1.0), metallic=metallic, roughness=roughness)
            add(gltf, ball(0.58, 24, 40), made, f"ball {x} {y}", translation=(x, y, 0.0))
    return gltf


def roughness_map():
    """Bands of polished metal in rough paint."""
    gltf = Gltf()
    y, x = (np.mgrid[0:64, 0:128] + 0.5) / 64.0
    band = np.clip(8.0 * (np.sin(11.0 * y + 1.5 * np.sin(math.pi * x * 2.0)) - 0.1) + 0.5, 0.0, 1.0)
    values = np.stack([0.0 * band, 0.8 - 0.45 * band, band], axis=-1)
    slot = {"index": texture(gltf, values)}
    made = gltf.material(color=(*GOLD, 1.0), metallic=1.0, roughness=1.0)
    gltf.json["materials"][made]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = slot
    add(gltf, ball(1.0, 32, 56), made, "ball")
    return gltf


def hills(size=128, count=5):
    """Heights (size, size) of round bumps that repeat, 0 to 1, and their normals in tangent space."""
    y, x = ((np.mgrid[0:size, 0:size] + 0.5) / size * count) % 1.0 - 0.5
    height = np.sqrt(np.clip(0.16 - x * x - y * y, 0.0, 1.0)) / 0.4
    across, up = (0.5 * (np.roll(height, -1, k) - np.roll(height, 1, k)) for k in (1, 0))
    normals = np.stack([-across, up, np.full_like(height, 0.14)], axis=-1)  # rows go down, y goes up
    return height, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def normal_map():
    gltf = Gltf()
    bumps = gltf.slot(texture(gltf, 0.5 + 0.5 * hills()[1]))
    made = gltf.material(color=(*TEAL, 1.0), roughness=0.4, normalTexture=bumps)
    add(gltf, cube(), made, "cube")
    return gltf


def occlusion_map():
    """The same bumps as dark hollows, which only ambient light sees."""
    gltf = Gltf()
    dark = np.repeat(hills()[0][..., None], 3, axis=-1)
    made = gltf.material(color=(*TEAL, 1.0), roughness=0.8, occlusionTexture=gltf.slot(texture(gltf, dark)))
    add(gltf, cube(), made, "cube")
    return gltf


def blended():
    """Panes of three colours, one behind the other, in front of a ball."""
    gltf = Gltf()
    tones = (CORAL, GOLD, TEAL)
    for k, (x, tone) in enumerate(zip((-0.55, 0.0, 0.55), tones, strict=True)):
        glass = gltf.material(f"pane {k}", (*tone, 0.5), roughness=0.2, alphaMode="BLEND", doubleSided=True)
        place = (x, 0.14 * (k - 1), 0.7 - 0.45 * k)
        add(gltf, card(1.1, 1.3), glass, f"pane {k}", translation=place)
    add(gltf, ball(0.5), gltf.material(color=(0.8, 0.8, 0.8, 1.0)), "ball", translation=(0.0, 0.0, -1.0))
    return gltf


def unlit():
    gltf = Gltf()
    image = gltf.texture(gltf.image(encoded(picture())))
    gltf.use("KHR_materials_unlit")
    made = gltf.material(texture=image, extensions={"KHR_materials_unlit": {}})
    add(gltf, cube(), made, "cube")
    return gltf


FILES = {
    "plastic, metal": metals,
    "roughness map": roughness_map,
    "normal map": normal_map,
    "occlusion map": occlusion_map,
    "blended": blended,
    "unlit": unlit,
}

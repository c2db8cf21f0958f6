"""From pieces with Z up to the meshes of a glTF file."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
from gltf_writer import y_up
from PIL import Image

from builder.rounding import rounded
from builder.solids import Piece, shaded


def primitive(gltf, part, material, angle=50.0, textured=False, size=None):
    """A primitive of a piece, or of the five arrays of a `Surface`; colours only when they are not white.

    With a `size`, positions are written in units of it, in -1..1 as shorts, and normals as bytes
    (KHR_mesh_quantization); the node that holds the mesh has to scale them up again.
    """
    if isinstance(part, Piece):
        # without a texture there are no seams
        part = shaded(part if textured else replace(part, texcoords=0.0 * part.texcoords), angle)
    points, normals, texcoords, colors, triangles = part
    points, normals = y_up(points), y_up(normals)
    attributes = {}
    if size is not None:
        gltf.use("KHR_mesh_quantization", required=True)
        points = rounded(points / size * 32767.0).astype(np.int16)
        normals = rounded(normals * 127.0).astype(np.int8)
    if textured:
        # glTF counts v from the top; shorts are fine enough for what lies inside the picture
        texcoords = np.stack([texcoords[:, 0], 1.0 - texcoords[:, 1]], axis=1)
        if texcoords.min() >= 0.0 and texcoords.max() <= 1.0:
            texcoords = rounded(texcoords * 65535.0).astype(np.uint16)
        attributes["TEXCOORD_0"] = texcoords
    if np.min(colors) < 1.0:
        codes = rounded(np.clip(colors, 0.0, 1.0) * 255.0).astype(np.uint8)
        attributes["COLOR_0"] = np.concatenate([codes, np.full((len(codes), 1), 255, np.uint8)], axis=1)
    return gltf.primitive(points, triangles, material=material, NORMAL=normals, **attributes)


def jpeg(pixels, quality=85, **options):
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format="JPEG", quality=quality, optimize=True, **options)
    return stream.getvalue()


def png(pixels, colors=None):
    """PNG bytes; with `colors` as a palette of so many, each with its alpha."""
    image = Image.fromarray(pixels)
    if colors:
        image = image.quantize(colors, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    stream = io.BytesIO()
    image.save(stream, format="PNG", optimize=True)
    return stream.getvalue()

"""Writes .glb files through trimesh: named parts that share materials, Z up turned into glTF's Y up."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from builder.rounding import cleaned, rounded


@dataclass(frozen=True)
class Paint:
    """A material: its name and texture, RGB or RGBA; alpha makes it a two-sided cut-out."""

    name: str
    pixels: np.ndarray
    jpeg: bool = False

    def material(self):
        from trimesh.visual.material import PBRMaterial

        cut_out = self.pixels.shape[2] == 4
        return PBRMaterial(
            name=self.name,
            baseColorTexture=_jpeg(self.pixels) if self.jpeg else Image.fromarray(self.pixels),
            metallicFactor=0.0,
            roughnessFactor=1.0,
            alphaMode="MASK" if cut_out else "OPAQUE",
            alphaCutoff=0.5 if cut_out else None,
            doubleSided=cut_out,
        )


def _jpeg(pixels):
    """An image that is saved as the JPEG it is: trimesh would encode it again at a lower quality."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format="JPEG", quality=88, subsampling=0)
    data = stream.getvalue()
    image = Image.open(io.BytesIO(data))
    image.load()
    image.save = lambda target, **_: target.write(data)
    return image


def write_glb(path, parts):
    """Write `parts` = {name: [(Surface, Paint), ...]}: a node for each name, a mesh below for each pair."""
    import trimesh

    scene = trimesh.Scene()
    materials = {}
    for name, pieces in parts.items():
        for surface, paint in pieces:
            vertices, normals, texcoords, colors, triangles = surface.arrays()
            if paint.name not in materials:
                materials[paint.name] = paint.material()
            material = materials[paint.name]
            visual = trimesh.visual.TextureVisuals(uv=cleaned(texcoords), material=material)
            if colors.min() < 1.0:
                rgba = np.concatenate([colors, np.ones((len(colors), 1))], axis=1)
                visual.vertex_attributes["color"] = rounded(np.clip(rgba, 0.0, 1.0) * 255.0).astype(np.uint8)
            mesh = trimesh.Trimesh(
                vertices=cleaned(_y_up(vertices)),
                faces=triangles,
                vertex_normals=cleaned(_y_up(normals)),
                visual=visual,
                process=False,
            )
            title = f"{name} {paint.name}"
            if name not in scene.graph.nodes:
                scene.graph.update(frame_to=name, frame_from=scene.graph.base_frame)
            scene.add_geometry(mesh, node_name=title, geom_name=title, parent_node_name=name)
    data = scene.export(file_type="glb", include_normals=True)
    Path(path).write_bytes(data)


def _y_up(vectors):
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)

"""Writes glTF 2.0 files by hand: each method adds one object and returns its index.

Nothing is checked, and any property of the format can be given by its own name, so that this also makes
files that are odd or wrong on purpose:

    gltf = Gltf()
    triangle = gltf.primitive([(0, 0, 0), (1, 0, 0), (0, 1, 0)], material=gltf.material(color=(1, 0, 0, 1)))
    gltf.node("triangle", mesh=gltf.mesh([triangle]))
    data = gltf.glb()

Vectors and rotations are glTF's own: Y up, quaternions (x, y, z, w). `y_up` turns vectors that have Z up.
A node without `parent` belongs to the scene.
"""

from __future__ import annotations

import base64
import json
import math
import struct

import numpy as np

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
POINTS, LINES, LINE_LOOP, LINE_STRIP, TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = range(7)
NEAREST, LINEAR = 9728, 9729
CLAMP, MIRROR, REPEAT = 33071, 33648, 10497


class Gltf:
    """A file in the making: `json` is its description, `body` the bytes of its buffer."""

    def __init__(self):
        self.json = {"asset": {"version": "2.0", "generator": "firefly_sample"}, "scene": 0, "scenes": [{}]}
        self.body = bytearray()
        self.written = {}

    def add(self, part, **properties):
        """Append an object to the list `part`, without its properties that are None."""
        objects = self.json.setdefault(part, [])
        objects.append({key: value for key, value in properties.items() if value is not None})
        return len(objects) - 1

    def use(self, extension, required=False, **shared):
        """Name an extension as used; `shared` is what it holds for the whole file."""
        for part in ("extensionsUsed", "extensionsRequired") if required else ("extensionsUsed",):
            names = self.json.setdefault(part, [])
            if extension not in names:
                names.append(extension)
        if shared:
            self.json.setdefault("extensions", {}).setdefault(extension, {}).update(shared)

    # --- bytes and accessors

    def view(self, data, **properties):
        """Append bytes to the buffer as a view; `byteStride` and `target` are given where they are needed."""
        self.body.extend(bytes(-len(self.body) % 4))
        start = len(self.body)
        self.body.extend(data)
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **properties)

    def accessor(self, values, dtype="f4", target=None, bounds=False, **properties):
        """Append an array (n,), (n, width) or (n, 4, 4 of row vectors); `dtype` is a key of COMPONENTS.

        Rows of vertex attributes (`target` ARRAY_BUFFER) are padded to four bytes, as the format asks. An
        array that is there already is not written again.
        """
        values = np.asarray(values)
        rows = np.ascontiguousarray(values.reshape(len(values), -1), dtype=np.dtype(f"<{dtype}"))
        size = rows.shape[1] * rows.itemsize
        stride = None
        if target == ARRAY_BUFFER and size % 4:
            stride = size + -size % 4
            data = b"".join(row.tobytes().ljust(stride, b"\0") for row in rows)
        else:
            data = rows.tobytes()
        key = (data, rows.shape, dtype, target, bounds, repr(sorted(properties.items())))
        if key in self.written:
            return self.written[key]
        if bounds:
            properties |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.written[key] = self.add(
            "accessors",
            bufferView=self.view(data, byteStride=stride, target=target),
            componentType=COMPONENTS[dtype],
            count=len(rows),
            type=KINDS[rows.shape[1]],
            **properties,
        )
        return self.written[key]

    # --- meshes

    def primitive(
        self,
        positions,
        indices=None,
        *,
        material=None,
        mode=None,
        targets=None,
        extensions=None,
        **attributes,
    ):
        """A primitive, to be given to `mesh`.

        `attributes` are arrays, or accessors' indices, by glTF's names (NORMAL, TEXCOORD_0, COLOR_0, ...).
        Arrays of bytes and shorts are written as they are: normalised, but for JOINTS. `targets` are morph
        targets: dicts of arrays by name.
        """
        made = {"POSITION": self.attribute("POSITION", positions)}
        made |= {
            name: self.attribute(name, values) for name, values in attributes.items() if values is not None
        }
        primitive = {"attributes": made}
        if indices is not None:
            indices = np.asarray(indices).reshape(-1)
            dtype = "u2" if indices.max(initial=0) < 65535 else "u4"
            primitive["indices"] = self.accessor(indices, dtype, ELEMENT_ARRAY_BUFFER)
        if targets:
            primitive["targets"] = [
                {name: self.attribute(name, values) for name, values in target.items()} for target in targets
            ]
        others = {"material": material, "mode": mode, "extensions": extensions}
        return primitive | {key: value for key, value in others.items() if value is not None}

    def attribute(self, name, values):
        """The accessor of a vertex attribute from its array, or from its index, which is returned."""
        if isinstance(values, int):
            return values
        values = np.asarray(values)
        dtype = values.dtype.str[1:] if values.dtype.str[1:] in ("i1", "u1", "i2", "u2") else "f4"
        if name.startswith("JOINTS") and dtype not in ("u1", "u2"):
            dtype = "u2"
        normalized = True if dtype != "f4" and not name.startswith("JOINTS") else None
        return self.accessor(values, dtype, ARRAY_BUFFER, name == "POSITION", normalized=normalized)

    def mesh(self, primitives, name=None, **properties):
        """A mesh; `weights` are the defaults of its morph targets."""
        return self.add("meshes", name=name, primitives=primitives, **properties)

    # --- materials and images

    def image(self, data, name=None):
        """An image of encoded PNG or JPEG bytes, inside the buffer."""
        mime = "image/png" if data[:4] == b"\x89PNG" else "image/jpeg"
        return self.add("images", name=name, mimeType=mime, bufferView=self.view(data))

    def texture(self, image, **sampler):
        """A texture of an image; `sampler` holds wrapS, wrapT, minFilter and magFilter."""
        return self.add(
            "textures", source=image, sampler=self.add("samplers", **sampler) if sampler else None
        )

    def slot(self, texture, texcoord=None, **transform):
        """A reference to a texture, for a material.

        `transform` holds KHR_texture_transform's offset, rotation, scale and texCoord.
        """
        slot = {"index": texture}
        if texcoord:
            slot["texCoord"] = texcoord
        if transform:
            self.use("KHR_texture_transform")
            slot["extensions"] = {"KHR_texture_transform": transform}
        return slot

    def material(
        self,
        name=None,
        color=None,
        texture=None,
        *,
        metallic=0.0,
        roughness=1.0,
        emission=None,
        emission_texture=None,
        strength=None,
        extensions=None,
        **properties,
    ):
        """A material; textures are `slot`s or indices.

        `strength` is KHR_materials_emissive_strength. `properties` are glTF's own (alphaMode, alphaCutoff,
        doubleSided, ...).
        """
        extensions = dict(extensions or {})
        if strength is not None:
            self.use("KHR_materials_emissive_strength")
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        surface = {
            "baseColorFactor": None if color is None else list(color),
            "baseColorTexture": _slot(texture),
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        }
        return self.add(
            "materials",
            name=name,
            pbrMetallicRoughness={key: value for key, value in surface.items() if value is not None},
            emissiveFactor=None if emission is None else list(emission),
            emissiveTexture=_slot(emission_texture),
            extensions=extensions or None,
            **properties,
        )

    # --- nodes, cameras and lights

    def node(self, name=None, parent=None, *, light=None, extensions=None, **properties):
        """A node below `parent`; `properties` are mesh, translation, rotation, scale, matrix, camera, ..."""
        if light is not None:
            extensions = dict(extensions or {}) | {"KHR_lights_punctual": {"light": light}}
        index = self.add("nodes", name=name, extensions=extensions, **_plain(properties))
        over = self.json["scenes"][0] if parent is None else self.json["nodes"][parent]
        over.setdefault("nodes" if parent is None else "children", []).append(index)
        return index

    def camera(self, yfov, name=None, znear=0.1, zfar=100.0, **properties):
        """A perspective camera; `yfov` is in degrees."""
        lens = {"yfov": math.radians(yfov), "znear": znear, "zfar": zfar} | properties
        return self.add("cameras", name=name, type="perspective", perspective=lens)

    def light(self, kind, color=(1.0, 1.0, 1.0), intensity=1.0, name=None, **properties):
        """A light of KHR_lights_punctual: "point", "spot" or "directional"."""
        self.use("KHR_lights_punctual")
        shared = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})
        lights = shared["lights"]
        named = {} if name is None else {"name": name}
        lights.append(named | {"type": kind, "color": list(color), "intensity": intensity} | properties)
        return len(lights) - 1

    # --- animations and skins

    def animation(self, channels, name=None):
        """An animation of channels (node, path, times, values) or (node, path, times, values, interpolation).

        `path` is "translation", "rotation", "scale" or "weights".
        """
        made, samplers = [], []
        for node, path, times, values, *interpolation in channels:
            values = np.asarray(values, float)
            output = self.accessor(
                values.reshape(-1) if path == "weights" else values.reshape(-1, values.shape[-1])
            )
            sampler = {"input": self.accessor(times, bounds=True), "output": output}
            if interpolation:
                sampler["interpolation"] = interpolation[0]
            samplers.append(sampler)
            made.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
        return self.add("animations", name=name, channels=made, samplers=samplers)

    def skin(self, joints, inverse_bind=None, name=None, **properties):
        """A skin; `inverse_bind` (j, 4, 4) are matrices for row vectors, which glTF stores as they are."""
        matrices = None if inverse_bind is None else self.accessor(inverse_bind)
        return self.add("skins", name=name, joints=list(joints), inverseBindMatrices=matrices, **properties)

    # --- files

    def glb(self):
        """The bytes of a .glb file."""
        header = self.json | ({"buffers": [{"byteLength": len(self.body)}]} if self.body else {})
        text = json.dumps(header, separators=(",", ":")).encode()
        chunks = [(b"JSON", text + b" " * (-len(text) % 4))]
        if self.body:
            chunks.append((b"BIN\0", bytes(self.body) + bytes(-len(self.body) % 4)))
        data = b"".join(struct.pack("<I", len(chunk)) + kind + chunk for kind, chunk in chunks)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(data)) + data

    def gltf(self, buffer=None):
        """The text of a .gltf file whose buffer is the file `buffer` (bytes in `body`), or a data URI."""
        uri = buffer or "data:application/octet-stream;base64," + base64.b64encode(bytes(self.body)).decode()
        return json.dumps(self.json | {"buffers": [{"byteLength": len(self.body), "uri": uri}]}, indent=1)


def y_up(vectors):
    """Vectors (..., 3) of Z up in glTF's axes: (x, y, z) becomes (x, z, -y)."""
    vectors = np.asarray(vectors, float)
    return np.stack([vectors[..., 0], vectors[..., 2], -vectors[..., 1]], axis=-1)


def turn(axis, degrees):
    """The quaternion (x, y, z, w) that turns counter-clockwise about `axis`; `degrees` may be an array.

    It has nine decimals, which are the same on every processor.
    """
    half = np.radians(np.asarray(degrees, float)) / 2.0
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    quaternions = np.concatenate([np.sin(half)[..., None] * axis, np.cos(half)[..., None]], axis=-1)
    return np.round(quaternions, 9) + 0.0  # -0 becomes 0


def _slot(texture):
    return {"index": texture} if isinstance(texture, int) else texture


def _plain(properties):
    """`properties` with arrays and tuples as lists of numbers."""
    arrays = (np.ndarray, tuple)
    return {
        key: np.asarray(value, float).reshape(-1).tolist() if isinstance(value, arrays) else value
        for key, value in properties.items()
    }

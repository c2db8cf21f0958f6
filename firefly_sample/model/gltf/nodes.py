"""The nodes of a glTF file: which are drawn, in what order, and their transforms (glTF 2.0, section 3.5)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from firefly_sample.errors import ModelError
from firefly_sample.model.data import NodeData, SkinData
from firefly_sample.model.gltf.accessors import read_accessor
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.json_object import JsonObject, shown
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.transforms import Quat, Vec3, matrix_from_gltf, vectors_from_gltf

_AFFINE = (0.0, 0.0, 0.0, 1.0)
"""The last row of a matrix for column vectors."""


class Place(NamedTuple):
    """A node of the file, and the index of its parent's place (-1: the root)."""

    node: int
    parent: int
    shown: bool = True
    """False for a node outside the scene: it only moves the vertices of a skin."""


def drawn_nodes(document: Document, scene: str | int | None) -> list[Place]:
    """Return the nodes of a scene, each after its parent, children in the file's order.

    Joints that the scene lacks, and the nodes above them, follow at the end.

    Parameters
    ----------
    scene : str, int or None
        The name or the index of the scene. None: the file's default one, or else its first; all nodes if it
        has none.

    Raises
    ------
    ModelError
        If there is no such scene, or nodes do not form trees: one has two parents or is its own ancestor.
    """
    children, parents = _links(document)
    roots = _roots(document, scene)
    if roots is None:
        roots = [node for node, parent in enumerate(parents) if parent is None]
    seen: set[int] = set()
    for node in roots:
        if parents[node] is not None:
            raise document.error(
                f"nodes[{node}]", f"is a root of the scene, but also a child of nodes[{parents[node]}]"
            )
        if node in seen:
            raise document.error(f"nodes[{node}]", "is a root of the scene twice")
        seen.add(node)
    places: list[Place] = []
    waiting = [Place(node, -1) for node in reversed(roots)]
    while waiting:
        place = waiting.pop()
        index = len(places)
        places.append(place)
        waiting.extend(Place(child, index) for child in reversed(children[place.node]))
    places.extend(_joints_elsewhere(document, places, parents))
    return places


def _joints_elsewhere(document: Document, places: list[Place], parents: list[int | None]) -> list[Place]:
    """Return places for the joints that are not in the scene, and for the nodes above them."""
    found = {place.node: index for index, place in enumerate(places)}
    added: list[Place] = []
    nodes = (document.item("nodes", place.node, "node") for place in places)
    skins = dict.fromkeys(node.index("skin", "skins") for node in nodes)
    for skin in skins:
        if skin is None:
            continue
        for joint in document.item("skins", skin, "skin").indices("joints", "nodes"):
            above: list[int] = []
            node: int | None = joint
            while node is not None and node not in found:
                above.append(node)
                node = parents[node]
            for node in reversed(above):
                parent = parents[node]
                found[node] = len(places) + len(added)
                added.append(Place(node, -1 if parent is None else found[parent], shown=False))
    return added


def _links(document: Document) -> tuple[list[tuple[int, ...]], list[int | None]]:
    """Return the children and the parent of each node, after checking that they form trees."""
    nodes = document.items("nodes")
    children = [node.indices("children", "nodes") for node in nodes]
    parents: list[int | None] = [None] * len(nodes)
    for parent, below in enumerate(children):
        for child in below:
            if parents[child] is not None:
                raise document.error(
                    f"nodes[{child}]", f"has two parents, nodes[{parents[child]}] and nodes[{parent}]"
                )
            parents[child] = parent
    reached = bytearray(len(nodes))
    waiting = [node for node, parent in enumerate(parents) if parent is None]
    while waiting:
        node = waiting.pop()
        reached[node] = True
        waiting.extend(children[node])
    if not all(reached):  # the rest hangs on circles, since no node has two parents
        raise document.error(f"nodes[{reached.index(0)}]", "it, or a node above it, is its own ancestor")
    return children, parents


def _roots(document: Document, scene: str | int | None) -> list[int] | None:
    """Return the root nodes of a scene; None if the file has no scenes."""
    scenes = document.items("scenes")
    names = [found.text("name", "") for found in scenes]
    if scene is None:
        if not scenes:
            return None
        default = document.root.index("scene", "scenes")
        chosen = 0 if default is None else default
    elif isinstance(scene, str) and scene in names:
        chosen = names.index(scene)
    elif str(scene) in map(str, range(len(scenes))):
        chosen = int(scene)
    else:
        there = ", ".join(f"{index} {name!r}" if name else str(index) for index, name in enumerate(names))
        raise ModelError(f"model {document.path}: there is no scene {scene!r}: it has {there or 'none'}")
    return list(scenes[chosen].indices("nodes", "nodes"))


def node_name(node: JsonObject, index: int) -> str:
    """Return a node's name, or else its mesh's, or "node 7"."""
    name = node.text("name", "")
    if not name and (mesh := node.index("mesh", "meshes")) is not None:
        name = node.document.item("meshes", mesh, node.place("mesh")).text("name", "")
    return name or f"node {index}"


def with_transform(data: NodeData, node: JsonObject) -> NodeData:
    """Return a node's data with its transform, turned to Z up."""
    columns = node.numbers("matrix", 16, None)
    if columns is not None:
        matrix = np.array(columns).reshape(4, 4).T
        if not np.allclose(matrix[3], _AFFINE, rtol=0.0, atol=1e-6):
            raise node.error("matrix", "has a last row other than 0, 0, 0, 1")
        matrix[3] = _AFFINE
        turned = matrix_from_gltf(matrix)
        return data if np.array_equal(turned, np.eye(4)) else replace(data, matrix=turned)
    x, y, z = node.numbers("translation", 3, (0.0, 0.0, 0.0))
    sx, sy, sz = node.numbers("scale", 3, (1.0, 1.0, 1.0))
    return replace(
        data,
        translation=_positive_zeros((x, -z, y)),
        rotation=_rotation(node),
        scale=(sx, sz, sy),
    )


def _rotation(node: JsonObject) -> Quat:
    """Return a node's unit quaternion (w, x, y, z), turned to Z up."""
    x, y, z, w = node.numbers("rotation", 4, (0.0, 0.0, 0.0, 1.0))
    length = math.hypot(x, y, z, w)
    if not 0.0 < length < math.inf:
        raise node.error("rotation", f"must be a unit quaternion, got ({x:g}, {y:g}, {z:g}, {w:g})")
    ax, ay, az = _positive_zeros((x / length, -z / length, y / length))
    return w / length, ax, ay, az


def _positive_zeros(vector: Vec3) -> Vec3:
    """Return a vector with 0 in place of -0."""
    x, y, z = vector
    return x + 0.0, y + 0.0, z + 0.0


def read_instances(node: JsonObject) -> Float64 | None:
    """Return the matrices (n, 4, 4) of EXT_mesh_gpu_instancing, for row vectors; None without it.

    Attributes of other names, such as _ID, change nothing that is drawn.
    """
    extension = node.extension("EXT_mesh_gpu_instancing")
    if extension is None:
        return None
    accessors = extension.required_object("attributes").accessors()
    place = extension.place("attributes")
    kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
    columns = {
        name: read_accessor(node.document, accessors[name], f"{place}.{name}", (kind,)).astype(np.float64)
        for name, kind in kinds.items()
        if name in accessors
    }
    counts = {
        name: node.document.item("accessors", index, f"{place}.{name}").whole("count")
        for name, index in accessors.items()
    }
    if len(set(counts.values())) != 1:
        raise extension.error("attributes", f"must have one and the same count, got {counts}")
    count = next(iter(counts.values()))
    node.document.claim(16 * count, extension.where)
    matrices = np.zeros((count, 4, 4))
    matrices[:] = np.eye(4)
    if "ROTATION" in columns:
        matrices[:, :3, :3] = _rows_of(columns["ROTATION"], extension)
    if "SCALE" in columns:
        matrices[:, :3, :3] *= columns["SCALE"][:, (0, 2, 1), None]
    if "TRANSLATION" in columns:
        matrices[:, 3, :3] = vectors_from_gltf(columns["TRANSLATION"])
    return matrices


def _rows_of(quats: Float64, extension: JsonObject) -> Float64:
    """Return the rotations (n, 3, 3) of glTF's quaternions (x, y, z, w), turned to Z up, for row vectors."""
    lengths = np.linalg.norm(quats, axis=1)
    if not (lengths > 0.0).all():
        raise extension.error("attributes.ROTATION", f"element {int(np.argmin(lengths))} has no length")
    turned = vectors_from_gltf(quats[:, :3] / lengths[:, None])
    (x, y, z), w = turned.T, quats[:, 3] / lengths
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def read_skin(document: Document, index: int, places: dict[int, int]) -> SkinData:
    """Return a skin; `places` maps nodes of the file to those that are drawn."""
    skin = document.item("skins", index, "skin")
    joints = skin.indices("joints", "nodes")
    if not joints:
        raise skin.error("joints", "are missing")
    accessor = skin.index("inverseBindMatrices", "accessors")
    inverse_bind = np.zeros((len(joints), 4, 4))
    inverse_bind[:] = np.eye(4)
    if accessor is not None:
        where = skin.place("inverseBindMatrices")
        matrices = read_accessor(document, accessor, where, ("MAT4",)).astype(np.float64)
        if len(matrices) < len(joints):
            raise document.error(where, f"are {len(matrices)} for {shown(len(joints))} joints")
        inverse_bind = np.array([matrix_from_gltf(matrix) for matrix in matrices[: len(joints)]])
        if not np.allclose(inverse_bind[:, :, 3], _AFFINE, rtol=0.0, atol=1e-5):
            raise document.error(where, "have a last row other than 0, 0, 0, 1")
        inverse_bind[:, :, 3] = _AFFINE
    name = skin.text("name", "") or f"skin {index}"
    return SkinData(name, tuple(places[joint] for joint in joints), inverse_bind)

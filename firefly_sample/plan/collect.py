"""Walk the scene graph once and keep what can be drawn as arrays, in world space.

A walk is Python and slow; everything after it is vectorised. A `Snapshot` is kept until the graph's
`subtree_revision` changes, so that a still forest is walked once and not once a frame.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lights import AmbientLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.sprites import Sprites
from firefly_sample.scene.traversal import iter_visible

__all__ = ["Group", "Snapshot", "collect"]

Float64 = NDArray[np.float64]
Color = tuple[float, float, float, float]


@dataclass(eq=False)
class Group:
    """All instances of one Geom with one material and one flat colour.

    Attributes
    ----------
    geom, material, color, mirrored : see `firefly_sample.plan.frame_plan.Batch`
    model_to_world : ndarray of float64, shape (n, 4, 4)
    ids : ndarray of int32, shape (n,)
    centers : ndarray of float64, shape (n, 3)
        Of the bounding spheres, world space.
    radii : ndarray of float64, shape (n,)
        Of the bounding spheres.
    """

    geom: Geom
    material: Material
    color: Color | None
    mirrored: bool
    model_to_world: Float64
    ids: NDArray[np.int32]
    centers: Float64
    radii: Float64
    geom_revision: int


@dataclass(eq=False)
class Snapshot:
    """What one walk found: geometry groups, and the nodes of lights and sprites with their net matrices."""

    groups: list[Group] = field(default_factory=list)
    lights: list[tuple[PointLights, Float64]] = field(default_factory=list)
    ambient: list[AmbientLight] = field(default_factory=list)
    sprites: list[tuple[Sprites, Float64]] = field(default_factory=list)
    id_names: tuple[str, ...] = ()
    root: NodePath | None = None
    revision: int = -1
    camera_mask: int = 0

    def is_current(self, root: NodePath, camera_mask: int) -> bool:
        """True while nothing under `root` has changed since the walk, nor above it, which counts too."""
        return (
            self.root == root
            and self.camera_mask == camera_mask
            and self.revision == root.get_top().node().subtree_revision
            and all(group.geom.revision == group.geom_revision for group in self.groups)
        )


def collect(root: NodePath, camera_mask: int) -> Snapshot:
    """Walk everything under `root` that a camera with this mask sees."""
    revision = root.get_top().node().subtree_revision
    snapshot = Snapshot(root=root, revision=revision, camera_mask=camera_mask)
    found: dict[tuple[int, int, Color | None, bool], tuple[Geom, Material, list[Float64], list[int]]] = {}
    names: list[str] = []
    for visit in iter_visible(root, camera_mask):
        node = visit.node
        if isinstance(node, GeomNode):
            color = None if visit.color is None else _color(visit.color)
            mirrored = bool(np.linalg.det(visit.net[:3, :3]) < 0)
            for geom, own in node.geoms:
                if not len(geom.triangles):
                    continue  # nothing to draw must cost nothing
                material = visit.material if visit.material is not None else own
                key = (id(geom), id(material), color, mirrored)
                entry = found.setdefault(key, (geom, material, [], []))
                entry[2].append(visit.net)
                entry[3].append(len(names))
            names.append(visit.path)
        elif isinstance(node, PointLights):
            snapshot.lights.append((node, visit.net))
        elif isinstance(node, AmbientLight):
            snapshot.ambient.append(node)
        elif isinstance(node, Sprites):
            snapshot.sprites.append((node, visit.net))
    for (_, _, color, mirrored), (geom, material, nets, ids) in found.items():
        group = _group(geom, material, color, mirrored, np.array(nets), np.array(ids, dtype=np.int32))
        snapshot.groups.append(group)
    snapshot.id_names = tuple(names)
    return snapshot


def _color(color: object) -> Color:
    r, g, b, a = (float(channel) for channel in color)  # type: ignore[attr-defined]
    return r, g, b, a


def _group(
    geom: Geom,
    material: Material,
    color: Color | None,
    mirrored: bool,
    nets: Float64,
    ids: NDArray[np.int32],
) -> Group:
    """A group with bounding spheres; a sphere's radius grows with the matrix's largest singular value."""
    low, high = geom.bounds
    center = 0.5 * (low + high)
    radius = float(np.linalg.norm(geom.vertices - center, axis=1).max()) if len(geom.vertices) else 0.0
    centers = center @ nets[:, :3, :3] + nets[:, 3, :3]
    stretch = np.linalg.norm(nets[:, :3, :3], ord=2, axis=(1, 2))
    return Group(geom, material, color, mirrored, nets, ids, centers, radius * stretch, geom.revision)

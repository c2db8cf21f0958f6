"""A model file as plain data, before it becomes nodes: what every reader makes.

All of it is in this package's conventions: Z up, row vectors, linear colours of 0 to 1, texture coordinates
with v up. Indices are into the lists of `ModelData`. All numbers are float64 unless a type says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import GeomMode
from firefly_sample.scene.material import AlphaMode
from firefly_sample.scene.texture import MagFilter, MinFilter, Wrap

Interpolation = Literal["STEP", "LINEAR", "CUBICSPLINE"]


@dataclass
class ImageData:
    """An image of a file, which `decode` returns as uint8 RGBA (height, width, 4), the first row on top."""

    name: str
    size: tuple[int, int]  # width, height
    decode: Callable[[], NDArray[np.uint8]]


@dataclass
class TextureData:
    """An image and how it is sampled."""

    image: int
    wrap_u: Wrap = "repeat"
    wrap_v: Wrap = "repeat"
    minfilter: MinFilter = "linear_mipmap_linear"
    magfilter: MagFilter = "linear"


@dataclass
class MaterialData:
    """The arguments of a `Material`, with indices for its textures."""

    name: str
    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    texture: int | None = None
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission_texture: int | None = None
    emission_texcoord: int = 0  # 1: sampled with the geoms' "texcoords_1"
    specular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shininess: float = 0.0
    metallic: float | None = None  # None: a Phong material
    roughness: float = 1.0
    metallic_roughness_texture: int | None = None
    metallic_roughness_texcoord: int = 0
    normal_texture: int | None = None
    normal_texcoord: int = 0
    normal_scale: float = 1.0
    occlusion_texture: int | None = None
    occlusion_texcoord: int = 0
    occlusion_strength: float = 1.0
    unlit: bool = False


@dataclass
class GeomData:
    """Triangles, lines or points, and the index of their material.

    `arrays` holds "vertices" (n, 3) and "triangles" (m, 3) of int32, of the mode "lines" (m, 2) and of
    "points" (m, 1), and of these what there is: "normals"
    (n, 3), unit vectors; of a normal map "tangents" (n, 4), see `Geom`; "texcoords" and "texcoords_1" (n, 2);
    "colors" (n, 4); of a mesh with k morph targets "morph_vertices", "morph_normals" and "morph_tangents"
    (k, n, 3), which are added with their weights; of a skinned mesh "joints" (n, j) of int32, indices into
    `SkinData.joints`, and "joint_weights" (n, j).

    `flat` says that the file has no normals, so that each triangle has one, in whatever pose: "normals" are
    those at rest, and no vertex belongs to two triangles.
    """

    name: str
    material: int
    arrays: dict[str, NDArray[Any]]
    flat: bool = False
    mode: GeomMode = "triangles"


@dataclass
class CameraData:
    """A camera, which looks along its node's +Y.

    Perspective: `fov` is the vertical angle in degrees, `aspect` width over height, None for the picture's.
    Orthographic: `film_size` is the width and height that it sees, in scene units.
    """

    name: str
    near: float
    far: float  # may be infinite
    fov: float | None = None
    aspect: float | None = None
    film_size: tuple[float, float] | None = None


@dataclass
class LightData:
    """A light of KHR_lights_punctual, which shines along its node's +Y.

    `intensity` is as in the file: candela of "point" and "spot", lux of "directional". `range` may be
    infinite. Angles are half-angles in degrees.
    """

    name: str
    kind: Literal["point", "spot", "directional"]
    color: tuple[float, float, float]
    intensity: float
    range: float
    inner: float = 0.0
    outer: float = 45.0


@dataclass
class NodeData:
    """A node: the index of its parent, which comes earlier (-1: the root), and what it holds.

    Its transform to the parent is either `matrix`, 4x4 for row vectors, or scale, then rotation, a quaternion
    (w, x, y, z), then translation.
    """

    name: str
    parent: int
    matrix: Float64 | None = None
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    geoms: tuple[int, ...] = ()
    instances: Float64 | None = None  # (n, 4, 4): the geoms are drawn once for each, in this node's space
    skin: int | None = None  # the geoms follow its joints, and not this node
    morph_weights: tuple[float, ...] = ()
    camera: int | None = None
    light: int | None = None


@dataclass
class SkinData:
    """The joints of a skin, as nodes, and the matrices (j, 4, 4) from the mesh to each joint at rest."""

    name: str
    joints: tuple[int, ...]
    inverse_bind: Float64


@dataclass
class ChannelData:
    """The course of one property of a node.

    `times` (k,) in seconds ascend strictly. `values` is (k, width): of "translation" and "scale" 3, of
    "rotation" 4 as (w, x, y, z), of "morph_weights" one for each target. Of CUBICSPLINE it is
    (k, 3, width): in-tangent, value, out-tangent.
    """

    node: int
    path: Literal["translation", "rotation", "scale", "morph_weights"]
    times: Float64
    values: Float64
    interpolation: Interpolation = "LINEAR"


@dataclass
class AnimationData:
    """An animation: channels that run together."""

    name: str
    channels: list[ChannelData]


@dataclass
class ModelData:
    """A whole file, with the name of its root.

    `losses` are lines for the user: each names a property that is not drawn, and the materials, meshes or
    nodes that have it.
    """

    name: str
    nodes: list[NodeData] = field(default_factory=list)
    geoms: list[GeomData] = field(default_factory=list)
    materials: list[MaterialData] = field(default_factory=list)
    textures: list[TextureData] = field(default_factory=list)
    images: list[ImageData] = field(default_factory=list)
    cameras: list[CameraData] = field(default_factory=list)
    lights: list[LightData] = field(default_factory=list)
    skins: list[SkinData] = field(default_factory=list)
    animations: list[AnimationData] = field(default_factory=list)
    losses: list[str] = field(default_factory=list)

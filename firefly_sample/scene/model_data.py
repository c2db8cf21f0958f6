"""What a model file says, as plain data, and the tree of nodes that it becomes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.derived import fingerprint
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import AlphaMode, Material, Texture
from firefly_sample.scene.nodepath import NodePath


@dataclass
class ImageData:
    """An image: pixels that are there, or a function that gives them and, where known, their digest."""

    name: str
    size: tuple[int, int]
    decode: Callable[[], NDArray[np.uint8]]
    digest: str | None = None

    @classmethod
    def of(cls, pixels: NDArray[np.uint8], name: str) -> ImageData:
        """An image that is decoded already."""
        return cls(name, (pixels.shape[1], pixels.shape[0]), lambda: pixels)


@dataclass
class MaterialData:
    """A material as `Material` takes it; `image` counts in the model's images."""

    name: str
    base_color: ArrayLike
    image: int | None
    alpha_mode: AlphaMode
    alpha_cutoff: float
    double_sided: bool


@dataclass
class GeomData:
    """A geom by the arrays that `Geom` takes, and the number of its material."""

    name: str
    material: int
    arrays: dict[str, NDArray[Any]]


@dataclass
class NodeData:
    """A node: the number of its parent, which stands before it (-1: the root), its matrix and its geoms."""

    name: str
    parent: int
    matrix: NDArray[np.float64] | None
    geoms: tuple[int, ...]


@dataclass
class ModelData:
    """A whole file, by the name of its root."""

    name: str
    nodes: list[NodeData] = field(default_factory=list)
    geoms: list[GeomData] = field(default_factory=list)
    materials: list[MaterialData] = field(default_factory=list)
    images: list[ImageData] = field(default_factory=list)

    def as_tree(self, digests: bool = True) -> NodePath:
        """Fresh nodes, geoms, materials and textures; those that several nodes show are shared.

        Parameters
        ----------
        digests : bool
            Compute the digests of images that have none.

        Raises
        ------
        SceneError
            If a number or an array is not as it must be.
        """
        if digests:
            for image in self.images:
                if image.digest is None:
                    image.digest = fingerprint(image.decode())
        textures = [
            Texture.from_file(image.decode, image.size, image.digest, image.name) for image in self.images
        ]
        materials = [
            Material(
                made.name,
                base_color=made.base_color,
                texture=None if made.image is None else textures[made.image],
                alpha_mode=made.alpha_mode,
                alpha_cutoff=made.alpha_cutoff,
                double_sided=made.double_sided,
            )
            for made in self.materials
        ]
        geoms = [(Geom(**geom.arrays, name=geom.name), materials[geom.material]) for geom in self.geoms]
        root = NodePath(self.name)
        paths: list[NodePath] = []
        for made in self.nodes:
            node = GeomNode(made.name)
            for number in made.geoms:
                node.add_geom(*geoms[number])
            path = (root if made.parent < 0 else paths[made.parent]).attach_new_node(node)
            if made.matrix is not None:
                path.set_mat(made.matrix)
            paths.append(path)
        return root

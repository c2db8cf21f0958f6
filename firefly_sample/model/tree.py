"""From a file's data to nodes: GeomNodes, cameras and lights below a ModelRoot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import NodeError
from firefly_sample.model.animated import bind, geom_arguments, is_posed
from firefly_sample.model.data import CameraData, LightData, MaterialData, ModelData, NodeData
from firefly_sample.model.root import ModelRoot
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.light import FadingLight, Light
from firefly_sample.scene.lights import SMALLEST_CONE, DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera
from firefly_sample.scene.texture import Texture
from firefly_sample.scene.transform_state import TransformState


def make_tree(data: ModelData, digests: Sequence[str | None] | None = None) -> NodePath:
    """Return new nodes, geoms, materials and textures for a file, and the path to their root.

    Geoms that nothing moves are shared by the nodes that have them. A node with geoms, a camera and a light,
    or two of them, is the first of these, and the others are below it. The first animation plays: see
    `ModelRoot`.

    Parameters
    ----------
    data : ModelData
    digests : sequence of str or None, optional
        A hash of each image's pixels, under which their mipmaps are cached.

    Raises
    ------
    SceneError
        If a number or an array is wrong; the message names what has it.
    """
    root = ModelRoot(data.name, data.losses)
    textures = _textures(data, digests)
    materials = [_material(made, textures) for made in data.materials]
    fixed: dict[int, Geom] = {}
    nodes: list[PandaNode] = []
    holders: dict[int, list[GeomNode]] = {}
    for index, made in enumerate(data.nodes):
        node = _node(data, made)
        node.set_transform(_transform(made))
        nodes.append(node)
        if not made.geoms:
            continue
        holders[index] = _holders(node, made)
        for number in made.geoms:
            if is_posed(data, index, number):
                continue  # `bind` adds it
            if number not in fixed:
                fixed[number] = Geom(**geom_arguments(data.geoms[number]))
            for holder in holders[index]:
                holder.add_geom(fixed[number], materials[data.geoms[number].material])
    _link(root, nodes, [made.parent for made in data.nodes])
    _check_nets(data, nodes)
    bind(root, data, nodes, materials, holders)
    return NodePath(root)


def _link(root: PandaNode, nodes: Sequence[PandaNode], parents: Sequence[int]) -> None:
    """Add the nodes to their parents, the lowest first: a node tells all nodes above it of each new child."""
    children: dict[int, list[PandaNode]] = {}
    for node, parent in zip(nodes, parents, strict=True):
        children.setdefault(parent, []).append(node)
    for parent in sorted(children, reverse=True):
        for child in children[parent]:
            (root if parent < 0 else nodes[parent]).add_child(child)


def _check_nets(data: ModelData, nodes: Sequence[PandaNode]) -> None:
    """Raise NodeError if a node's transform to the root is not finite, as of many large scales in a chain."""
    nets: list[Float64] = []
    with np.errstate(over="ignore", invalid="ignore"):
        for node, made in zip(nodes, data.nodes, strict=True):
            net = node.transform.get_mat()
            nets.append(net if made.parent < 0 else net @ nets[made.parent])
    for made, net in zip(data.nodes, nets, strict=True):
        if not np.isfinite(net).all():
            raise NodeError(
                f"node {made.name!r}: its transform to the root has numbers that float64 does not hold"
            )


def _node(data: ModelData, made: NodeData) -> PandaNode:
    """Return the node itself, and what else it holds below it."""
    camera = None if made.camera is None else data.cameras[made.camera]
    light = None if made.light is None else data.lights[made.light]
    held: list[PandaNode] = []
    if made.geoms:
        held.append(GeomNode(made.name))
    if camera is not None:
        held.append(Camera(camera.name if held else made.name, _lens(camera)))
    if light is not None:
        held.append(_light(light, light.name if held else made.name))
    if not held:
        return PandaNode(made.name)
    node, *others = held
    for other in others:
        node.add_child(other)
    return node


def _holders(node: PandaNode, made: NodeData) -> list[GeomNode]:
    """Return the GeomNodes that a node's geoms are added to: itself, or one below it for each instance."""
    assert isinstance(node, GeomNode)
    if made.instances is None:
        return [node]
    below = []
    for number, matrix in enumerate(made.instances):
        instance = GeomNode(f"{made.name} {number}")
        instance.set_transform(TransformState.make_mat(matrix))
        node.add_child(instance)
        below.append(instance)
    return below


def _transform(made: NodeData) -> TransformState:
    if made.matrix is not None:
        return TransformState.make_mat(made.matrix)
    return TransformState.make_pos_quat_scale_shear(made.translation, made.rotation, made.scale)


def _textures(data: ModelData, digests: Sequence[str | None] | None) -> list[Texture]:
    """Return the textures; those of one image decode it once."""
    first: dict[int, Texture] = {}
    textures = []
    for made in data.textures:
        image = data.images[made.image]
        digest = None if digests is None else digests[made.image]
        texture = Texture.from_file(
            partial(_pixels, first[made.image]) if made.image in first else image.decode,
            image.size,
            digest,
            image.name,
            wrap_u=made.wrap_u,
            wrap_v=made.wrap_v,
            minfilter=made.minfilter,
            magfilter=made.magfilter,
        )
        first.setdefault(made.image, texture)
        textures.append(texture)
    return textures


def _pixels(texture: Texture) -> NDArray[np.uint8]:
    return texture.pixels


def _material(made: MaterialData, textures: Sequence[Texture]) -> Material:
    def texture(index: int | None) -> Texture | None:
        return None if index is None else textures[index]

    return Material(
        made.name,
        made.base_color,
        texture(made.texture),
        made.alpha_mode,
        made.alpha_cutoff,
        made.double_sided,
        emission=made.emission,
        emission_texture=texture(made.emission_texture),
        emission_texcoord=made.emission_texcoord,
        specular=made.specular,
        shininess=made.shininess,
        metallic=made.metallic,
        roughness=made.roughness,
        metallic_roughness_texture=texture(made.metallic_roughness_texture),
        metallic_roughness_texcoord=made.metallic_roughness_texcoord,
        normal_texture=texture(made.normal_texture),
        normal_texcoord=made.normal_texcoord,
        normal_scale=made.normal_scale,
        occlusion_texture=texture(made.occlusion_texture),
        occlusion_texcoord=made.occlusion_texcoord,
        occlusion_strength=made.occlusion_strength,
        unlit=made.unlit,
    )


def _lens(made: CameraData) -> Lens:
    """Return a lens that keeps the file's height of view; its width follows each picture's shape."""
    if made.film_size is not None:
        return OrthographicLens(film_height=made.film_size[1], near=made.near, far=made.far)
    return PerspectiveLens(vfov=made.fov, near=made.near, far=made.far)


def _light(made: LightData, name: str) -> Light:
    """Return a light. glTF's diffuse surfaces reflect 1/pi of the light that arrives, ours all of it."""
    color = [channel * made.intensity / math.pi for channel in made.color]
    if made.kind == "directional":
        return DirectionalLight(name, color)
    light: FadingLight
    if made.kind == "spot":
        light = Spotlight(name, color)
        light.set_cone(made.inner, max(made.outer, SMALLEST_CONE))
    else:
        light = PointLight(name, color)
    light.set_attenuation((0.0, 0.0, 1.0))
    light.set_max_distance(made.range)
    return light

"""Every attribute of pyrender's classes: our scene follows it, or a warning names what is lost.

The attributes are found in the classes, so that one which is new there, or was forgotten here, fails.
"""

from __future__ import annotations

import inspect
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyrender
import pytest

from firefly_sample.interop.pyrender.bridge import from_pyrender
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.light import Light
from firefly_sample.scene.lights import Spotlight
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.scene.texture import Texture
from tests.interop.blocks import matt, triangle

SIZE = (64, 48)
GLTF = pyrender.GLTF
Glossy = pyrender.material.SpecularGlossinessMaterial
BASES = (pyrender.light.Light, pyrender.camera.Camera, pyrender.material.Material)
IMAGE = np.arange(16, dtype=np.uint8).reshape(2, 2, 4) + 200
ONE_COLOR = np.full((2, 2, 3), 188, np.uint8)
POSE = np.array([[0, -2, 0, 1], [1, 0, 0, 2], [0, 0, 3, 3], [0, 0, 0, 1.0]])


class Objects:
    """A pyrender Scene with one object of each class, by class."""

    def __init__(self) -> None:
        self.texture = pyrender.Texture("bark", source=IMAGE, source_channels="RGBA")
        self.matt = matt(baseColorTexture=self.texture)
        self.glossy = Glossy(name="glass", diffuseTexture=self.texture, specularFactor=[0.04] * 3)
        self.leaf = triangle(material=self.matt, texcoord_0=np.zeros((3, 2)))
        pane = triangle(material=self.glossy, texcoord_0=np.zeros((3, 2)))
        self.mesh = pyrender.Mesh([self.leaf, pane], name="shape")
        self.scene = pyrender.Scene()
        self.node = self.scene.add(self.mesh, name="branch")
        things = [
            pyrender.PerspectiveCamera(1.0, zfar=50.0),
            pyrender.OrthographicCamera(4.0, 3.0),
            pyrender.IntrinsicsCamera(50.0, 50.0, 32.0, 24.0),
            pyrender.PointLight(),
            pyrender.SpotLight(innerConeAngle=0.2, outerConeAngle=0.4),
            pyrender.DirectionalLight(),
        ]
        for thing in things:
            self.scene.add(thing)
        own = [self.texture, self.texture.sampler, self.matt, self.glossy, self.leaf, self.mesh, self.node]
        self.by_class = {type(thing): thing for thing in (*own, *things, self.scene)}


@dataclass(frozen=True)
class Follows:
    """Our scene changes with the value, and nothing more is lost."""

    value: Any
    """Or a function of `Objects` and the one concerned, which changes it."""
    beside: dict[str, Any] = field(default_factory=dict)
    """Other parameters that it needs, before and after the change."""


@dataclass(frozen=True)
class Named:
    """A warning says so, of the thing of this name."""

    value: Any
    what: str
    name: str
    beside: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Nothing:
    """pyrender draws the same with this value."""

    value: Any
    beside: dict[str, Any] = field(default_factory=dict)


def with_a_twig(objects, node):
    objects.scene.add_node(pyrender.Node("twig"), parent_node=node)


def other_camera(objects, scene):
    other = objects.by_class[pyrender.OrthographicCamera]
    (scene.main_camera_node,) = scene.get_nodes(obj=other)


def glow(objects, material):
    material.emissiveFactor, material.emissiveTexture = np.ones(3), ONE_COLOR


def cut_out(objects, material):
    material.alphaMode, material.alphaCutoff = "BLEND", 0.25


def light(**more):
    return {
        "name": Follows("lamp"),
        "color": Follows((1.0, 0.5, 0.25)),
        "intensity": Follows(2.0),
        # what a renderer that was told to draw shadows puts there
        "shadow_texture": Nothing(pyrender.Texture(width=8, height=8, source_channels="D")),
    } | more


def camera(**more):
    return {"name": Follows("eye"), "znear": Follows(0.5), "zfar": Follows(70.0)} | more


def material(name, **more):
    image = np.zeros((2, 2, 3), np.uint8)
    return {
        "name": Follows("stone"),
        "normalTexture": Follows(image),
        "occlusionTexture": Named(image, "pyrender's occlusion darkens all light", name),
        "emissiveTexture": Follows(glow),
        "emissiveFactor": Follows((1.0, 0.0, 1.0)),
        "alphaMode": Follows("BLEND"),
        "alphaCutoff": Follows(cut_out),
        "doubleSided": Follows(True),
        "smooth": Nothing(False),  # nowhere read
        "wireframe": Follows(True),
    } | more


CASES: dict[type, dict[str, Any]] = {
    pyrender.Scene: {
        "name": Follows("room"),
        "nodes": Follows(lambda objects, scene: scene.add_node(pyrender.Node("stone"))),
        "bg_color": Follows((0.25, 0.5, 0.75, 1.0)),
        "ambient_light": Follows((0.25, 0.5, 0.75)),
        "main_camera_node": Follows(other_camera),
    },
    pyrender.Node: {
        "name": Follows("bough"),
        "camera": Follows(pyrender.OrthographicCamera(1.0, 1.0)),
        "mesh": Follows(None),
        "light": Follows(pyrender.DirectionalLight()),
        "children": Follows(with_a_twig),
        "matrix": Follows(POSE),
        "rotation": Follows((1.0, 0.0, 0.0, 0.0)),
        "scale": Follows((1.0, 2.0, 3.0)),
        "translation": Follows((1.0, 2.0, 3.0)),
        "skin": Named(3, "skins and morph weights are left out", "branch"),
        "weights": Named([1.0], "skins and morph weights are left out", "branch"),
    },
    pyrender.Mesh: {
        "name": Follows("form"),
        "primitives": Follows([]),
        "is_visible": Follows(False),
        "weights": Named([1.0], "skins and morph weights are left out", "shape"),
    },
    pyrender.Primitive: {
        "positions": Follows([(0, 0, 0), (2, 0, 0), (0, 1, 0)]),
        "normals": Follows([(0, 1, 0)] * 3),
        "texcoord_0": Follows([(0, 1)] * 3),
        "color_0": Follows([(0.5, 0.25, 1)] * 3),
        "indices": Follows([(0, 2, 1)]),
        "material": Follows(matt(name="moss")),
        "mode": Follows(GLTF.LINES),
        "poses": Follows(np.stack([np.eye(4), POSE])),
        "tangents": Follows([(1, 0, 0, -1)] * 3),
        "texcoord_1": Follows(np.zeros((3, 2))),
        "joints_0": Named(np.zeros((3, 4)), "joints_0 of meshes are left out", "shape[0]"),
        "weights_0": Named(np.zeros((3, 4)), "weights_0 of meshes are left out", "shape[0]"),
        "targets": Named([0], "targets of meshes are left out", "shape[0]"),
    },
    pyrender.MetallicRoughnessMaterial: material(
        "clay",
        baseColorFactor=Follows((0.5, 0.25, 1.0, 1.0)),
        baseColorTexture=Follows(IMAGE // 2),
        metallicFactor=Follows(0.5),
        roughnessFactor=Follows(0.5),
        metallicRoughnessTexture=Follows(IMAGE),
    ),
    Glossy: material(
        "glass",
        diffuseFactor=Follows((0.5, 0.25, 1.0, 1.0)),
        diffuseTexture=Follows(IMAGE // 2),
        specularFactor=Follows((1.0, 1.0, 1.0)),
        glossinessFactor=Follows(0.5),
        specularGlossinessTexture=Named(IMAGE, "specularGlossinessTexture is left out, of whose", "glass"),
    ),
    pyrender.PointLight: light(range=Named(3.0, "light ends at its range here", "light 1")),
    pyrender.SpotLight: light(
        range=Named(3.0, "light ends at its range here", "light 2"),
        innerConeAngle=Follows(0.1),
        outerConeAngle=Follows(0.5),
    ),
    pyrender.DirectionalLight: light(),
    pyrender.PerspectiveCamera: camera(yfov=Follows(0.5), aspectRatio=Follows(2.0)),
    pyrender.OrthographicCamera: camera(xmag=Follows(3.0), ymag=Follows(2.0)),
    pyrender.IntrinsicsCamera: camera(fx=Follows(60.0), fy=Follows(60.0), cx=Follows(30.0), cy=Follows(30.0)),
    pyrender.Texture: {
        "name": Follows("picture"),
        "source": Follows(IMAGE // 2),
        "sampler": Follows(pyrender.Sampler(wrapS=GLTF.CLAMP_TO_EDGE)),
        "source_channels": Nothing("RGBA"),  # what the image was cut to when it was set
        "width": Nothing(7),  # of textures without an image
        "height": Nothing(7),
        "tex_type": Named(0x8513, "textures without a plain image of bytes are left out", "bark"),
        "data_format": Named(0x1406, "textures without a plain image of bytes are left out", "bark"),
    },
    pyrender.Sampler: {
        "name": Nothing("smooth"),  # nowhere read
        "magFilter": Follows(GLTF.NEAREST),
        "minFilter": Follows(GLTF.NEAREST),
        "wrapS": Follows(GLTF.MIRRORED_REPEAT),
        "wrapT": Follows(GLTF.MIRRORED_REPEAT),
    },
}


def settable(kind: type) -> set[str]:
    """Return the names of a class's settable attributes and constructor parameters."""
    found = inspect.getmembers(kind, lambda member: isinstance(member, property))
    given = set(inspect.signature(kind).parameters)
    return given | {name for name, member in found if member.fset is not None}


def test_every_class_is_here():
    kinds = {
        pyrender.Scene,
        pyrender.Node,
        pyrender.Mesh,
        pyrender.Primitive,
        pyrender.Texture,
        pyrender.Sampler,
    }
    for base in BASES:
        kinds |= {kind for kind in base.__subclasses__() if kind.__module__.startswith("pyrender")}
    assert CASES.keys() == Objects().by_class.keys() == kinds


@pytest.mark.parametrize("kind", CASES)
def test_every_attribute_is_here(kind):
    assert CASES[kind].keys() == settable(kind)


def read(objects: Objects) -> tuple[Scene, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = from_pyrender(objects.scene, size=SIZE)
    return scene, [str(warning.message) for warning in caught]


def kinds_of_loss(said: list[str]) -> set[str]:
    return {line.rpartition(": '")[0] for line in said}


def listed(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def described(scene: Scene) -> list[Any]:
    """All that we know of a scene, as plain values."""
    said: list[Any] = [scene.background, str(scene.camera)]
    for path in scene.root.find_all_matches("**"):
        said.append((str(path), listed(path.get_mat()), path.is_hidden(), *contents(path)))
    return said


def contents(path: NodePath) -> list[Any]:
    node = path.node()
    said: list[Any] = [type(node).__name__]
    if isinstance(node, GeomNode):
        for geom, material in node.geoms:
            said += [
                listed(getattr(geom, name)) for name in ("name", "mode", "vertices", "indices", "normals")
            ]
            said += [listed(geom.texcoords), listed(geom.texcoords_1), listed(geom.colors)]
            said.append(listed(geom.tangents))
            look = vars(material).items()
            said.append({name: listed(value) for name, value in look if not isinstance(value, Texture)})
            for texture in vars(material).values():
                if isinstance(texture, Texture):
                    said.append((texture.name, listed(texture.pixels), texture.sampling))
    elif isinstance(node, Camera):
        said += [node.lens.constants(), node.lens.get_near(), node.lens.get_far()]
    elif isinstance(node, Light):
        said.append(listed(node.get_color()))
        said.append(node.get_cone() if isinstance(node, Spotlight) else None)
    return said


EVERY = [(kind, name) for kind, cases in CASES.items() for name in cases]


@pytest.mark.parametrize(("kind", "name"), EVERY, ids=[f"{kind.__name__}.{name}" for kind, name in EVERY])
def test_it_is_followed_or_named(kind, name):
    case = CASES[kind][name]
    before, expected = read(Objects())
    objects = Objects()
    changed = objects.by_class[kind]
    if callable(case.value):
        case.value(objects, changed)
    else:
        setattr(changed, name, case.value)
    after, said = read(objects)
    if isinstance(case, Named):
        (line,) = [line for line in said if line.startswith(case.what)]
        assert repr(case.name) in line
    else:
        assert kinds_of_loss(said) <= kinds_of_loss(expected)
        assert (described(after) != described(before)) == isinstance(case, Follows)

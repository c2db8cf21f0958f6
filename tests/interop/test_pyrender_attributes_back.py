"""Every attribute of our scenes, materials, geometry and lights: pyrender's follow it, or a warning names it.

As in `test_pyrender_attributes`, the attributes are found in the classes.
"""

from __future__ import annotations

import inspect
import warnings
from typing import Any

import numpy as np
import pyrender
import pytest

from firefly_sample.interop.pyrender.bridge import to_pyrender
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.scene.texture import Texture
from tests.interop.blocks import fading
from tests.interop.test_pyrender_attributes import Follows, Named, Nothing, listed
from tests.scenes import geom_node

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
PIXELS = np.full((2, 2, 4), (10, 20, 30, 255), np.uint8)
WHITE = np.full((2, 2, 4), 255, np.uint8)


def eyed() -> NodePath:
    root = NodePath("room")
    root.attach_new_node(Camera("eye"))
    return root


CASES: dict[type, dict[str, Any]] = {
    Scene: {
        "root": Follows(NodePath("room")),
        "camera": Follows(eyed().get_child(0)),
        "background": Follows((0.25, 0.5, 1.0)),
        "focus": Nothing((1.0, 2.0, 3.0)),  # what a window's mouse turns the camera about
        "exposure": Named(2.0, "exposure, which pyrender lacks, is left out", "root"),
    },
    Geom: {
        "vertices": Follows([(0, 0, 0), (2, 0, 0), (0, 1, 0)]),
        "triangles": Follows([(0, 2, 1)]),
        "normals": Follows([(1, 0, 0)] * 3),
        "texcoords": Follows([(0, 1)] * 3),
        "colors": Follows([(0.5, 0.25, 1)] * 3),
        "name": Follows("stone"),
        "texcoords_1": Follows([(0, 1)] * 3),
        "tangents": Follows([(1, 0, 0, -1)] * 3),
    },
    Texture: {
        "pixels": Follows(PIXELS // 2),
        "name": Follows("moss"),
        "wrap_u": Follows("clamp"),
        "wrap_v": Follows("mirror"),
        "minfilter": Follows("nearest"),
        "magfilter": Follows("nearest"),
    },
    Material: {
        "name": Follows("stone"),
        "base_color": Follows((0.5, 0.25, 1, 1)),
        "texture": Follows(Texture(PIXELS // 2)),
        "alpha_mode": Follows("blend"),
        "alpha_cutoff": Follows(0.25),
        "double_sided": Follows(True),
        "emission": Follows((1, 0, 1)),
        "ambient": Named(
            (1, 0, 0), "ambient colours of materials, which pyrender lacks, are left out", "clay"
        ),
        "specular": Named((1, 0, 0), "highlights (specular, shininess) are left out", "clay"),
        "shininess": Nothing(9.0),  # of highlights that it has not
        "emission_texture": Follows(Texture(PIXELS // 2)),
        "emission_texcoord": Nothing(1),  # of an emission texture that it has not
        "metallic": Follows(0.5),
        "roughness": Follows(0.5, {"metallic": 0.0}),
        "metallic_roughness_texture": Follows(Texture(PIXELS), {"metallic": 0.0}),
        "normal_texture": Follows(Texture(PIXELS)),
        "normal_scale": Named(
            0.5,
            "scales of normal maps, which pyrender lacks, become 1",
            "clay",
            {"normal_texture": Texture(PIXELS)},
        ),
        "occlusion_texture": Named(Texture(PIXELS), "pyrender's occlusion darkens all light", "clay"),
        "occlusion_strength": Nothing(0.5, {"occlusion_texture": Texture(WHITE)}),
        "metallic_roughness_texcoord": Nothing(1),  # of textures that it has not
        "normal_texcoord": Nothing(1),
        "occlusion_texcoord": Nothing(1),
        "modulate_texture": Named(Texture(PIXELS), "pyrender has no second texture", "clay"),
        "modulate_texcoord": Nothing(1),
        "local_viewer": Nothing(True),  # of highlights, which are left out
        "unlit": Named(True, "pyrender has no unlit materials and lights them", "clay"),
    },
}
LIGHT: dict[str, Any] = {
    "color": Follows(((0.5, 0.25, 1),)),
    "specular_color": Named(
        ((1, 0, 0),), "specular colours of lights, which pyrender lacks, are left out", "lamp"
    ),
    "shadow_caster": Named((True,), "pyrender turns shadows on by RenderFlags and not by light", "lamp"),
}
FADING: dict[str, Any] = LIGHT | {
    "attenuation": Follows(((0, 0, 4),)),
    "radius": Named((5.0,), "light that fades over a radius R fades by 1/d^2 in pyrender", "lamp"),
    "max_distance": Named(
        (5.0,), "pyrender keeps how far lights reach as their range, but draws them beyond", "lamp"
    ),
}
SETTERS: dict[type, dict[str, Any]] = {
    PointLight: FADING,
    AmbientLight: {"color": Follows(((0.5, 0.25, 1),))},
    DirectionalLight: LIGHT
    | {
        "direction": Follows(((1, 0, 0),)),
        "shadow_distance": Nothing((9.0,)),  # of shadows that it does not cast
    },
    Spotlight: FADING
    | {
        "cone": Follows((30.0, 30.0)),
        "lens": Named((PerspectiveLens(fov=40.0),), "pyrender's spotlights have no exponent", "lamp"),
        "exponent": Nothing((3.0,)),  # of a lens's cone
    },
}


def plain_spotlight() -> Spotlight:
    spot = fading(Spotlight("lamp"))
    spot.set_cone(20.0, 20.0)
    return spot


LIGHTS = {
    PointLight: lambda: fading(PointLight("lamp")),
    Spotlight: plain_spotlight,
    DirectionalLight: lambda: DirectionalLight("lamp"),
    AmbientLight: lambda: AmbientLight("lamp", (1.0, 1.0, 1.0)),
}


def scene_with(kind: type, **given: Any) -> Scene:
    """A card of one texture; the object of class `kind` is made with what is given."""
    arguments: dict[type, dict[str, Any]] = {
        Texture: {"pixels": PIXELS, "name": "bark"},
        Geom: {"vertices": CORNERS, "triangles": [(0, 1, 2)], "name": "leaf"},
        Material: {"name": "clay", "texture": Texture(PIXELS, "bark")},
        Scene: {},
    }
    arguments[kind] = arguments[kind] | given
    if kind is Texture:
        arguments[Material]["texture"] = Texture(**arguments[Texture])
    scene = Scene(**arguments[Scene])
    scene.root.attach_new_node(geom_node("card", Geom(**arguments[Geom]), Material(**arguments[Material])))
    return scene


def written(scene: Scene) -> tuple[list[Any], list[str]]:
    """Return the contents of the pyrender scene as plain values, and the losses."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made = to_pyrender(scene)
    said: list[Any] = [listed(made.bg_color), listed(made.ambient_light), made.main_camera_node.name]
    for node in made._digraph:
        if node in made.nodes:
            said.append((node.name, listed(node.matrix), values(node.light)))
            said += [] if node.mesh is None else [node.mesh.name]
            for primitive in () if node.mesh is None else node.mesh.primitives:
                said += [values(primitive), values(primitive.material)]
                for name, texture in vars(primitive.material).items():
                    if isinstance(texture, pyrender.Texture):
                        said += [name, values(texture), values(texture.sampler)]
    return said, [str(warning.message) for warning in caught]


def values(thing: Any) -> Any:
    """The plain attributes of a pyrender object."""
    kept = (bool, int, float, str, np.ndarray)
    return None if thing is None else {k: listed(v) for k, v in vars(thing).items() if isinstance(v, kept)}


@pytest.mark.parametrize("kind", CASES)
def test_every_parameter_is_here(kind):
    elsewhere = {"mode"} if kind is Geom else set()  # test_pyrender_meshes.py
    assert CASES[kind].keys() == inspect.signature(kind).parameters.keys() - elsewhere


@pytest.mark.parametrize("kind", SETTERS)
def test_every_setter_of_lights_is_here(kind):
    own = {name for name in dir(kind) if name.startswith("set_") and not hasattr(PandaNode, name)}
    assert {f"set_{name}" for name in SETTERS[kind]} == own


def check(case: Any, before: Scene, after: Scene) -> None:
    (expected, nothing), (found, said) = written(before), written(after)
    assert nothing == []
    if isinstance(case, Named):
        (line,) = said
        assert line.startswith(case.what)
        assert line.endswith(f": {case.name!r}")
    else:
        assert said == []
        assert (found != expected) == isinstance(case, Follows)


@pytest.mark.parametrize(
    ("kind", "name"),
    [pytest.param(kind, name, id=f"{kind.__name__}.{name}") for kind in CASES for name in CASES[kind]],
)
def test_it_is_followed_or_named(kind, name):
    case = CASES[kind][name]
    check(case, scene_with(kind, **case.beside), scene_with(kind, **case.beside, **{name: case.value}))


@pytest.mark.parametrize(
    ("kind", "name"),
    [pytest.param(kind, name, id=f"{kind.__name__}.{name}") for kind in SETTERS for name in SETTERS[kind]],
)
def test_a_light_is_followed_or_named(kind, name):
    case = SETTERS[kind][name]
    scenes = []
    for changed in (False, True):
        light = LIGHTS[kind]()
        if changed:
            getattr(light, f"set_{name}")(*case.value)
        scene = Scene()
        scene.root.attach_new_node(light)
        scenes.append(scene)
    check(case, *scenes)

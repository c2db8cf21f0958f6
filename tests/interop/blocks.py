"""Building blocks of these tests: small scenes, there and back, and numbers for Hypothesis."""

from __future__ import annotations

import math

import numpy as np
import pyrender
from hypothesis import strategies as st

from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.scene import Scene
from tests.scenes import ball, geom_node

U = 2.0**-53
SINGLE = 2.0**-24

NUMBER = st.floats(-1e3, 1e3)
SCALE = st.one_of(st.floats(0.1, 10.0), st.floats(-10.0, -0.1))
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER)
ANGLES = st.tuples(*[st.floats(-360, 360)] * 3)
SCALES = st.tuples(SCALE, SCALE, SCALE)


def log_floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


def there_and_back(scene: Scene, size: tuple[int, int] | None = None) -> Scene:
    return from_pyrender(to_pyrender(scene, size=size), size=size)


def single(values: Float64) -> Float64:
    return np.asarray(values).astype(np.float32).astype(np.float64)


def scene_with(node: PandaNode) -> Scene:
    scene = Scene()
    scene.root.attach_new_node(node)
    return scene


def only(nodes):
    (node,) = nodes
    return node


def fading(light, attenuation=(0, 0, 1), end=math.inf):
    light.set_attenuation(attenuation)
    light.set_max_distance(end)
    return light


def ball_of(**material):
    return geom_node("ball", ball(1.0, 1), Material("clay", **material))


def triangle(**attributes):
    given = {"normals": [(0, 0, 1)] * 3, "material": matt()} | attributes
    return pyrender.Primitive([(0, 0, 0), (1, 0, 0), (0, 1, 0)], **given)


def matt(**changes):
    return pyrender.MetallicRoughnessMaterial(**{"metallicFactor": 0.0, "name": "clay"} | changes)

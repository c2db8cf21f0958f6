"""The looks "flat" and "pyrender" against pyrender's own pictures of boards: textures, vertex colours, panes.

With RenderFlags.FLAT pyrender shows base colours. Under white ambient light alone it shows them encoded, as
our unlit materials do: neither picture has any shading.
"""

from __future__ import annotations

import numpy as np
import pyrender
import pytest
import trimesh
from pyrender.constants import GLTF

from firefly_sample.interop.pyrender.bridge import from_pyrender
from firefly_sample.scene.geom import GeomNode
from firefly_sample.settings import Settings
from tests.interop.oracle import FLAT, LIT, SIZE, edges

FLAGS = {"flat": FLAT, "pyrender": LIT}
BACKGROUND = (51 / 255, 128 / 255, 179 / 255)
each_look = pytest.mark.parametrize("look", FLAGS)


def board(pixels=None, factor=(1.0, 1.0, 1.0, 1.0), tiles=1.0, colors=None, sampler=None):
    """A square of two units, blended over others if its alpha is not 1."""
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=np.float32)
    texture = None
    if pixels is not None:
        texture = pyrender.Texture(source=pixels, source_channels="RGBA", sampler=sampler)
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=np.array(factor),
        baseColorTexture=texture,
        metallicFactor=0.0,
        doubleSided=True,
        alphaMode="BLEND" if factor[3] < 1.0 else "OPAQUE",
    )
    primitive = pyrender.Primitive(
        corners,
        normals=np.tile((0.0, 0.0, 1.0), (4, 1)),
        texcoord_0=tiles * (corners[:, :2] + 1.0) / 2.0,
        color_0=colors,
        indices=np.array([(0, 1, 2), (0, 2, 3)]),
        material=material,
    )
    return pyrender.Mesh([primitive])


def pose(place, turn=(0.0, 0.0, 0.0)):
    matrix = trimesh.transformations.euler_matrix(*np.radians(turn))
    matrix[:3, 3] = place
    return matrix


def scene_of(*boards):
    scene = pyrender.Scene(bg_color=(*BACKGROUND, 1.0), ambient_light=(1.0, 1.0, 1.0))
    for mesh, matrix in boards:
        scene.add(mesh, pose=matrix)
    scene.add(pyrender.PerspectiveCamera(0.8, 0.1, 50.0), pose=pose((0, 0, 4)))
    return scene


def ours(renderer, scene, look):
    """Our picture: with unlit materials, and the background that this look shows as pyrender's."""
    converted = from_pyrender(scene, size=SIZE)
    for path in converted.root.find_all_matches("**"):
        for _, material in path.node().geoms if isinstance(path.node(), GeomNode) else ():
            material.unlit = True
    converted.background = BACKGROUND if look == "flat" else tuple(np.array(BACKGROUND) ** 2.2)
    renderer.settings = Settings(look=look)
    return renderer.render(converted).color


def apart(renderer, draw_with_pyrender, scene, look):
    """Codes between the two pictures in the pixels that are not on an edge."""
    theirs, depth = draw_with_pyrender(scene, SIZE, FLAGS[look])
    off = np.abs(ours(renderer, scene, look).astype(int) - theirs).max(axis=-1)
    inverse = np.divide(1.0, depth, out=np.zeros(depth.shape), where=depth > 0)
    away = ~edges(inverse)
    assert (away & (depth > 0)).mean() > 0.05
    assert len(np.unique(theirs[depth > 0], axis=0)) > 5
    return off[away]


def noise(width, height):
    """Texels of random colours and alphas."""
    return np.random.default_rng(1).integers(0, 256, (height, width, 4), dtype=np.uint8)


NEAREST = {"magFilter": GLTF.NEAREST, "minFilter": GLTF.NEAREST_MIPMAP_NEAREST}
CLAMPED = {"wrapS": GLTF.CLAMP_TO_EDGE, "wrapT": GLTF.MIRRORED_REPEAT, "minFilter": GLTF.LINEAR}


@pytest.mark.parametrize("sampler", [{}, NEAREST, CLAMPED], ids=["linear", "nearest", "clamped"])
@pytest.mark.parametrize("size", [(64, 64), (52, 31)], ids=["even", "odd"])
@each_look
def test_textures_have_pyrenders_codes(renderer, draw_with_pyrender, look, size, sampler):
    """Magnified and minified, also where a level has an odd number of texels: the driver halves for both."""
    made = pyrender.Sampler(**sampler)
    boards = [
        (board(noise(*size), (0.9, 1.0, 0.8, 1.0), tiles, sampler=made), pose((x, y, 1), turn))
        for tiles, x, y, turn in (
            (0.2, -0.9, 0.2, (-35, 15, 5)),
            (1.0, 1.3, 0.4, (0, -40, 3)),
            (5.0, 0.2, -1.5, (-70, 0, 0)),
        )
    ]
    off = apart(renderer, draw_with_pyrender, scene_of(*boards), look)
    assert (off <= 1).mean() >= 0.999  # between two texels
    assert (off == 0).mean() >= 0.99


@each_look
def test_vertex_colours_have_pyrenders_codes(renderer, draw_with_pyrender, look):
    corners = np.array([(1, 0, 0, 1), (0, 1, 0, 0.5), (0, 0, 1, 0.2), (1, 1, 1, 0.7)], dtype=np.float32)
    scene = scene_of((board(factor=(0.8, 0.9, 0.5, 1.0), colors=corners), pose((0, 0, 1), (20, 30, 0))))
    assert apart(renderer, draw_with_pyrender, scene, look).max() <= 1


@pytest.mark.parametrize("textured", [False, True])
@each_look
def test_panes_are_mixed_as_pyrender_mixes_them(renderer, draw_with_pyrender, look, textured):
    """It rounds to a code after each of three panes, which is worth a code and a half at most."""
    pixels = noise(64, 64) if textured else None
    scene = scene_of(
        (board(factor=(0.9, 0.2, 0.1, 1.0)), pose((0, 0, -1))),
        (board(pixels, (0.1, 0.8, 0.3, 0.4)), pose((0.3, 0, 0), (0, 20, 0))),
        (board(pixels, (0.2, 0.3, 1.0, 0.6)), pose((-0.3, 0.2, 1))),
        (board(factor=(1.0, 1.0, 0.4, 0.3)), pose((0, -0.3, 1.7), (10, 0, 20))),
    )
    off = apart(renderer, draw_with_pyrender, scene, look)
    assert off.max() <= 2
    assert (off <= 1).mean() >= 0.95

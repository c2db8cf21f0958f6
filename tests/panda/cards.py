"""A wall of cards, one for each state, drawn by Panda3D in one picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from panda3d import core

PIXELS = 8
"""Width and height of a card."""
COLUMNS = 16
AMBIENT, SUN = np.array((0.1, 0.2, 0.3)), np.array((0.5, 0.4, 0.3))
VERTEX_COLOR = (0.9, 0.6, 0.3, 0.7)

Setup = Callable[[core.NodePath], object]


def quad(name: str, colored: bool) -> core.NodePath:
    """A unit square in the plane y = 0 with a normal towards -Y; its vertex colours are all the same."""
    form = core.GeomVertexFormat.get_v3n3c4t2() if colored else core.GeomVertexFormat.get_v3n3t2()
    data = core.GeomVertexData(name, form, core.Geom.UH_static)
    data.set_num_rows(4)
    writers = {each: core.GeomVertexWriter(data, each) for each in ("vertex", "normal", "texcoord")}
    color = core.GeomVertexWriter(data, "color") if colored else None
    for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
        writers["vertex"].add_data3(u, 0, v)
        writers["normal"].add_data3(0, -1, 0)
        writers["texcoord"].add_data2(u, v)
        if color is not None:
            color.add_data4(*VERTEX_COLOR)
    triangles = core.GeomTriangles(core.Geom.UH_static)
    triangles.add_vertices(0, 1, 2)
    triangles.add_vertices(0, 2, 3)
    geom = core.Geom(data)
    geom.add_primitive(triangles)
    node = core.GeomNode(name)
    node.add_geom(geom)
    return core.NodePath(node)


def wall(setups: Mapping[str, Setup], lit: bool, colored: bool):
    """A card for each setup, row by row from the lower left; lit by a sun from the front and by the sky."""
    root = core.NodePath("render")
    for index, (name, setup) in enumerate(setups.items()):
        card = quad(name, colored)
        card.reparent_to(root)
        card.set_pos(index % COLUMNS, 0, index // COLUMNS)
        setup(card)
    if lit:
        for kind, color in ((core.AmbientLight, AMBIENT), (core.DirectionalLight, SUN)):
            light = kind(kind.__name__)
            light.set_color((*color, 1))
            root.set_light(root.attach_new_node(light))
    width, height = size_of(setups)
    camera = core.Camera("camera")
    lens = core.OrthographicLens()
    lens.set_film_size(width / PIXELS, height / PIXELS)
    camera.set_lens(lens)
    path = root.attach_new_node(camera)
    path.set_pos(width / PIXELS / 2, -10, height / PIXELS / 2)
    return root, path


def size_of(setups: Mapping[str, Setup]) -> tuple[int, int]:
    """Width and height of the picture of a wall."""
    return COLUMNS * PIXELS, -(-len(setups) // COLUMNS) * PIXELS


def cut_out(picture: np.ndarray, index: int) -> np.ndarray:
    """A card's part of the picture, whose first row is on top."""
    row, column = divmod(index, COLUMNS)
    bottom = len(picture) - row * PIXELS
    return picture[bottom - PIXELS : bottom, column * PIXELS : (column + 1) * PIXELS]

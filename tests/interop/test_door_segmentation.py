"""`RenderFlags.SEG`: each pixel has the colour of the node which a ray through its centre meets first."""

from __future__ import annotations

import numpy as np
import pyrender
import pytest
import trimesh
from pyrender import RenderFlags

import firefly_sample.interop.pyrender as door
from firefly_sample.errors import SceneError
from tests.interop.door_parts import add_shapes, look, scene
from tests.interop.door_random import SHAPES, add_camera, pose

SIZE = 96, 72
NEARBY = 5e-3 * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
"""Pixels beside a centre: there is an edge where rays through these meet others. OpenGL places corners of
triangles in steps of 1/256 of a pixel."""


@pytest.fixture(scope="module")
def renderer():
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


def segments_of(seed):
    """Nine things, some below others, some of several instances, wireframes and panes, and what is where.

    Returns the scene and, for each node with a mesh, its parts in world space.
    """
    rng = np.random.default_rng(seed)
    made = pyrender.Scene()
    add_camera(made, rng, seed)
    nodes, parts = [], {}
    for index in range(9):
        shape = SHAPES[rng.integers(len(SHAPES))]
        poses = np.array([pose(rng, 0.4) for _ in range(3)]) if index % 3 == 0 else None
        alpha = "BLEND" if index % 4 == 1 else "OPAQUE"
        mesh = pyrender.Mesh.from_trimesh(
            shape,
            look((0.5, 0.5, 0.5, 0.3), alphaMode=alpha),
            poses=poses,
            smooth=index % 2 == 0,
            wireframe=index == 5,
        )
        parent = nodes[rng.integers(len(nodes))] if nodes and index % 2 else None
        node = made.add(mesh, name=f"thing {index}", pose=pose(rng, 1.3), parent_node=parent)
        nodes.append(node)
        places = [np.eye(4)] if poses is None else poses
        parts[node] = [shape.copy().apply_transform(made.get_pose(node) @ place) for place in places]
    return made, parts


def rays(made):
    """Origins and directions in world space, of five rays near each pixel's centre: shape (5, h * w, 3)."""
    width, height = SIZE
    node = made.main_camera_node
    back = np.linalg.inv(node.camera.get_projection_matrix(width, height))
    rows, columns = np.mgrid[:height, :width] + 0.5
    centres = np.column_stack([columns.ravel(), rows.ravel()])
    x, y = np.moveaxis(centres + NEARBY[:, None], -1, 0) / np.reshape((width, height), (2, 1, 1))
    ends = []
    for z in (-1.0, 0.0):
        clip = np.stack([2.0 * x - 1.0, 1.0 - 2.0 * y, np.full_like(x, z), np.ones_like(x)], axis=-1)
        place = clip @ back.T
        ends.append((place / place[..., 3:]) @ made.get_pose(node).T)
    return ends[0][..., :3], (ends[1] - ends[0])[..., :3]


def first_met(made, parts):
    """The index of the node that each ray meets first, -1 for none, shape (5, h, w), and its depth there.

    The depth is NaN where rays of a pixel meet several triangles.
    """
    width, height = SIZE
    origins, directions = rays(made)
    whole = trimesh.util.concatenate([part for each in parts for part in each])
    owners = np.concatenate(
        [np.full(len(part.faces), index) for index, each in enumerate(parts) for part in each]
    )
    faces = whole.ray.intersects_first(origins.reshape(-1, 3), directions.reshape(-1, 3)).reshape(5, -1)
    ids = np.where(faces < 0, -1, owners[faces])
    corner, normal = whole.triangles[faces[0]][:, 0], whole.face_normals[faces[0]]
    along = np.einsum("ij,ij->i", corner - origins[0], normal) / np.einsum("ij,ij->i", directions[0], normal)
    eye = made.get_pose(made.main_camera_node)
    depth = (origins[0] + along[:, None] * directions[0] - eye[:3, 3]) @ -eye[:3, 2]
    depth[(faces != faces[0]).any(axis=0)] = np.nan
    return ids.reshape(5, height, width), depth.reshape(height, width)


@pytest.mark.parametrize("seed", range(20))
def test_each_pixel_has_the_node_that_its_ray_meets(renderer, draw_with_pyrender, seed):
    """A third of the nodes is not in the map: these hide nothing."""
    made, parts = segments_of(seed)
    shown = [node for index, node in enumerate(parts) if index % 3 != seed % 3]
    colors = {node: 30 * index + 15 if index % 2 else (index, 255, 9) for index, node in enumerate(shown)}
    met, expected = first_met(made, [parts[node] for node in shown])
    seen, depth = renderer.render(made, RenderFlags.SEG, colors)
    table = np.array([*(np.broadcast_to(colors[node], 3) for node in shown), (0, 0, 0)])
    clear = (met == met[0]).all(axis=0)
    assert clear.mean() > 0.998
    assert (met[0] >= 0).mean() > 0.05
    assert len(np.unique(met[0])) >= 5
    assert (seen == table[met[0]]).all(axis=-1)[clear].all()
    assert ((depth > 0) == (met[0] >= 0))[clear].all()
    within = clear & (met[0] >= 0) & np.isfinite(expected)
    assert within.sum() > 0.9 * (met[0] >= 0).sum()
    np.testing.assert_allclose(depth[within], expected[within], rtol=1e-5)
    names = {node.name: color for node, color in colors.items()}
    theirs = draw_with_pyrender(made, SIZE, RenderFlags.SEG, segments=names)[0]
    assert (seen == theirs).all(axis=-1)[clear].all()


def test_colors_are_numbers_or_three_of_them(renderer):
    made = add_shapes(scene())
    by_name = {node.name: node for node in made.mesh_nodes}
    given = {"ball": np.uint8(200), "box": [1, 2, 3], "ring": np.array([255, 0, 254])}
    seen, _ = renderer.render(made, RenderFlags.SEG, {by_name[name]: color for name, color in given.items()})
    assert {tuple(color) for color in seen.reshape(-1, 3)} == {
        (0, 0, 0),
        (200, 200, 200),
        (1, 2, 3),
        (255, 0, 254),
    }


def test_what_is_invisible_has_no_segment(renderer):
    made = add_shapes(scene())
    colors = {node: index + 1 for index, node in enumerate(made.mesh_nodes)}
    gone = next(iter(colors))
    before = renderer.render(made, RenderFlags.SEG, colors)[0]
    gone.mesh.is_visible = False
    after = renderer.render(made, RenderFlags.SEG, colors)[0]
    assert (after == np.where(before == colors[gone], 0, before)).all()


@pytest.mark.parametrize("color", [-1, (1, 2), "red", None, np.nan, [1, 2, "x"]])
def test_what_is_no_color_is_refused_by_name(renderer, color):
    made = add_shapes(scene())
    ball = next(node for node in made.mesh_nodes if node.name == "ball")
    with pytest.raises(SceneError, match=r"seg_node_map must have a number .* for the node 'ball'"):
        renderer.render(made, RenderFlags.SEG, {ball: color})

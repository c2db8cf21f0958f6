"""Small models with skins, morph targets and animations as data, and their poses by plain loops."""

from __future__ import annotations

import math

import numpy as np

from firefly_sample.model.animated import bind, geom_arguments, is_posed
from firefly_sample.model.data import (
    AnimationData,
    ChannelData,
    GeomData,
    MaterialData,
    ModelData,
    NodeData,
    SkinData,
)
from firefly_sample.model.root import ModelRoot
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.transform_state import TransformState


def make_model(data):
    """The nodes of a model, as simply as can be."""
    root = ModelRoot(data.name)
    materials = [Material(made.name, made.base_color) for made in data.materials]
    nodes = []
    for index, made in enumerate(data.nodes):
        node = GeomNode(made.name)
        if made.matrix is not None:
            node.set_transform(TransformState.make_mat(made.matrix))
        else:
            parts = made.translation, made.rotation, made.scale
            node.set_transform(TransformState.make_pos_quat_scale_shear(*parts))
        for number in made.geoms:
            if not is_posed(data, index, number):
                geom = data.geoms[number]
                node.add_geom(Geom(**geom_arguments(geom)), materials[geom.material])
        (root if made.parent < 0 else nodes[made.parent]).add_child(node)
        nodes.append(node)
    bind(root, data, nodes, materials, {index: [node] for index, node in enumerate(nodes)})
    return NodePath(root)


def tube(rings=9, sides=8, radius=0.4, height=3.0):
    """An upright tube around the z axis: vertices, triangles, unit normals."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    heights = np.linspace(0.0, height, rings)
    vertices = np.concatenate([radius * circle + (0.0, 0.0, z) for z in heights])
    triangles = []
    for ring in range(rings - 1):
        for side in range(sides):
            a, b = ring * sides + side, ring * sides + (side + 1) % sides
            triangles += [(a, b, b + sides), (a, b + sides, a + sides)]
    return vertices, np.array(triangles, dtype=np.int32), np.tile(circle, (rings, 1))


def unwelded(vertices, triangles):
    """Vertices of which each belongs to one triangle, and flat normals."""
    corners = vertices[triangles].reshape(-1, 3)
    faces = np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3])
    normals = np.repeat(faces / np.linalg.norm(faces, axis=1, keepdims=True), 3, axis=0)
    return corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3), normals


def bending_tube(flat=False, mirrored=False):
    """A tube that a chain of three joints bends, below a turned, scaled node; two animations.

    The mesh's own node is moved away, which must not count.
    """
    vertices, triangles, normals = tube()
    if flat:
        vertices, triangles, normals = unwelded(vertices, triangles)
    weights = np.stack([np.exp(-2.0 * (vertices[:, 2] - z) ** 2) for z in (0.2, 1.5, 2.8)], axis=1)
    weights /= weights.sum(axis=1, keepdims=True)
    joints = np.tile(np.arange(3, dtype=np.int32), (len(vertices), 1))
    side = -1.0 if mirrored else 1.0
    nodes = [
        NodeData("armature", -1, translation=(0.5, 2.0, -1.0), rotation=quat((0, 0, 1), 30.0),
                 scale=(side * 1.5, 1.5, 1.5)),
        NodeData("root joint", 0),
        NodeData("middle joint", 1, translation=(0.0, 0.0, 1.0)),
        NodeData("tip joint", 2, translation=(0.0, 0.0, 1.0), scale=(1.0, 1.2, 0.9)),
        NodeData("tube", 0, translation=(9.0, 9.0, 9.0), rotation=quat((1, 0, 0), 70.0), geoms=(0,), skin=0),
    ]  # fmt: skip
    arrays = {
        "vertices": vertices,
        "triangles": triangles,
        "normals": normals,
        "joints": joints,
        "joint_weights": weights,
    }
    inverse_bind = np.tile(np.eye(4), (3, 1, 1))
    inverse_bind[:, 3, 2] = 0.0, -1.0, -2.0
    times = np.array([0.0, 0.5, 1.25, 2.0])
    bend = np.array([quat((1, 0, 0), degrees) for degrees in (0.0, 40.0, -35.0, 0.0)])
    twist = np.array([quat((0, 0, 1), degrees) for degrees in (0.0, 90.0, 170.0, 10.0)])
    moves = np.array([(0.0, 0.0, 0.0), (0.1, 0.2, 0.3), (-0.3, 0.0, 0.1), (0.0, 0.0, 0.0)])
    animations = [
        AnimationData("bend", [
            ChannelData(2, "rotation", times, bend),
            ChannelData(3, "rotation", times, bend),
            ChannelData(1, "translation", times, moves),
        ]),
        AnimationData("twist", [ChannelData(3, "rotation", times, twist)]),
    ]  # fmt: skip
    return ModelData(
        "tube",
        nodes,
        [GeomData("tube", 0, arrays, flat)],
        [MaterialData("clay", (0.7, 0.4, 0.3, 1.0))],
        skins=[SkinData("spine", (1, 2, 3), inverse_bind)],
        animations=animations,
    )


def bulging_tube(flat=False):
    """A tube with two morph targets, on two nodes with weights of their own; one of them is animated."""
    vertices, triangles, normals = tube()
    if flat:
        vertices, triangles, normals = unwelded(vertices, triangles)
    wave = np.sin(vertices[:, 2:] * 2.0)
    bulge = vertices * (1.0, 1.0, 0.0) * wave
    lean = np.stack([vertices[:, 2] ** 2 * 0.2, 0.0 * vertices[:, 0], 0.1 * vertices[:, 2]], axis=1)
    arrays = {
        "vertices": vertices,
        "triangles": triangles,
        "normals": normals,
        "morph_vertices": np.stack([bulge, lean]),
        "morph_normals": np.stack([normals[:, [2, 2, 0]] * wave - normals * (0.0, 0.0, 0.3), 0.2 * lean]),
    }
    nodes = [
        NodeData("left", -1, translation=(-1.5, 4.0, 0.0), geoms=(0,), morph_weights=(0.5, 0.0)),
        NodeData("right", -1, translation=(1.5, 4.0, 0.0), geoms=(0,), morph_weights=(0.0, 1.0)),
    ]
    times = np.array([0.0, 1.0, 2.0])
    course = np.array([(0.0, 0.0), (1.0, 0.5), (0.0, 0.0)])
    return ModelData(
        "bulge",
        nodes,
        [GeomData("tube", 0, arrays, flat)],
        [MaterialData("clay", (0.3, 0.5, 0.7, 1.0))],
        animations=[AnimationData("breathe", [ChannelData(0, "morph_weights", times, course)])],
    )


def quat(axis, degrees):
    half = math.radians(degrees) / 2.0
    return (math.cos(half), *(math.sin(half) * np.array(axis, dtype=float)).tolist())


# --- The same by plain loops ---


def rows_of(translation, rotation, scale):
    """The matrix for row vectors of a scale, then a rotation (w, x, y, z), then a translation."""
    w, x, y, z = rotation
    column_form = np.array([
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ])  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(scale) @ column_form.T
    matrix[3, :3] = translation
    return matrix


def linear_value(made, time, duration):
    """A channel's value with LINEAR interpolation, its keys less than a half turn apart."""
    time %= duration
    times = made.times.tolist()
    if time >= times[-1]:
        return made.values[-1]
    k = max(index for index, key in enumerate(times) if key <= time)
    t = (time - times[k]) / (times[k + 1] - times[k])
    a, b = made.values[k], made.values[k + 1]
    if made.path != "rotation":
        return a + (b - a) * t
    if a @ b < 0.0:
        b = -b
    angle = math.acos(min(1.0, a @ b))
    if angle < 1e-6:
        return a + (b - a) * t
    return (math.sin((1 - t) * angle) * a + math.sin(t * angle) * b) / math.sin(angle)


def posed_corners(data, time, animation=0):
    """Vertices and normals in the model's space, by plain loops: {(node, geom): (p, n)}."""
    parts = [
        {"translation": node.translation, "rotation": node.rotation, "scale": node.scale}
        for node in data.nodes
    ]
    weights = [node.morph_weights for node in data.nodes]
    if animation is not None:
        made = data.animations[animation]
        duration = max(channel.times[-1] for channel in made.channels)
        for channel in made.channels:
            value = linear_value(channel, time, duration)
            if channel.path == "morph_weights":
                weights[channel.node] = value
            else:
                parts[channel.node][channel.path] = value
    nets = []
    for node, part in zip(data.nodes, parts, strict=True):
        local = node.matrix if node.matrix is not None else rows_of(**part)
        nets.append(local @ (nets[node.parent] if node.parent >= 0 else np.eye(4)))
    found = {}
    for index, node in enumerate(data.nodes):
        for number in node.geoms:
            found[index, number] = _posed(data, node, data.geoms[number], weights[index], nets, nets[index])
    return found


def _posed(data, node, geom, weights, nets, net):
    arrays = geom.arrays
    points, normals = [], []
    for vertex, point in enumerate(arrays["vertices"]):
        normal = np.array(arrays["normals"][vertex])
        point = np.array(point)
        for target, weight in enumerate(weights):
            point = point + weight * arrays["morph_vertices"][target][vertex]
            normal = normal + weight * arrays["morph_normals"][target][vertex]
        matrix = net
        if node.skin is not None:
            skin = data.skins[node.skin]
            matrix = np.zeros((4, 4))
            for joint, weight in zip(arrays["joints"][vertex], arrays["joint_weights"][vertex], strict=True):
                matrix = matrix + weight * (skin.inverse_bind[joint] @ nets[skin.joints[joint]])
        points.append((np.append(point, 1.0) @ matrix)[:3])
        turned = normal @ np.linalg.inv(matrix[:3, :3]).T
        normals.append(turned / np.linalg.norm(turned))
    points, normals = np.array(points), np.array(normals)
    if geom.flat:
        determinant = np.linalg.det(net[:3, :3])
        for a, b, c in arrays["triangles"]:
            face = np.cross(points[b] - points[a], points[c] - points[a]) * np.sign(determinant)
            normals[[a, b, c]] = face / np.linalg.norm(face)
    return points, normals


def drawn_corners(path):
    """Vertices and normals of every Geom below a path, in the path's space: {node name: (p, n)}."""
    found = {}
    for below in path.find_all_matches("**/+GeomNode"):
        net = below.get_transform(path).get_mat()
        for geom, _ in below.node().geoms:
            normals = geom.normals @ np.linalg.inv(net[:3, :3]).T
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            found[below.get_name()] = geom.vertices @ net[:3, :3] + net[3, :3], normals
    return found

"""Scenes as users of pyrender build them, with its own classes alone: each shows a part of what it can draw.

Every function builds a new pyrender Scene; `tests.interop.door_cases` says how it is drawn.
"""

from __future__ import annotations

import math

import numpy as np
import pyrender
import trimesh
from trimesh.transformations import rotation_matrix, scale_matrix, translation_matrix

from tests.interop.door_parts import (
    ASKEW,
    EYE,
    add_lights,
    add_shapes,
    at,
    bumps,
    card,
    colored,
    look,
    picture,
    scene,
    shell,
    textured,
)


def smooth_and_flat():
    """Smooth normals, flat ones (``smooth=False``), and the material of a mesh without one."""
    return add_lights(add_shapes(scene()), suns=1)


def one_lamp():
    """One point light."""
    return add_lights(add_shapes(scene(), look()), lamps=1)


def four_lamps():
    """Four point lights on smooth metal."""
    return add_lights(add_shapes(scene(), look(metallic=0.9, roughness=0.3)), lamps=4)


def spotlights():
    """Three spotlights on rough dielectrics."""
    return add_lights(add_shapes(scene(), look(metallic=0.0, roughness=0.9)), spots=3)


def twelve_lights():
    """Four lights of each kind."""
    return add_lights(add_shapes(scene(), look(metallic=0.5)), suns=4, lamps=4, spots=4)


def no_light():
    """Ambient light alone."""
    return add_shapes(scene(ambient_light=(0.5, 0.4, 0.3)), look())


def default_background():
    """A Scene's own background, and an aspect ratio that is the picture's."""
    made = pyrender.Scene()
    made.add(pyrender.PerspectiveCamera(yfov=0.7, aspectRatio=4 / 3), pose=EYE)
    return add_lights(add_shapes(made), suns=2)


def textures():
    """Images of trimesh's SimpleMaterial: RGB, RGBA, and one that repeats and is seen smaller than it is."""
    made = add_lights(scene(), suns=1, lamps=1)
    made.add(pyrender.Mesh.from_trimesh(card(picture())), pose=at(-1.0, 0.6, turn=0.3))
    made.add(
        pyrender.Mesh.from_trimesh(card(picture(seed=2, channels=4)), smooth=False),
        pose=at(1.0, 0.5, turn=-0.4),
    )
    made.add(
        pyrender.Mesh.from_trimesh(card(picture((64, 64), 3), repeat=3.0)), pose=at(0.2, -1.0, -3.0, 0.2)
    )
    return made


def pbr_visuals():
    """trimesh's PBRMaterial: a texture, metalness, roughness, emission."""
    made = add_lights(scene(), suns=2)
    shiny = trimesh.visual.material.PBRMaterial(
        baseColorTexture=picture(seed=4),
        baseColorFactor=(255, 220, 200, 255),
        metallicFactor=0.6,
        roughnessFactor=0.4,
    )
    dull = trimesh.visual.material.PBRMaterial(
        baseColorFactor=(90, 200, 120, 255),
        metallicFactor=0.0,
        roughnessFactor=1.0,
        emissiveFactor=(0.3, 0.2, 0.1),
    )
    made.add(pyrender.Mesh.from_trimesh(card(material=shiny, size=2.0)), pose=at(-1.2, 0.0, turn=0.4))
    made.add(pyrender.Mesh.from_trimesh(card(material=dull, size=2.0)), pose=at(1.2, 0.0, turn=-0.4))
    return made


def samplers():
    """Filters and wrap modes."""
    made = add_lights(scene(), suns=1)
    gl = pyrender.GLTF
    kinds = [
        (gl.NEAREST, gl.NEAREST, gl.CLAMP_TO_EDGE),
        (gl.LINEAR, gl.LINEAR_MIPMAP_NEAREST, gl.MIRRORED_REPEAT),
        (gl.NEAREST, gl.NEAREST_MIPMAP_LINEAR, gl.REPEAT),
    ]
    for index, (large, small, wrap) in enumerate(kinds):
        sampler = pyrender.Sampler(magFilter=large, minFilter=small, wrapS=wrap, wrapT=wrap)
        image = pyrender.Texture(source=picture((32, 32), 5), source_channels="RGB", sampler=sampler)
        flat = textured({"baseColorTexture": image}, color=(1.0, 1.0, 1.0, 1.0), metallic=0.0)
        flat.primitives[0].texcoord_0 = 2.5 * flat.primitives[0].texcoord_0 - 0.7
        made.add(flat, pose=at(1.7 * index - 1.7, 0.2, turn=0.5))
    return made


def surface_maps():
    """A normal map, occlusion, metalness and roughness, and emission, with and without a texture."""
    made = add_lights(scene(), suns=1, lamps=2)

    def image(pixels):
        return pyrender.Texture(source=pixels, source_channels="RGB")

    made.add(textured({"normalTexture": image(bumps())}), pose=at(-1.7, 0.9, turn=0.3))
    made.add(textured({"occlusionTexture": image(picture(seed=7))}), pose=at(0.0, 0.9, turn=0.3))
    made.add(
        textured({"metallicRoughnessTexture": image(picture(seed=8))}, metallic=1.0, roughness=1.0),
        pose=at(1.7, 0.9),
    )
    glow = {"emissiveTexture": image(picture(seed=9)), "emissiveFactor": (0.8, 0.7, 0.6)}
    made.add(textured(glow, color=(0.1, 0.1, 0.1, 1.0)), pose=at(-0.9, -0.9, turn=-0.3))
    made.add(textured({"emissiveFactor": (0.5, 0.1, 0.2)}), pose=at(0.9, -0.9, turn=-0.3))
    return made


def vertex_colors():
    """Colours of vertices, smooth and flat, and of faces."""
    made = add_lights(scene(), suns=1, lamps=1)
    made.add(colored(True), pose=at(-2.0, 0.0))
    made.add(colored(False), pose=at(0.0, 0.0))
    made.add(colored(False, faces=True), pose=at(2.0, 0.0))
    return made


def points():
    """Point clouds with colours, one with normals and one without."""
    made = add_lights(scene(), lamps=2)
    rng = np.random.default_rng(11)
    places = rng.uniform(-1.0, 1.0, (200, 3))
    made.add(pyrender.Mesh.from_points(places, colors=rng.uniform(size=(200, 3))), pose=at(-1.3, 0.0))
    facing = rng.normal(size=(200, 3))
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    made.add(
        pyrender.Mesh.from_points(places, colors=np.full((200, 4), 0.7), normals=facing), pose=at(1.3, 0.0)
    )
    return made


def lines():
    """Lines, a strip of them and a loop."""
    made = add_lights(scene(), lamps=1)
    rng = np.random.default_rng(12)
    for index, mode in enumerate((pyrender.GLTF.LINES, pyrender.GLTF.LINE_STRIP, pyrender.GLTF.LINE_LOOP)):
        primitive = pyrender.Primitive(rng.uniform(-0.8, 0.8, (8, 3)), mode=mode, material=look())
        made.add(pyrender.Mesh([primitive]), pose=at(1.7 * index - 1.7, 0.0))
    return made


def instances():
    """A mesh of six instances, with scales."""
    poses = np.array([at(x, y) @ scale_matrix(0.6 + 0.1 * x) for x in (-1, 0, 1) for y in (-1, 1)])
    box = trimesh.creation.box((0.8, 0.8, 0.8))
    made = add_lights(scene(), suns=1)
    made.add(
        pyrender.Mesh.from_trimesh(box, smooth=False, poses=poses), pose=translation_matrix((0.1, 0.1, -1))
    )
    return made


def wireframes():
    """Meshes made with ``wireframe=True``."""
    return add_lights(add_shapes(scene(), look(metallic=0.0), wireframe=True), suns=1)


def nested_nodes():
    """A light below a box below a ball, with rotations and a scale."""
    made = add_lights(scene(), suns=1)
    ball = pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(2, radius=0.5), material=look())
    box = pyrender.Mesh.from_trimesh(trimesh.creation.box((0.6, 0.6, 0.6)), smooth=False)
    upper = pyrender.Node(
        "upper", mesh=ball, translation=(-0.6, -0.2, 0), rotation=(0, 0, 0.6, 0.8), scale=(1.5, 1.5, 1.5)
    )
    made.add_node(upper)
    lower = pyrender.Node("lower", mesh=box, translation=(0.5, -0.9, 0.2), rotation=(0.1, 0.1, 0.7, 0.7))
    made.add_node(lower, parent_node=upper)
    lamp = pyrender.Node("lamp", light=pyrender.PointLight(intensity=6.0), translation=(0.5, 0.5, 1.0))
    made.add_node(lamp, parent_node=lower)
    return made


def mirrored():
    """Transforms that mirror: a double-sided mesh, a one-sided one, and two instances of one."""
    made = add_lights(scene(), suns=1)
    mirror = np.diag((-1.0, 1.0, 1.0, 1.0))
    for index, both in enumerate((True, False)):
        ring = trimesh.creation.torus(0.6, 0.25)
        mesh = pyrender.Mesh.from_trimesh(ring, material=look(doubleSided=both))
        made.add(mesh, pose=at(1.8 * index - 1.8, 0.0) @ mirror)
    poses = np.array([translation_matrix((0.0, 0.7, 0.0)), translation_matrix((0.0, -0.7, 0.0)) @ mirror])
    made.add(shell(0.6, 0.3, look(), poses=poses), pose=translation_matrix((1.8, 0, 0)))
    return made


def invisible():
    """A mesh that is not visible."""
    made = smooth_and_flat()
    node = next(node for node in made.mesh_nodes if node.name == "box")
    node.mesh.is_visible = False
    return made


def double_sided():
    """Open shells seen from inside: one-sided and double-sided."""
    made = add_lights(scene(), suns=1)
    for index, both in enumerate((False, True)):
        made.add(shell(0.9, 0.3, look(metallic=0.0, doubleSided=both)), pose=at(2.2 * index - 1.1, 0, 0, 0.3))
    return made


def panes():
    """Three blended panes in a row, which cover each other in part."""
    made = add_lights(add_shapes(scene()), suns=1)
    for index, color in enumerate([(0.9, 0.2, 0.1, 0.5), (0.1, 0.8, 0.2, 0.3), (0.2, 0.2, 0.9, 0.7)]):
        box = trimesh.creation.box((2.4, 1.2, 0.01))
        mesh = pyrender.Mesh.from_trimesh(box, material=look(color, alphaMode="BLEND"), smooth=False)
        made.add(mesh, pose=translation_matrix((0.5 * index - 0.5, 0.2 * index, 1.2 + 0.4 * index)))
    return made


def vertex_alpha():
    """Alpha in vertex colours."""
    made = add_lights(add_shapes(scene()), suns=1)
    sheet = trimesh.creation.box((3.0, 2.0, 0.01))
    colors = np.random.default_rng(13).integers(60, 200, (len(sheet.vertices), 4), dtype=np.uint8)
    sheet.visual.vertex_colors = colors
    made.add(pyrender.Mesh.from_trimesh(sheet, smooth=False), pose=translation_matrix((0, 0, 1.5)))
    return made


def stretched():
    """An aspect ratio unlike the picture's, a near and a far plane."""
    made = scene()
    made.main_camera_node.camera = pyrender.PerspectiveCamera(yfov=0.8, aspectRatio=1.0, znear=0.5, zfar=20.0)
    return add_lights(add_shapes(made), suns=1)


def intrinsics():
    """An IntrinsicsCamera off centre, of pixels that are not square."""
    made = scene()
    made.main_camera_node.camera = pyrender.IntrinsicsCamera(
        fx=170.0, fy=200.0, cx=70.0, cy=66.0, znear=0.1, zfar=50.0
    )
    return add_lights(add_shapes(made), suns=1)


def orthographic():
    """An OrthographicCamera."""
    made = scene()
    made.main_camera_node.camera = pyrender.OrthographicCamera(xmag=2.0, ymag=2.0, znear=0.5, zfar=20.0)
    return add_lights(add_shapes(made, look(metallic=0.6, roughness=0.4)), suns=1, lamps=1)


def moved_camera():
    """A camera that was moved with ``set_pose``."""
    made = smooth_and_flat()
    made.set_pose(
        made.main_camera_node, rotation_matrix(0.5, (0, 1, 0)) @ rotation_matrix(-0.3, (1, 0, 0)) @ EYE
    )
    return made


def several_primitives():
    """A mesh of two primitives."""
    made = add_lights(scene(), suns=1, lamps=1)
    both = [trimesh.creation.icosphere(2, radius=0.8), trimesh.creation.box((0.9, 0.9, 2.4))]
    made.add(pyrender.Mesh.from_trimesh(both, material=look()), pose=ASKEW)
    return made


def strips_and_fans():
    """A fan and a strip of triangles."""
    made = add_lights(scene(), suns=1)
    around = np.linspace(0.0, 2.0 * math.pi, 9)
    rim = np.column_stack([np.cos(around), np.sin(around), 0 * around])
    normals = np.tile((0.0, 0.0, 1.0), (10, 1))
    fan = pyrender.Primitive(
        np.vstack([(0, 0, 0), rim]), normals=normals, mode=pyrender.GLTF.TRIANGLE_FAN, material=look()
    )
    made.add(pyrender.Mesh([fan]), pose=at(-1.3, 0.0, turn=0.4))
    zigzag = np.array([(0.3 * index - 1.2, 0.7 * (-1) ** index, 0.0) for index in range(9)])
    strip = pyrender.Primitive(
        zigzag, normals=normals[:9], mode=pyrender.GLTF.TRIANGLE_STRIP, material=look()
    )
    made.add(pyrender.Mesh([strip]), pose=at(1.3, 0.0, turn=0.2))
    return made


def no_normals():
    """A mesh without normals, which faces the camera everywhere."""
    made = add_lights(scene(), lamps=2)
    box = trimesh.creation.icosphere(2, radius=1.2)
    primitive = pyrender.Primitive(box.vertices, indices=box.faces, material=look())
    made.add(pyrender.Mesh([primitive]), pose=ASKEW)
    return made


def clear_background():
    """A background of alpha 0."""
    return add_lights(add_shapes(scene(bg_color=(0.4, 0.1, 0.7, 0.0))), suns=1)


def inside_out():
    """The back sides of one-sided triangles."""
    made = add_lights(scene(), suns=1)
    made.add(shell(1.4, 0.5, look(metallic=0.0)), pose=rotation_matrix(0.4, (1, 0, 0)))
    return made

"""Small glTF files, each with one feature of the format: what the contact sheet of docs/ shows.

`FILES` has a function for each label; it returns the file in the making. Those with a time in seconds are
drawn at that moment of their animation.
"""

from __future__ import annotations

import math

import numpy as np
from PIL import Image

from models.gltf_writer import (
    ARRAY_BUFFER,
    CLAMP,
    LINEAR,
    MIRROR,
    NEAREST,
    REPEAT,
    TRIANGLE_FAN,
    TRIANGLE_STRIP,
    Gltf,
    turn,
)
from tests.model.sheet_materials import FILES as MATERIALS
from tests.model.sheet_shapes import (
    CORAL,
    GOLD,
    INK,
    TEAL,
    ball,
    card,
    cube,
    encoded,
    grid,
    house,
    leaf,
    picture,
    ring,
    smooth_normals,
)


def show(arrays, material=None, gltf=None, **node):
    """A file with one mesh of (points, normals, texcoords, triangles)."""
    gltf = gltf or Gltf()
    points, normals, texcoords, triangles = arrays
    made = gltf.primitive(points, triangles, material=material, NORMAL=normals, TEXCOORD_0=texcoords)
    gltf.node("shape", mesh=gltf.mesh([made]), **node)
    return gltf


def painted(gltf, color, **more):
    return gltf.material(color=(*color, 1.0), roughness=0.55, **more)


# --- modes, colours, normals


def triangles():
    gltf = Gltf()
    angle = np.radians(np.arange(10) * 36.0 + 90.0)
    reach = np.where(np.arange(10) % 2 == 0, 1.0, 0.42)
    rim = np.stack([reach * np.cos(angle), reach * np.sin(angle), 0.0 * angle], axis=1)
    points = np.concatenate([rim, [(0.0, 0.0, 0.25)]])
    faces = [(k, (k + 1) % 10, 10) for k in range(10)]
    made = gltf.primitive(points, faces, material=painted(gltf, GOLD, doubleSided=True))
    gltf.node("star", mesh=gltf.mesh([made]))
    return gltf


def triangle_strip():
    gltf = Gltf()
    t = np.linspace(0.0, 1.0, 33)
    x, height = 2.4 * (t - 0.5), 0.35 * np.sin(t * 9.0)
    edges = [np.stack([x, height + side, 0.35 * np.cos(t * 9.0)], axis=1) for side in (0.4, -0.4)]
    points = np.stack(edges, axis=1).reshape(-1, 3)
    ribbon = painted(gltf, CORAL, doubleSided=True)
    gltf.node("ribbon", mesh=gltf.mesh([gltf.primitive(points, material=ribbon, mode=TRIANGLE_STRIP)]))
    return gltf


def triangle_fan():
    gltf = Gltf()
    angle = np.radians(np.linspace(20.0, 160.0, 15))
    fold = np.where(np.arange(15) % 2 == 0, 0.12, -0.12)
    rim = np.stack([1.4 * np.cos(angle), 1.4 * np.sin(angle), fold], axis=1)
    points = np.concatenate([[(0.0, 0.0, 0.0)], rim])
    paper = painted(gltf, TEAL, doubleSided=True)
    gltf.node("fan", mesh=gltf.mesh([gltf.primitive(points, material=paper, mode=TRIANGLE_FAN)]))
    return gltf


def vertex_colors():
    gltf = Gltf()
    points, normals, _, faces = ball()
    colors = np.round((0.5 + 0.5 * points) ** 2 * 255.0).astype(np.uint8)
    plain = painted(gltf, (1.0, 1.0, 1.0))
    made = gltf.primitive(points, faces, material=plain, NORMAL=normals, COLOR_0=with_alpha(colors))
    gltf.node("ball", mesh=gltf.mesh([made]))
    return gltf


def with_alpha(colors, alpha=255):
    return np.concatenate([colors, np.broadcast_to(np.uint8(alpha), (len(colors), 1))], axis=1)


def vertex_alpha():
    gltf = Gltf()
    points, normals, texcoords, faces = ball(1.0, 40, 72)
    wave = np.sin(texcoords[:, 1] * 31.0 + 3.0 * np.sin(texcoords[:, 0] * 4.0 * math.pi))
    colors = np.full((len(points), 4), (220, 90, 50, 0), np.uint8)
    colors[:, 3] = np.round(127.5 + 127.5 * wave)
    cut = painted(gltf, (1.0, 1.0, 1.0), alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
    made = gltf.primitive(points, faces, material=cut, NORMAL=normals, COLOR_0=colors)
    gltf.node("ball", mesh=gltf.mesh([made]))
    return gltf


def flat_normals(smooth=False):
    gltf = Gltf()
    points, normals, _, faces = ball(1.0, 7, 12)
    made = gltf.primitive(points, faces, material=painted(gltf, TEAL), NORMAL=normals if smooth else None)
    gltf.node("ball", mesh=gltf.mesh([made]))
    return gltf


def default_material():
    return show(cube(), rotation=turn((0, 1, 0), 10.0))


# --- textures


def textured(image=None, slot=None, shape=None, sampler=None, **more):
    gltf = Gltf()
    texture = gltf.texture(gltf.image(image or encoded(picture())), **(sampler or {}))
    made = gltf.material(texture=gltf.slot(texture, **(slot or {})), roughness=1.0, **more)
    return show(shape or card(1.6, 1.6), made, gltf)


def jpeg():
    return textured(encoded(picture(size=128), "JPEG", quality=90), shape=cube())


def second_uv():
    gltf = Gltf()
    texture = gltf.texture(gltf.image(encoded(picture())))
    points, normals, texcoords, faces = card(1.6, 1.6)
    slotted = gltf.material(texture=gltf.slot(texture, 1), roughness=1.0)
    quarter = np.stack([texcoords[:, 1], 1.0 - texcoords[:, 0]], axis=1)
    made = gltf.primitive(
        points, faces, material=slotted, NORMAL=normals, TEXCOORD_0=0.0 * texcoords, TEXCOORD_1=quarter
    )
    gltf.node("card", mesh=gltf.mesh([made]))
    return gltf


def wrapped(mode):
    points, normals, texcoords, faces = card(1.6, 1.6)
    return textured(
        shape=(points, normals, 2.6 * texcoords - 0.8, faces), sampler={"wrapS": mode, "wrapT": mode}
    )


def filtered(mode):
    small = Image.fromarray(
        np.array(
            [[(0, 60, 70), (230, 120, 60), (240, 200, 90)], [(250, 240, 220), (40, 150, 150), (120, 40, 50)]],
            np.uint8,
        )
    )
    return textured(
        encoded(small),
        sampler={"minFilter": mode, "magFilter": mode, "wrapS": CLAMP, "wrapT": CLAMP},
        shape=card(1.8, 1.2),
    )


def grey_16_bit():
    y, x = (np.mgrid[0:96, 0:96] + 0.5) / 96.0
    waves = 0.5 + 0.5 * np.sin(30.0 * np.hypot(x - 0.5, y - 0.5)) * (1.0 - np.hypot(x - 0.5, y - 0.5))
    return textured(encoded(Image.fromarray(np.round(waves * 65535.0).astype(np.uint16))))


def palette():
    image = picture("RGBA", 96)
    pixels = np.array(image)
    y, x = np.mgrid[0:96, 0:96] - 47.5
    pixels[np.hypot(x, y) > 47.0] = 0
    coded = Image.fromarray(pixels).quantize(16, method=Image.Quantize.FASTOCTREE)
    return textured(encoded(coded), alphaMode="MASK", doubleSided=True)


def mask(cutoff):
    return textured(encoded(leaf()), alphaMode="MASK", alphaCutoff=cutoff, doubleSided=True)


def double_sided():
    """Two curls, of which the left one has one side."""
    gltf = Gltf()

    def curl(u, v):
        angle = 2.4 * math.pi * u
        size = 0.45 + 0.10 * u
        return size * np.cos(angle), 1.3 * (0.5 - v), size * np.sin(angle)

    points, _, faces = grid(1, 40, curl)
    for k, both in enumerate((False, True)):
        made = gltf.primitive(points, faces, material=painted(gltf, CORAL, doubleSided=both))
        gltf.node(f"curl {k}", mesh=gltf.mesh([made]), translation=(1.25 * k, 0.0, 0.0))
    return gltf


def emission():
    gltf = Gltf()
    y, x = (np.mgrid[0:64, 0:128] + 0.5) / 64.0
    bands = np.exp(-((((x + 0.12 * np.sin(y * 9.0)) * 4.0 % 1.0 - 0.5) / 0.10) ** 2))
    codes = np.round(bands[..., None] * (255, 140, 40)).astype(np.uint8)
    glow = gltf.texture(gltf.image(encoded(Image.fromarray(codes))))
    made = gltf.material(
        color=(*INK, 1.0), roughness=0.4, emission=(1, 1, 1), emission_texture=glow, strength=2.5
    )
    return show(ball(), made, gltf)


# --- nodes


def mirrored():
    gltf = Gltf()
    points, normals, faces = house()
    made = gltf.mesh([gltf.primitive(points, faces, material=painted(gltf, GOLD), NORMAL=normals)])
    gltf.node("house", mesh=made, translation=(0.9, 0.0, 0.0))
    gltf.node("its mirror image", mesh=made, translation=(-0.9, 0.0, 0.0), scale=(-1.0, 1.0, 1.0))
    return gltf


def instances():
    gltf = Gltf()
    points, normals, _, faces = cube(0.4)
    made = gltf.mesh([gltf.primitive(points, faces, material=painted(gltf, TEAL), NORMAL=normals)])
    k = np.arange(40)
    angle = k * 0.5
    places = np.stack([np.cos(angle), 0.055 * k - 1.1, np.sin(angle)], axis=1)
    attributes = {
        "TRANSLATION": gltf.accessor(places),
        "ROTATION": gltf.accessor(turn((0, 1, 0), -np.degrees(angle))),
        "SCALE": gltf.accessor(np.repeat(0.3 + 0.016 * k[:, None], 3, axis=1)),
    }
    gltf.use("EXT_mesh_gpu_instancing", required=True)
    gltf.node("spiral", mesh=made, extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    return gltf


def skin():
    gltf = Gltf()
    bar = painted(gltf, CORAL)
    mesh = gltf.mesh([limb(gltf, bar)])
    joints = [gltf.node("joint 0")]
    for k in range(1, 4):
        joints.append(
            gltf.node(f"joint {k}", joints[-1], translation=(0.0, 0.7, 0.0), rotation=turn((0, 0, 1), -32.0))
        )
    rest = np.tile(np.eye(4), (4, 1, 1))
    rest[:, 3, 1] = -0.7 * np.arange(4)
    gltf.node("limb", mesh=mesh, skin=gltf.skin(joints, rest))
    return gltf


def limb(gltf, material):
    """A rounded bar of 2.8 units along Y that hangs on four joints."""

    def place(u, v):
        angle = 2.0 * math.pi * u
        y = 2.8 * (1.0 - v)
        size = 0.30 * np.clip(1.0 - (2.0 * v - 1.0) ** 14, 0.0, 1.0) ** 0.5
        return -size * np.cos(angle), y, size * np.sin(angle)

    points, _, faces = grid(40, 20, place)
    along = np.clip(points[:, 1] / 0.7, 0.0, 3.0)
    first = np.minimum(along.astype(int), 2)
    share = along - first
    joints = np.stack([first, first + 1, 0 * first, 0 * first], axis=1)
    weights = np.stack([1.0 - share, share, 0.0 * share, 0.0 * share], axis=1)
    normals = points * (1.0, 0.0, 1.0)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    normals[np.linalg.norm(normals, axis=1) < 0.5] = (0.0, 1.0, 0.0)
    return gltf.primitive(
        points, faces, material=material, NORMAL=normals, JOINTS_0=joints, WEIGHTS_0=weights
    )


def morph():
    gltf = Gltf()
    points, normals, _, faces = ball(1.0, 24, 40)
    ribs = 0.22 * np.cos(7.0 * np.arctan2(points[:, 2], points[:, 0])) * (1.0 - points[:, 1] ** 2) ** 2
    moves = [points * ribs[:, None], points * (0.15, -0.35, 0.15)]
    targets = [{"POSITION": move, "NORMAL": smooth_normals(points + move, faces) - normals} for move in moves]
    made = gltf.primitive(points, faces, material=painted(gltf, TEAL), NORMAL=normals, targets=targets)
    gltf.node("pumpkin", mesh=gltf.mesh([made], weights=[1.0, 0.9]))
    return gltf


def animation():
    """A ball that jumps over a box, as cubic splines and rotations."""
    gltf = Gltf()
    points, normals, _, faces = ball(0.32, 12, 20)
    hopping = gltf.mesh([gltf.primitive(points, faces, material=painted(gltf, CORAL), NORMAL=normals)])
    points, normals, _, faces = cube(0.8)
    standing = gltf.mesh([gltf.primitive(points, faces, material=painted(gltf, TEAL), NORMAL=normals)])
    box = gltf.node("box", mesh=standing, translation=(0.0, 0.0, 0.0))
    hop = gltf.node("ball", mesh=hopping, translation=(-1.3, 0.0, 0.0))
    times = [0.0, 0.5, 1.0]
    level, rise = (1.3, 0.0, 0.0), (2.6, 2.2, 0.0)
    spline = [
        [(0, 0, 0), (-1.3, -0.08, 0), rise],
        [(2.6, 0, 0), (0, 1.0, 0), (2.6, 0, 0)],
        [(2.6, -2.2, 0), (level[0], -0.08, 0), (0, 0, 0)],
    ]
    channels = [
        (hop, "translation", times, spline, "CUBICSPLINE"),
        (box, "rotation", times, turn((0, 1, 0), [0.0, 45.0, 90.0])),
    ]
    gltf.animation(channels, "hop")
    return gltf


# --- accessors


def sparse():
    """A plane of zeros, of which some vertices are lifted by a sparse accessor."""
    gltf = Gltf()
    points, _, faces = grid(12, 12, lambda u, v: (2.0 * u - 1.0, 0.0 * u, 2.0 * v - 1.0))
    base = gltf.accessor(points, target=ARRAY_BUFFER, bounds=True)
    lifted = np.flatnonzero(np.hypot(points[:, 0], points[:, 2]) < 0.75)
    moved = points[lifted].copy()
    moved[:, 1] = 0.9 * np.cos(np.hypot(moved[:, 0], moved[:, 2]) / 0.75 * math.pi / 2.0)
    gltf.json["accessors"][base] |= {
        "max": [1.0, float(np.float32(moved[:, 1].max())), 1.0],
        "sparse": {
            "count": len(lifted),
            "indices": {"bufferView": gltf.view(lifted.astype("<u2").tobytes()), "componentType": 5123},
            "values": {"bufferView": gltf.view(moved.astype("<f4").tobytes())},
        },
    }
    made = gltf.primitive(base, faces, material=painted(gltf, GOLD, doubleSided=True))
    gltf.node("cloth", mesh=gltf.mesh([made]))
    return gltf


def quantised():
    gltf = Gltf()
    points, normals, _, faces = ring()
    gltf.use("KHR_mesh_quantization", required=True)
    made = gltf.primitive(
        np.round(points / 1.1 * 32767.0).astype(np.int16),
        faces,
        material=painted(gltf, CORAL),
        NORMAL=np.round(normals * 127.0).astype(np.int8),
    )
    gltf.node("ring", mesh=gltf.mesh([made]), scale=(1.1, 1.1, 1.1), rotation=turn((1, 0, 0), 40.0))
    return gltf


def interleaved():
    gltf = Gltf()
    points, normals, _, faces = ring()
    rows = np.concatenate([points, normals], axis=1).astype("<f4")
    view = gltf.view(rows.tobytes(), byteStride=24, target=ARRAY_BUFFER)
    common = {"bufferView": view, "componentType": 5126, "count": len(rows), "type": "VEC3"}
    low, high = rows[:, :3].min(axis=0).tolist(), rows[:, :3].max(axis=0).tolist()
    position = gltf.add("accessors", **common, min=low, max=high)
    normal = gltf.add("accessors", **common, byteOffset=12)
    made = gltf.primitive(position, faces, material=painted(gltf, TEAL), NORMAL=normal)
    gltf.node("ring", mesh=gltf.mesh([made]), rotation=turn((1, 0, 0), 40.0))
    return gltf


# --- cameras and lights


def stage(gltf):
    """A floor with three things on it, for lights and cameras."""
    floor = grid(8, 8, lambda u, v: (3.2 * u - 1.6, 0.0 * u, 3.2 * v - 1.6))
    parts = [gltf.primitive(floor[0], floor[2], material=painted(gltf, (0.55, 0.52, 0.47)))]
    for arrays, tone, where in (
        (ball(0.45), CORAL, (-0.65, 0.45, 0.15)),
        (cube(0.7), GOLD, (0.55, 0.35, -0.35)),
        (ring(0.35, 0.13), TEAL, (0.35, 0.13, 0.85)),
    ):
        points, normals, _, faces = arrays
        parts.append(gltf.primitive(points + where, faces, material=painted(gltf, tone), NORMAL=normals))
    gltf.node("stage", mesh=gltf.mesh(parts))


def camera():
    """A wide-angle camera close to the floor."""
    gltf = Gltf()
    stage(gltf)
    lens = gltf.camera(75.0, znear=0.05, zfar=20.0)
    gltf.node("frog", camera=lens, translation=(0.05, 0.22, 1.75), rotation=turn((1, 0, 0), 4.0))
    return gltf


def lit(kind, **light):
    gltf = Gltf()
    stage(gltf)
    tones = {"point": (1.0, 0.75, 0.45), "spot": (0.75, 0.9, 1.0), "directional": (1.0, 0.95, 0.85)}
    lamp = gltf.light(kind, tones[kind], 20.0, **light)
    if kind == "point":
        gltf.node("lamp", light=lamp, translation=(0.1, 1.0, 0.5))
    elif kind == "spot":  # lights shine along -Z of their nodes: straight down
        gltf.node("lamp", light=lamp, translation=(0.0, 2.4, 0.15), rotation=turn((1, 0, 0), -90.0))
    else:
        heading = gltf.node("heading", rotation=turn((0, 1, 0), 30.0))
        gltf.node("lamp", heading, light=lamp, rotation=turn((1, 0, 0), -40.0))
    return gltf


FILES = {
    "triangles": triangles,
    "triangle strip": triangle_strip,
    "triangle fan": triangle_fan,
    "vertex colours": vertex_colors,
    "vertex alpha": vertex_alpha,
    "no normals: flat": flat_normals,
    "normals": lambda: flat_normals(smooth=True),
    "default material": default_material,
    "JPEG": jpeg,
    "16-bit PNG": grey_16_bit,
    "palette PNG": palette,
    "second UV set": second_uv,
    "texture transform": lambda: textured(slot={"rotation": 0.5, "scale": [2.0, 2.0], "offset": [-0.3, 0.1]}),
    "wrap: repeat": lambda: wrapped(REPEAT),
    "wrap: mirror": lambda: wrapped(MIRROR),
    "wrap: clamp": lambda: wrapped(CLAMP),
    "filter: nearest": lambda: filtered(NEAREST),
    "filter: linear": lambda: filtered(LINEAR),
    "mask, cut-off 0.2": lambda: mask(0.2),
    "mask, cut-off 0.7": lambda: mask(0.7),
    "one side, two sides": double_sided,
    "emission texture": emission,
    "mirrored node": mirrored,
    "instances": instances,
    "skin": skin,
    "morph targets": morph,
    "animation at 0 s": animation,
    "at 0.35 s": animation,
    "at 0.7 s": animation,
    "sparse accessor": sparse,
    "quantised": quantised,
    "interleaved": interleaved,
    "camera of the file": camera,
    "point light": lambda: lit("point"),
    "spotlight": lambda: lit("spot", spot={"innerConeAngle": 0.3, "outerConeAngle": 0.5}),
    "directional light": lambda: lit("directional"),
    **MATERIALS,
}
TIMES = {"at 0.35 s": 0.35, "at 0.7 s": 0.7}
"""Moments, of those that are not drawn at 0."""

"""Scenes of all kinds of lights and materials, each built twice: of Panda3D's nodes and of ours."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from panda3d import core

from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from tests.scenes import ball, wall

Vector = tuple[float, ...]


@dataclass
class Thing:
    """A ball, or a wall, and all that decides how it looks; `material` has Panda3D's names."""

    place: Vector
    shape: str = "ball"
    turn: Vector = (0.0, 0.0, 0.0)
    size: Vector = (1.0, 1.0, 1.0)
    material: dict | None = None
    color: Vector | None = None
    vertex_colors: bool = False
    texture: bool = False
    color_scale: Vector | None = None
    blended: bool = False
    two_sided: bool = False
    unlit: bool = False


@dataclass
class Lamp:
    """A light: where it is and how it is turned, and what its kind has."""

    kind: str
    color: Vector
    place: Vector = (0.0, 0.0, 0.0)
    turn: Vector = (0.0, 0.0, 0.0)
    attenuation: Vector = (1.0, 0.0, 0.0)
    exponent: float = 0.0
    fov: float = 40.0


@dataclass
class Description:
    things: list[Thing]
    lamps: list[Lamp] = field(default_factory=list)
    film: Vector | None = None  # of an orthographic camera


SKY = Lamp("ambient", (0.15, 0.12, 0.1))
SUN = Lamp("directional", (0.5, 0.6, 0.4), turn=(20.0, -35.0, 0.0))
BULB = Lamp("point", (1.5, 1.2, 0.9), (2.0, 6.0, 2.0), attenuation=(0.2, 0.1, 0.05))
SPOT = Lamp("spot", (1.2, 1.3, 1.6), (-1.0, 3.0, 1.5), (0.0, -12.0, 0.0), (1.0, 0.0, 0.01), 8.0, 36.0)
BEHIND = Lamp("point", (1.4, 1.4, 1.1), (0.5, 14.0, 1.5), attenuation=(0.5, 0.0, 0.004))
LAMPS = [SKY, SUN, BULB, SPOT]

DULL = {"ambient": (0.6, 0.5, 0.9), "diffuse": (0.8, 0.6, 0.3)}
SHINY = {
    "diffuse": (0.5, 0.3, 0.6),
    "ambient": (0.3, 0.3, 0.3),
    "specular": (0.7, 0.6, 0.9),
    "shininess": 25.0,
}
GLOWING = {**SHINY, "emission": (0.3, 0.1, 0.0), "specular": (0.9, 0.9, 0.9), "shininess": 5.0}
FLOOR = Thing((0.0, 11.0, -1.3), "wall", (0.0, -90.0, 0.0), (0.5, 1.0, 0.5), material=DULL)


def row(*things):
    """Things beside each other, and a floor."""
    for index, thing in enumerate(things):
        thing.place = (2.2 * (index - 0.5 * (len(things) - 1)), 9.0, 0.0)
    return [*things, FLOOR]


def ball_of(**looks):
    return Thing((0.0, 0.0, 0.0), **looks)


def pane(place, **looks):
    return Thing(place, "wall", (15.0, 0.0, 0.0), (0.1, 0.1, 0.1), blended=True, two_sided=True, **looks)


DESCRIPTIONS = {
    "materials": Description(
        row(ball_of(material=DULL), ball_of(material=SHINY, size=(1.0, 0.6, 1.2)), ball_of(material=GLOWING)),
        LAMPS,
    ),
    "textures": Description(
        row(
            ball_of(material=SHINY, texture=True),
            ball_of(material=GLOWING, texture=True, color_scale=(0.4, 0.8, 0.6, 1.0)),
            ball_of(material=DULL, color_scale=(1.6, 2.0, 1.2, 1.0)),
        ),
        [*LAMPS, Lamp("directional", (1.5, 1.5, 1.5), turn=(-50.0, -20.0, 0.0))],
    ),
    "colors": Description(
        [
            *row(
                ball_of(vertex_colors=True),
                ball_of(vertex_colors=True, texture=True, color_scale=(1.5, 0.7, 1.0, 1.0)),
                ball_of(color=(0.3, 0.9, 0.5, 1.0)),
            ),
            Thing((2.5, 8.0, 1.0), "wall", (160.0, 0.0, 0.0), (0.1, 0.1, 0.1), two_sided=True),
        ],
        LAMPS,
    ),
    "blended": Description(
        [
            *row(ball_of(material=SHINY), ball_of(material=DULL)),
            pane((0.9, 6.0, 0.3), material={**SHINY, "diffuse": (0.5, 0.3, 0.6, 0.5)}),
            pane((-0.7, 5.0, 0.0), material=GLOWING, texture=True, color_scale=(0.9, 1.4, 0.8, 0.6)),
        ],
        [*LAMPS, Lamp("directional", (1.2, 1.2, 1.2), turn=(-30.0, -10.0, 0.0))],
    ),
    "viewers": Description(
        row(
            ball_of(material={**SHINY, "local": True}),
            ball_of(material=SHINY, texture=True),
            ball_of(material={**GLOWING, "local": True}, color_scale=(0.5, 0.5, 0.5, 1.0)),
        ),
        [SKY, SPOT, BEHIND],
    ),
    "orthographic": Description(
        row(
            ball_of(material={**SHINY, "local": True}),
            ball_of(unlit=True, vertex_colors=True, texture=True, color_scale=(0.6, 0.9, 1.0, 1.0)),
            ball_of(material=SHINY),
        ),
        LAMPS,
        (8.0, 6.0),
    ),
}


def pixels_of_texture() -> np.ndarray:
    """Colours and opacities of 8 bits, shape (8, 8, 4), first row on top."""
    pixels = np.random.default_rng(7).integers(60, 256, (8, 8, 4), dtype=np.uint8)
    pixels[..., 3] = np.maximum(pixels[..., 3], 120)
    return pixels


def shape_of(thing: Thing) -> Geom:
    made = ball(1.0, 3) if thing.shape == "ball" else wall(20.0, 8)
    place = made.vertices / np.abs(made.vertices).max()
    texcoords = 0.5 + 0.5 * place[:, [0, 2]]
    colors = None
    if thing.vertex_colors:
        colors = np.concatenate([0.5 + 0.5 * place, np.ones((len(place), 1))], axis=1)
        colors = np.rint(colors * 255.0) / 255.0
    return Geom(made.vertices, made.triangles, made.normals, texcoords, colors=colors)


# --- Ours ---


def ours(name: str) -> Scene:
    """The scene of our nodes."""
    described, scene = DESCRIPTIONS[name], Scene()
    for index, thing in enumerate(described.things):
        node = GeomNode(f"thing {index}")
        node.add_geom(shape_of(thing), own_material(thing))
        path = scene.root.attach_new_node(node)
        path.set_pos_hpr_scale(*thing.place, *thing.turn, *thing.size)
        if thing.color is not None:
            path.set_color(*thing.color)
        if thing.color_scale is not None:
            path.set_color_scale(*thing.color_scale)
    for lamp in described.lamps:
        scene.root.attach_new_node(own_light(lamp)).set_pos_hpr(*lamp.place, *lamp.turn)
    if described.film is None:
        lens = PerspectiveLens(fov=50.0, near=1.0, far=100.0)
    else:
        lens = OrthographicLens(film_size=described.film, near=1.0, far=100.0)
    scene.camera_node.lens = lens
    return scene


def own_material(thing: Thing) -> Material:
    given = thing.material or {}
    diffuse = given.get("diffuse", (1.0, 1.0, 1.0))
    texture = None
    if thing.texture:
        texture = Texture(pixels_of_texture(), minfilter="linear", magfilter="linear")
    return Material(
        base_color=diffuse if len(diffuse) == 4 else (*diffuse, 1.0),
        texture=texture,
        alpha_mode="blend" if thing.blended else "opaque",
        double_sided=thing.two_sided,
        unlit=thing.unlit,
        ambient=given.get("ambient"),
        emission=given.get("emission", (0.0, 0.0, 0.0)),
        specular=given.get("specular", (0.0, 0.0, 0.0)),
        shininess=given.get("shininess", 0.0),
        local_viewer=given.get("local", False),
    )


def own_light(lamp: Lamp):
    made = {"ambient": AmbientLight, "directional": DirectionalLight, "point": PointLight, "spot": Spotlight}
    light = made[lamp.kind](lamp.kind, lamp.color)
    if lamp.kind in ("point", "spot"):
        light.set_attenuation(lamp.attenuation)
    if lamp.kind == "spot":
        light.set_exponent(lamp.exponent)
        light.get_lens().set_fov(lamp.fov)
    return light


# --- Panda3D's ---


def theirs(name: str) -> tuple[core.NodePath, core.NodePath]:
    """The same scene of Panda3D's nodes: its root and its camera."""
    described, root = DESCRIPTIONS[name], core.NodePath("render")
    for thing in described.things:
        path = root.attach_new_node(panda_geom(shape_of(thing)))
        path.set_pos_hpr_scale(thing.place, thing.turn, thing.size)
        if thing.material is not None:
            path.set_material(panda_material(thing.material))
        if thing.color is not None:
            path.set_color(thing.color)
        if thing.texture:
            path.set_texture(panda_texture())
        if thing.color_scale is not None:
            path.set_color_scale(thing.color_scale)
        if thing.blended:
            path.set_transparency(core.TransparencyAttrib.M_alpha)
        if thing.unlit:
            path.set_light_off(1)
        path.set_two_sided(thing.two_sided)
    for lamp in described.lamps:
        path = root.attach_new_node(panda_light(lamp))
        path.set_pos_hpr(lamp.place, lamp.turn)
        root.set_light(path)
    node = core.Camera("camera")
    lens = core.PerspectiveLens() if described.film is None else core.OrthographicLens()
    if described.film is None:
        lens.set_aspect_ratio(4.0 / 3.0)
        lens.set_fov(50.0)
    else:
        lens.set_film_size(*described.film)
    lens.set_near_far(1.0, 100.0)
    node.set_lens(lens)
    return root, root.attach_new_node(node)


def panda_geom(shape: Geom) -> core.GeomNode:
    layout = core.GeomVertexFormat.get_v3n3t2()
    if shape.colors is not None:
        layout = core.GeomVertexFormat.get_v3n3c4t2()
    data = core.GeomVertexData("shape", layout, core.Geom.UH_static)
    data.set_num_rows(len(shape.vertices))
    columns = {"vertex": shape.vertices, "normal": shape.normals, "texcoord": shape.texcoords}
    if shape.colors is not None:
        columns["color"] = np.concatenate([shape.colors, np.ones((len(shape.colors), 1))], axis=1)
    for column, values in columns.items():
        writer = core.GeomVertexWriter(data, column)
        for value in values.tolist():
            getattr(writer, f"set_data{len(value)}")(*value)
    triangles = core.GeomTriangles(core.Geom.UH_static)
    for corners in shape.triangles.tolist():
        triangles.add_vertices(*corners)
    geom = core.Geom(data)
    geom.add_primitive(triangles)
    node = core.GeomNode("thing")
    node.add_geom(geom)
    return node


def panda_material(given: dict) -> core.Material:
    made = core.Material()
    for name, value in given.items():
        color = isinstance(value, tuple)
        getattr(made, f"set_{name}")((*value, 1.0)[:4] if color else value)
    return made


def panda_texture() -> core.Texture:
    made = core.Texture("noise")
    made.setup_2d_texture(8, 8, core.Texture.T_unsigned_byte, core.Texture.F_rgba)
    made.set_ram_image_as(pixels_of_texture()[::-1].tobytes(), "RGBA")
    made.set_minfilter(core.SamplerState.FT_linear)
    made.set_magfilter(core.SamplerState.FT_linear)
    return made


def panda_light(lamp: Lamp):
    kinds = {
        "ambient": core.AmbientLight,
        "directional": core.DirectionalLight,
        "point": core.PointLight,
        "spot": core.Spotlight,
    }
    light = kinds[lamp.kind](lamp.kind)
    light.set_color((*lamp.color, 1.0))
    if lamp.kind in ("point", "spot"):
        light.set_attenuation(lamp.attenuation)
    if lamp.kind == "spot":
        light.set_exponent(lamp.exponent)
        light.get_lens().set_fov(lamp.fov)
    return light

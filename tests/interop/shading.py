"""Scenes of metallic-roughness things under lights, and what their pixels show, for pyrender's twin."""

from __future__ import annotations

import math

import numpy as np
import trimesh

from firefly_sample.plan.view import camera_matrices
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.srgb import srgb_to_linear
from tests.interop.oracle import edges
from tests.interop.pyrender_twin import Lamp, Lighting, Surface
from tests.interop.scenes import box
from tests.scenes import ball, geom_node

METALNESS = (0.0, 0.3, 1.0)
ROUGHNESS = (0.1, 0.25, 0.5, 1.0)


def flat_box() -> Geom:
    """A box whose faces are flat: its corners are not shared."""
    shared = box()
    return Geom(shared.vertices[shared.triangles].reshape(-1, 3), np.arange(36).reshape(12, 3), name="box")


def ring() -> Geom:
    """A mesh with smooth normals that is neither convex nor a ball."""
    mesh = trimesh.creation.torus(0.6, 0.3, major_sections=48, minor_sections=24)
    return Geom(mesh.vertices, mesh.faces, normals=mesh.vertex_normals, name="ring")


def things(look=None, colors=None) -> Scene:
    """Twelve things, by metalness and roughness, 10 units before the camera, which sees them whole.

    `look` gives other keywords of the `Material` of thing `index`, and `colors` its one vertex colour.
    """
    scene = Scene()
    shapes = ball(0.8, 4), flat_box(), ring()
    rng = np.random.default_rng(7)
    for index in range(12):
        row, column = divmod(index, 4)
        factors = {
            "base_color": (*rng.uniform(0.1, 1.0, 3), 1.0),
            "metallic": METALNESS[row],
            "roughness": ROUGHNESS[column],
        }
        material = Material(f"look {index}", **factors | (look(index) if look else {}))
        shape = shapes[(row + column) % 3]
        if colors is not None:
            shape = Geom(
                shape.vertices,
                shape.triangles,
                shape.normals,
                colors=np.tile(colors(index), (len(shape.vertices), 1)),
            )
        path = scene.root.attach_new_node(geom_node(f"thing {index}", shape, material))
        path.set_pos(2.0 * column - 3.0, 10.0, 2.0 * row - 2.0)
        path.set_hpr(*rng.uniform(-180, 180, 3))
    scene.camera_node.lens = PerspectiveLens(vfov=36.0, aspect_ratio=4 / 3, near=1.0, far=40.0)
    return scene


def add_lights(scene: Scene, suns=0, lamps=0, spots=0, end=math.inf) -> Scene:
    """Lights of each kind, at most four, from a fixed seed, all in front of the things."""
    rng = np.random.default_rng(11)
    for index in range(suns):
        sun = DirectionalLight(f"sun {index}", rng.uniform(0.1, 0.5, 3))
        x, z = rng.uniform(-0.8, 0.8, 2)
        sun.set_direction((x, 1.0, z))
        scene.root.attach_new_node(sun)
    for index in range(lamps):
        lamp = PointLight(f"lamp {index}", rng.uniform(2.0, 6.0, 3))
        lamp.set_attenuation((0, 0, 1))
        lamp.set_max_distance(end)
        scene.root.attach_new_node(lamp).set_pos(*rng.uniform((-3, 5, -2), (3, 8, 2)))
    for index in range(spots):
        spot = Spotlight(f"spot {index}", rng.uniform(6.0, 14.0, 3))
        spot.set_attenuation((0, 0, 1))
        spot.set_cone(*sorted(rng.uniform(15.0, 40.0, 2)))
        path = scene.root.attach_new_node(spot)
        path.set_pos(*rng.uniform((-3, 3, -2), (3, 6, 2)))
        path.look_at(*rng.uniform((-1, 10, -1), (1, 10, 1)))
    return scene


def lighting_of(scene: Scene) -> Lighting:
    """A scene's lights in view space; an intensity is pi times a colour here, as surfaces reflect c / pi."""
    to_view = camera_matrices(scene).world_to_view
    lighting = Lighting()
    for path in scene.root.find_all_matches("**"):
        node, net = path.node(), path.get_net_mat() @ to_view
        if isinstance(node, AmbientLight):
            lighting.ambient = lighting.ambient + node.get_color()
        elif isinstance(node, DirectionalLight):
            direction = node.get_direction() @ net[:3, :3]
            lighting.lamps.append(Lamp(math.pi * node.get_color(), direction=_unit(direction)))
        elif isinstance(node, PointLight | Spotlight):
            spot = isinstance(node, Spotlight)
            lighting.lamps.append(
                Lamp(
                    math.pi * node.get_color(),
                    position=net[3, :3],
                    direction=_unit(net[1, :3]) if spot else None,
                    cone=tuple(np.radians(node.get_cone()[:2])) if spot else None,
                    end=node.get_max_distance(),
                )
            )
    return lighting


def seen(scene: Scene, frame, eye: bool) -> tuple[np.ndarray, Surface]:
    """Which pixels are inside the silhouettes, shape (h, w), and what is seen in them.

    Textures must be of one colour each, and Geoms of one vertex colour. `eye` has the rays meet in the
    camera's position, whatever the lens.
    """
    inside = (frame.id >= 0) & ~edges(np.where(frame.id >= 0, 1.0 / frame.depth.astype(np.float64), 0.0))
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        inside &= np.roll(frame.id, step, axis) == frame.id
    position, normal = (getattr(frame, name)[inside].astype(np.float64) for name in ("position", "normal"))
    parallel = not scene.lens.constants().perspective and not eye
    to_eye = np.broadcast_to((0.0, -1.0, 0.0), position.shape) if parallel else _unit(-position)
    table = [_constants(scene, name) for name in frame.id_names]
    rows = {key: np.array([row[key] for row in table])[frame.id[inside]] for key in table[0]}
    return inside, Surface(position, _unit(normal), to_eye, **rows)


def _constants(scene: Scene, id_name: str) -> dict:
    node = scene.root.find(id_name.partition("/")[2]).node()
    assert isinstance(node, GeomNode)
    ((geom, material),) = node.geoms
    stored = _texel(material.metallic_roughness_texture)
    return {
        "base": material.base_color[:3] * srgb_to_linear(_texel(material.texture)[:3]),
        "metallic": material.metallic * stored[2],
        "roughness": material.roughness * stored[1],
        "emission": material.emission * srgb_to_linear(_texel(material.emission_texture)[:3]),
        "tint": np.ones(3) if geom.colors is None else geom.colors[0],
        "occlusion": _texel(material.occlusion_texture)[0],
    }


def _texel(texture) -> np.ndarray:
    return np.ones(4) if texture is None else texture.pixels[0, 0] / 255.0


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)

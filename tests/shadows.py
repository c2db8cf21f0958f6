"""Small scenes that cast shadows, and where their edges are exactly."""

from __future__ import annotations

from itertools import product

import numpy as np

from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from tests.scenes import ball, geom_node, unit, wall

KINDS = ("sun", "spot", "point")


def box(extents=(1.0, 1.0, 1.0)):
    """A box around the origin with flat sides."""
    corners = np.array(list(product((-0.5, 0.5), repeat=3))) * extents
    triangles = "130 410 032 240 173 514 571 372 642 276 654 756"
    vertices = corners[[int(corner) for triangle in triangles.split() for corner in triangle]]
    a, b, c = vertices.reshape(-1, 3, 3).swapaxes(0, 1)
    normals = np.repeat(unit(np.cross(b - a, c - a)), 3, axis=0)
    return Geom(vertices, np.arange(36).reshape(-1, 3), normals, name="box")


def light_of(kind):
    """A light that reaches everything; it shines along its node's +Y axis."""
    if kind == "sun":
        light = DirectionalLight("light")
    elif kind == "spot":
        light = Spotlight("light")
        light.set_cone(40, 45)
        light.set_attenuation((1, 0, 0))
    else:
        light = PointLight("light")
    return light


def shadowed_scene(kind, place, resolution=256, thing="box", target=(0.0, 0.0, 0.0), eye=(0.0, -9.0, 7.0)):
    """A box (or a ball) on a floor, a light at a place that casts shadows, a camera that sees all of it."""
    scene = Scene()
    floor = scene.root.attach_new_node(geom_node("floor", wall(14.0, 14), Material("floor")))
    floor.set_p(-90)
    geom = box((1.6, 1.2, 2.0)) if thing == "box" else ball(1.0, 4)
    standing = scene.root.attach_new_node(geom_node(thing, geom, Material(thing)))
    standing.set_pos(0, 0, 1)
    standing.set_h(25)
    light = light_of(kind)
    light.set_shadow_caster(True, resolution)
    path = scene.root.attach_new_node(light)
    path.set_pos(*place)
    path.look_at(*target)
    scene.camera.set_pos(*eye)
    scene.camera.look_at(0, 0, 0.5)
    scene.camera.node().lens = PerspectiveLens(vfov=50, near=0.5, far=60)
    return scene


def map_coordinates(shadow_map, places):
    """Texels across and up in a map, and distances along its axis, of world-space places (n, 3)."""
    q = places @ shadow_map.world_to_light[:3, :3] + shadow_map.world_to_light[3, :3]
    lens = shadow_map.lens
    w = q[:, 1] if lens.perspective else np.ones(len(q))
    scale = np.array([lens.a, lens.c]) * shadow_map.tile.size / 2.0
    w = np.where(w == 0, np.nan, w)
    return q[:, [0, 2]] / w[:, None] * scale + shadow_map.tile.size / 2.0, q[:, 1]


def outside_hull(points, corners):
    """Distance of points (n, 2) from the convex hull of corners (m, 2): above 0 outside, below 0 inside."""
    hull = _hull(corners)
    after = np.roll(hull, -1, axis=0)
    edge = after - hull
    length = np.linalg.norm(edge, axis=1)
    normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / length[:, None]
    signed = np.einsum("nij,ij->ni", points[:, None] - hull[None], normal)
    inside = signed.max(axis=1)
    t = np.clip(np.einsum("nij,ij->ni", points[:, None] - hull[None], edge) / length**2, 0, 1)
    nearest = hull[None] + t[..., None] * edge[None]
    away = np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)
    return np.where(inside > 0, away, -away)


def _hull(points):
    """Convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(map(tuple, points))

    def half(sequence):
        chain = []
        for p in sequence:
            while len(chain) >= 2 and _turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        return chain[:-1]

    return np.array(half(ordered) + half(ordered[::-1]))


def _turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def occluded(places, to_light, distances, triangles, chunk=1000):
    """Which of n places have a triangle (m, 3, 3) between them and the light; Moeller and Trumbore, 1997.

    Where a ray begins is not counted: hits nearer than 1e-6 are the surface itself. Their triple products
    are sums of what depends on the ray times what depends on the triangle: matrix products.
    """
    a, edge1, edge2 = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(edge1, edge2)
    offset = np.einsum("mi,mi->m", a, normal)
    of_u = np.hstack([np.cross(a, edge2), edge2]).T
    of_v = np.hstack([np.cross(edge1, a), -edge1]).T
    result = np.zeros(len(places), dtype=bool)
    for first in range(0, len(places), chunk):
        rows = slice(first, first + chunk)
        d, p = to_light[rows], places[rows]
        ray = np.hstack([d, np.cross(p, d)])
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = -1.0 / (d @ normal.T)
            u, v, t = (ray @ of_u) * inverse, (ray @ of_v) * inverse, (p @ normal.T - offset) * inverse
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6) & (t < distances[rows, None] - 1e-6)
        result[rows] = (hit & np.isfinite(inverse)).any(axis=1)
    return result


def world_triangles(scene):
    """All triangles of a scene in world space, (m, 3, 3)."""
    parts = []
    for path in scene.root.find_all_matches("**/+GeomNode"):
        matrix = path.get_net_transform().get_mat()
        for geom, _ in path.node().geoms:
            moved = geom.vertices @ matrix[:3, :3] + matrix[3, :3]
            parts.append(moved[geom.triangles])
    return np.concatenate(parts)


def silhouette(center, radius, light, directional, target):
    """Points on the circle where a ball's lit side ends, as seen from a light, world space."""
    away = (light - np.array(target, dtype=float)) if directional else light - center
    distance = np.linalg.norm(away)
    axis = away / distance
    share = 0.0 if directional else radius / distance
    side = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    side /= np.linalg.norm(side)
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    ring = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(axis, side)
    return center + radius * (share * axis + np.sqrt(1 - share**2) * ring)

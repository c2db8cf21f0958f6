"""Things that lie about: a stump with an axe in it, a fallen trunk, rocks."""

from __future__ import annotations

import math

import numpy as np

from builder.branching import curve
from builder.canvas import opaque
from builder.noise import mix, smooth, solid, spectral
from builder.randomness import Random
from builder.surface import Surface, add_grid, add_tube, grid_triangles, unit


def stump(seed, radius=4.6, height=6.2):
    """(bark, cut face) of a felled trunk with spreading roots."""
    random = Random(seed)
    bark, cut = Surface(), Surface()
    heights = np.array([-2.0, -0.6, 0.3, 1.2, 2.4, 4.0, height - 0.25, height])
    path = np.stack([0.02 * heights, 0.0 * heights, heights], axis=1)
    phases = random.units(4) * 2.0 * math.pi

    def outline(z, angle):
        near = np.exp(-np.maximum(z, -0.8) / 1.7)
        roots = 0.5 + 0.5 * np.cos(5.0 * angle + phases[0] + 0.6 * np.sin(angle + phases[1]))
        ribs = 1.0 + 0.03 * np.cos(9.0 * angle + phases[2]) + 0.04 * np.cos(2.0 * angle + phases[3])
        return ribs * (1.0 + near * (0.10 + 0.75 * roots**2))

    radii = np.full(len(heights), radius) - [0, 0, 0, 0, 0, 0, 0, 0.16]
    add_tube(bark, path, radii, 28, (7.0, 14.0), profile=lambda k, angle: outline(heights[k], angle))
    bark.shade(lambda v: 0.45 + 0.55 * smooth(-0.5, 3.0, v[:, 2]))
    # The cut: rings of vertices from the rim in, a little uneven.
    rim = bark.vertices[0].reshape(len(heights), -1, 3)[-1]
    centre = rim[:-1].mean(axis=0)
    steps = np.array([1.0, 0.66, 0.33, 0.02])
    points = centre + (rim - centre) * steps[:, None, None]
    points[..., 2] += 0.10 * solid(points, seed, 2.2) * (1.0 - steps[:, None] ** 4)
    flat = (points - centre)[..., :2] / (1.02 * radius)
    add_grid(cut, points, 0.5 + 0.47 * flat, wrap=True)
    return bark, cut


def axe(top, turn=0.9):
    """An axe whose edge sits in the point `top` of a cut face; its handle rises towards `turn` radians."""
    tool = Surface()
    away = np.array([math.cos(turn), math.sin(turn), 0.0])
    pitch = math.radians(38.0)
    handle = away * math.cos(pitch) + np.array([0.0, 0.0, math.sin(pitch)])
    bite = away * math.sin(pitch) - np.array([0.0, 0.0, math.cos(pitch)])
    flat = np.cross(handle, bite)
    eye = np.asarray(top, float) - bite * 1.75
    _axe_head(tool, eye, handle, bite, flat)
    # An S-shaped handle with an oval section and a swell at its end.
    along = np.array([-0.75, 0.0, 1.2, 3.2, 5.4, 7.4, 8.6, 9.0])
    sway = np.array([0.0, 0.0, 0.05, 0.22, 0.20, -0.12, -0.02, 0.10])
    path = eye + along[:, None] * handle + sway[:, None] * bite
    radii = np.array([0.30, 0.30, 0.29, 0.27, 0.27, 0.29, 0.36, 0.14])
    start = len(tool.vertices)

    def oval(_, angle):
        return 1.0 / np.sqrt(np.cos(angle) ** 2 / 0.72**2 + np.sin(angle) ** 2 / 1.15**2)

    add_tube(tool, path, radii, 8, (1.0, 9.75), profile=oval)
    uv = tool.texcoords[start]
    tool.texcoords[start] = np.stack([0.03 + 0.44 * (uv[:, 0] % 1.0001), 0.02 + 0.96 * uv[:, 1]], axis=1)
    return tool


def _axe_head(tool, eye, handle, bite, flat):
    """Four lofted sides from the poll to the flared edge, and the poll's end."""
    s = np.array([-1.0, -0.35, 0.35, 1.1, 1.75, 2.2])
    low = np.array([-0.55, -0.60, -0.52, -0.62, -1.05, -1.35])
    high = np.array([0.55, 0.58, 0.50, 0.52, 0.80, 1.0])
    thick = np.array([0.42, 0.46, 0.38, 0.22, 0.09, 0.01])
    base = eye + s[:, None] * bite

    def corner(edge, side):
        return base + edge[:, None] * handle + side * thick[:, None] * flat

    quads = (
        (corner(low, 1.0), corner(high, 1.0)),
        (corner(high, -1.0), corner(low, -1.0)),
        (corner(high, 1.0), corner(high, -1.0)),
        (corner(low, -1.0), corner(low, 1.0)),
    )
    u = 0.53 + 0.44 * (s - s[0]) / (s[-1] - s[0])
    for a, b in quads:
        points = np.stack([a, b], axis=1)
        texcoords = np.stack([np.stack([u, 0.2 + 0 * u], 1), np.stack([u, 0.8 + 0 * u], 1)], axis=1)
        _add_facing(tool, points, texcoords, eye)
    end = np.array(
        [[corner(low, 1.0)[0], corner(high, 1.0)[0]], [corner(low, -1.0)[0], corner(high, -1.0)[0]]]
    )
    _add_facing(tool, end, np.array([[[0.53, 0.3], [0.53, 0.7]], [[0.56, 0.3], [0.56, 0.7]]]), eye)


def _add_facing(surface, points, texcoords, centre):
    """A grid whose front is the side away from `centre`."""
    normal = np.cross(points[0, 1] - points[0, 0], points[1, 0] - points[0, 0])
    if np.dot(normal, points.mean(axis=(0, 1)) - centre) < 0.0:
        points, texcoords = points[:, ::-1], texcoords[:, ::-1]
    add_grid(surface, points, texcoords)


def axe_texture(seed, size=512):
    """Left half: ash wood along v. Right half: forged steel, its ground edge at the right."""
    v, u = (np.mgrid[0:size, 0:size] + 0.5) / size
    grain = spectral((size, size), seed, (2, 60), 0.7, (0.06, 1.0))
    wood = mix((0.36, 0.22, 0.10), (0.22, 0.12, 0.05), smooth(-1.0, 1.6, grain))
    wood = wood * (0.72 + 0.28 * smooth(0.0, 0.35, v) * smooth(1.0, 0.85, v))[..., None]
    rough = spectral((size, size), seed + 1, (2, 40), 0.8)
    steel = mix((0.11, 0.11, 0.115), (0.17, 0.165, 0.16), smooth(-1.2, 1.2, rough))
    rust = smooth(0.5, 1.8, spectral((size, size), seed + 2, (10, 200), 1.0))
    steel = mix(steel, (0.16, 0.075, 0.035), 0.75 * rust)
    edge = smooth(0.86, 0.885, u + 0.006 * rough)
    steel = mix(steel, np.array((0.46, 0.47, 0.48)), edge * (1.0 - 0.3 * rust))
    return opaque(np.where((u < 0.5)[..., None], wood, steel))


def fallen_trunk(seed, length=46.0, radius=2.5):
    """(bark, cut faces) of a trunk on the ground along +X, with broken limbs."""
    random = Random(seed)
    bark, cut = Surface(), Surface()
    path = curve(random, (-length / 2.0, 0.0, 0.62 * radius), (1.0, 0.0, 0.0), length, 9, 0.03, -0.01)
    path[:, 2] = 0.62 * radius + 0.25 * (path[:, 2] - path[:, 2].mean())
    radii = np.linspace(radius, 0.66 * radius, 10)
    phase = random.units(1)[0] * 6.28
    add_tube(
        bark,
        path,
        radii,
        13,
        (7.0, 14.0),
        profile=lambda k, a: 1.0 + 0.05 * np.cos(3.0 * a + phase + 0.4 * k),
    )
    rings = bark.vertices[0].reshape(10, -1, 3)
    for rim in (rings[0][::-1], rings[-1]):
        centre = rim[:-1].mean(axis=0)
        steps = np.array([1.0, 0.5, 0.02])
        points = centre + (rim - centre) * steps[:, None, None]
        spin = np.linspace(0.0, 2.0 * math.pi, rim.shape[0])
        disc = np.stack([np.cos(spin), np.sin(spin)], axis=1)
        add_grid(cut, points, 0.5 + 0.45 * steps[:, None, None] * disc, wrap=True)
    for k in range(4):
        t = 0.3 + 0.18 * k
        point = path[round(t * 9)]
        side = unit(np.array([0.5, (-1.0) ** k, 0.5 + 0.4 * random.units(1)[0]]))
        reach = random.between(2.5, 7.0)
        limb = curve(random, point, side, reach, 3, 0.2, 0.2)
        add_tube(bark, limb, np.linspace(0.55, 0.16, 4), 5, (5.0, 10.0), offset=random.units(1)[0])
    bark.shade(lambda v: 0.38 + 0.62 * smooth(-0.6, 2.2, v[:, 2]))
    return bark, cut


_FACES = (
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
)


def rock(seed, size=(6.0, 5.0, 4.0), steps=6, pixels=128):
    """(surface, texture) of a rock: a sphere cut by planes and roughened, under a texture of its own."""
    random = Random(seed)
    planes = np.array([random.direction() for _ in range(11)])
    depths = 0.72 + 0.24 * random.units(11)

    def shape(direction):
        along = direction @ planes.T
        cut = np.min(np.where(along > 0.05, depths / np.maximum(along, 0.05), 9.0), axis=-1)
        r = np.minimum(cut, 1.05)
        r = r * (1.0 + 0.10 * solid(direction, seed, 0.55) + 0.04 * solid(direction, seed + 1, 0.2))
        return direction * r[..., None] * np.asarray(size)

    surface = Surface()
    # Cells of the atlas: 4 x 2, six in use; the faces go on beyond their edges by a margin for the mipmaps.
    margin = 0.06
    texture = np.full((2 * pixels, 4 * pixels, 3), 0.12)
    for k, (axis, right, up) in enumerate(np.asarray(_FACES, float)):
        column, row = k % 3, k // 3
        s = np.tan(np.linspace(-1.0, 1.0, steps + 1) * math.pi / 4.0)
        a, b = np.meshgrid(s, s)
        points = shape(unit(axis + a[..., None] * right + b[..., None] * up))
        uv = 0.5 + 0.5 * np.stack([a, b], axis=-1) * (1.0 - 2.0 * margin)
        uv = (uv + np.array([column, 1 - row])) / [4.0, 2.0]
        normals = _rock_normals(shape, axis, right, up, a, b)
        surface.add(points.reshape(-1, 3), normals, uv.reshape(-1, 2), grid_triangles(steps + 1, steps + 1))
        t = ((np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0) / (1.0 - 2.0 * margin)
        a, b = np.meshgrid(t, -t)
        direction = unit(axis + a[..., None] * right + b[..., None] * up)
        up_facing = _rock_normals(shape, axis, right, up, a, b)[:, 2].reshape(pixels, pixels)
        where = (slice(row * pixels, (row + 1) * pixels), slice(column * pixels, (column + 1) * pixels))
        texture[where] = _rock_color(direction, up_facing, seed)
    surface.shade(lambda v: 0.4 + 0.6 * smooth(-0.4 * size[2], 0.25 * size[2], v[:, 2]))
    return surface, opaque(texture)


def _rock_normals(shape, axis, right, up, a, b, step=0.02):
    def at(da, db):
        return shape(unit(axis + (a + da)[..., None] * right + (b + db)[..., None] * up))

    return unit(np.cross(at(step, 0.0) - at(-step, 0.0), at(0.0, step) - at(0.0, -step))).reshape(-1, 3)


def _rock_color(direction, up_facing, seed):
    rough = solid(direction, seed + 2, 0.09) + 0.6 * solid(direction, seed + 3, 0.035)
    rough = rough + 0.35 * solid(direction, seed + 7, 0.017)
    broad = solid(direction, seed + 4, 0.6) + 0.5 * solid(direction, seed + 8, 0.25)
    color = mix((0.115, 0.11, 0.10), (0.20, 0.185, 0.165), smooth(-0.9, 0.9, broad))
    color = color * np.clip(1.0 + 0.24 * rough, 0.4, 1.7)[..., None]
    vein = np.abs(solid(direction, seed + 5, 0.32) + 0.15 * rough)
    color = mix(color, color * 0.4, smooth(0.05, 0.01, vein))
    lichen = smooth(0.45, 0.75, solid(direction, seed + 6, 0.2) + 0.35 * rough)
    color = mix(color, (0.22, 0.235, 0.15), 0.7 * lichen)
    moss = smooth(0.35, 0.85, up_facing + 0.35 * broad + 0.18 * rough)
    return mix(
        color, np.array((0.055, 0.095, 0.02)) * np.clip(1.0 + 0.4 * rough, 0.5, 1.6)[..., None], 0.92 * moss
    )


def mushroom_texture(seed, cap, spots=0, rim=None, size=512):
    """Cap disc on the left, gills upper right, stem lower right: the layout of `plants.mushrooms`."""
    random = Random(seed)
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    v, u = 1.0 - y, x
    fine = spectral((size, size), seed, (2, 20), 0.5)
    picture = np.broadcast_to(np.asarray(cap, float), (size, size, 3)).copy()
    r = np.hypot(u - 0.25, v - 0.5) / 0.24
    picture = mix(picture, np.asarray(cap if rim is None else rim, float), smooth(0.45, 1.0, r))
    picture = picture * np.clip(1.0 + 0.10 * fine, 0.6, 1.4)[..., None]
    placed = []
    while len(placed) < spots:
        a, d, reach = (
            6.2832 * random.units(1)[0],
            0.95 * random.units(1)[0] ** 0.5,
            random.between(0.012, 0.03),
        )
        px, py = 0.25 + 0.24 * d * math.cos(a), 0.5 + 0.24 * d * math.sin(a)
        if all(math.hypot(px - qx, py - qy) > 1.15 * (reach + other) for qx, qy, other in placed):
            placed.append((px, py, reach))
            dist = np.hypot(u - px, v - py) / reach + 0.12 * fine
            picture = mix(picture, np.array((0.62, 0.57, 0.47)), smooth(1.0, 0.75, dist))
    angle = np.arctan2(v - 0.75, u - 0.75)
    gills = 0.5 + 0.5 * np.cos(angle * 46.0)
    right = mix((0.50, 0.43, 0.31), (0.28, 0.22, 0.14), gills)
    fibre = spectral((size, size), seed + 1, (2, 60), 0.6, (0.1, 1.0))
    stem = np.array((0.50, 0.44, 0.33)) * np.clip(1.0 + 0.14 * fine + 0.10 * fibre, 0.5, 1.4)[..., None]
    right = np.where((v > 0.48)[..., None], right, stem)
    return opaque(np.where((u > 0.505)[..., None], right, picture))

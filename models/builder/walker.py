"""A walker: a figure in a jumper, a cap and boots, whose skin thirteen joints move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from gltf_writer import Gltf, y_up

from builder.gait import HIP, PELVIS, SECONDS, SHIN, THIGH, quaternions, walk
from builder.noise import smooth
from builder.rounding import rounded
from builder.solids import arc, ball, join, lathe, shaded

SIZE = 2.0
"""Metres of the unit in which positions are written, as shorts."""
ELBOW, WRIST = 0.26, 0.49
"""How far down an arm they are."""
SHOULDER = np.array((0.178, 0.0, 1.355))
ARM = np.array((np.sin(np.radians(11.0)), 0.0, -np.cos(np.radians(11.0))))
"""The way down the left arm at rest."""

JUMPER, RIB = (0.66, 0.135, 0.055), (0.50, 0.09, 0.04)
TROUSERS, TURN_UP = (0.035, 0.075, 0.16), (0.09, 0.16, 0.28)
BOOT, SOLE = (0.16, 0.066, 0.026), (0.035, 0.024, 0.018)
SKIN, CHEEK = (0.80, 0.47, 0.31), (0.78, 0.30, 0.21)
CAP, BRIM, POMPON = (0.045, 0.24, 0.24), (0.07, 0.33, 0.31), (0.86, 0.72, 0.42)
SCARF, STRIPE = (0.84, 0.55, 0.10), (0.86, 0.74, 0.48)
EYE, HAIR = (0.012, 0.010, 0.012), (0.13, 0.050, 0.018)


def joints():
    """Each joint's parent and place at rest, parents first."""
    places = {
        "hips": (None, np.array((0.0, 0.0, PELVIS))),
        "spine": ("hips", np.array((0.0, 0.01, 1.03))),
        "head": ("spine", np.array((0.0, 0.0, 1.46))),
    }
    for name, side in (("left", 1.0), ("right", -1.0)):
        mirror = np.array((side, 1.0, 1.0))
        hip = np.array((HIP[0], 0.0, HIP[1])) * mirror
        places |= {
            f"{name} thigh": ("hips", hip),
            f"{name} shin": (f"{name} thigh", hip - (0.0, 0.0, THIGH)),
            f"{name} foot": (f"{name} shin", hip - (0.0, 0.0, THIGH + SHIN)),
            f"{name} arm": ("spine", SHOULDER * mirror),
            f"{name} forearm": (f"{name} arm", (SHOULDER + ELBOW * ARM) * mirror),
        }
    return places


def walker():
    """The file."""
    gltf = Gltf()
    places = joints()
    names = list(places)
    figure = gltf.node("walker")
    nodes = {}
    for name, (parent, place) in places.items():
        offset = place - (0.0 if parent is None else places[parent][1])
        nodes[name] = gltf.node(
            name, figure if parent is None else nodes[parent], translation=rounded(y_up(offset), 6)
        )
    inverse = np.tile(np.eye(4), (len(names), 1, 1))
    inverse[:, :3, :3] *= SIZE  # positions are in units of it, and no node's scale moves a skin
    inverse[:, 3, :3] = [-y_up(places[name][1]) for name in names]
    skin = gltf.skin([nodes[name] for name in names], inverse, "walker", skeleton=nodes["hips"])
    mesh = gltf.mesh([_primitive(gltf, names)], "walker")
    gltf.node("body", figure, mesh=mesh, skin=skin)
    gltf.animation(_channels(nodes), "walk")
    return gltf


def _channels(nodes):
    phases, poses = walk()
    times = phases * SECONDS
    at = poses.pop("hips at")
    channels = [(nodes["hips"], "translation", times, rounded(y_up(at), 5))]
    for name, matrices in poses.items():
        quats = quaternions(matrices)
        turned = np.concatenate([y_up(quats[:, 1:]), quats[:, :1]], axis=1)
        channels.append((nodes[name], "rotation", times, rounded(turned, 6)))
    return channels


def _primitive(gltf, names):
    """All pieces as one primitive, in shorts and bytes (KHR_mesh_quantization)."""
    rows, triangles, count = [], [], 0
    for part, weigh in _pieces():
        points, normals, _, colors, faces = shaded(replace(part, texcoords=0.0 * part.texcoords), 75.0)
        indices, weights = _influences(weigh(points), names)
        rows.append((points, normals, colors, indices, weights))
        triangles.append(faces + count)
        count += len(points)
    points, normals, colors, indices, weights = (np.concatenate(column) for column in zip(*rows, strict=True))
    gltf.use("KHR_mesh_quantization", required=True)
    return gltf.primitive(
        rounded(y_up(points) / SIZE * 32767.0).astype(np.int16),
        np.concatenate(triangles),
        material=gltf.material("wool and leather", (1.0, 1.0, 1.0, 1.0), roughness=0.75),
        NORMAL=rounded(y_up(normals) * 127.0).astype(np.int8),
        COLOR_0=np.concatenate(
            [rounded(np.clip(colors, 0.0, 1.0) * 255.0), np.full((count, 1), 255.0)], axis=1
        ).astype(np.uint8),
        JOINTS_0=indices.astype(np.uint8),
        WEIGHTS_0=weights.astype(np.uint8),
    )


def _influences(shares, names):
    """The four joints that count most for each vertex, and their weights in bytes, whose sum is 255."""
    table = np.stack([np.broadcast_to(shares.get(name, 0.0), _size(shares)) for name in names], axis=1)
    indices = np.argsort(-rounded(table, 9), axis=1, kind="stable")[:, :4]
    weights = np.take_along_axis(table, indices, axis=1)
    codes = rounded(weights / weights.sum(axis=1, keepdims=True) * 255.0)
    codes[:, 0] += 255.0 - codes.sum(axis=1)
    return np.where(codes > 0.0, indices, 0), codes


def _size(shares):
    return max((np.shape(share) for share in shares.values()), default=(1,))


# --- Pieces: each with a function that gives its points' weights by joint


def _pieces():
    yield _jumper(), _spine_weights
    yield _seat(), lambda p: {"hips": np.ones(len(p))}
    yield _scarf(), lambda p: {"spine": np.full(len(p), 0.75), "head": np.full(len(p), 0.25)}
    yield _head(), lambda p: {"head": np.ones(len(p))}
    for name, side in (("left", 1.0), ("right", -1.0)):
        for part, weigh in _limbs(name):
            yield (part if side > 0.0 else _mirrored(part)), _on_side(weigh, side)


def _on_side(weigh, side):
    return lambda p: weigh(p * (side, 1.0, 1.0))


def _mirrored(part):
    return part.bent(lambda p: p * (-1.0, 1.0, 1.0)).flipped()


def _spine_weights(p):
    upper = smooth(0.94, 1.12, p[:, 2])
    return {"hips": 1.0 - upper, "spine": upper}


def _jumper():
    rib = [(0.150, 0.838), (0.173, 0.850), (0.176, 0.885)]
    low = [(0.176, 0.885), (0.173, 0.97), (0.170, 1.05), (0.178, 1.14)]
    stripe = [(0.178, 1.14), (0.186, 1.25)]
    high = [(0.186, 1.25), (0.186, 1.33), (0.166, 1.385), (0.070, 1.448)]
    colors = (RIB, JUMPER, STRIPE, JUMPER)
    bands = (
        lathe(band, 13).painted(color) for band, color in zip((rib, low, stripe, high), colors, strict=True)
    )
    return join(*bands).scaled(1.0, 0.72, 1.0).bent(_belly)


def _belly(p):
    """The front is a little rounder than the back."""
    depth = np.where(p[:, 1] < 0.0, 1.08, 0.96)
    return p * np.stack([np.ones(len(p)), depth, np.ones(len(p))], axis=1)


def _seat():
    profile = [(0.0, 0.775), (0.090, 0.788), (0.145, 0.825), (0.160, 0.87)]
    return lathe(profile, 10).scaled(1.0, 0.76, 1.0).painted(TROUSERS)


def _scarf():
    ring = arc((0.098, 0.0), 0.040, -90.0, 150.0, 5)
    part = lathe(ring * (1.0, 1.15), 12).scaled(1.0, 0.92, 1.0)
    return part.turned((1, 0, 0), 6.0).moved(z=1.448).painted(SCARF)


def _head():
    skull = lathe(arc((0.0, 0.0), 0.128, -65.0, 40.0, 6), 13).scaled(1.0, 0.98, 1.10)

    def paint(p):
        cheeks = sum(
            smooth(0.055, 0.012, np.linalg.norm(p - (side * 0.066, -0.098, -0.040), axis=1))
            for side in (1.0, -1.0)
        )
        back = (p[:, 1] > 0.035) & (p[:, 2] > -0.085)
        face = np.asarray(SKIN) + (np.asarray(CHEEK) - SKIN) * cheeks[:, None]
        return np.where(back[:, None], HAIR, face)

    dome = [(0.137, 0.050), (0.134, 0.090), (0.108, 0.141), (0.062, 0.170), (0.0, 0.180)]
    cap = join(
        lathe(dome, 13).painted(CAP),
        lathe(arc((0.132, 0.040), 0.024, -110.0, 130.0, 5), 13).painted(BRIM),
        ball(0.036, 4, 7).moved(z=0.196).painted(POMPON),
    ).turned((1, 0, 0), -9.0)
    small = [ball(0.019, 4, 7).scaled(1.0, 1.1, 0.9).moved(0.0, -0.130, -0.022).painted(CHEEK)]
    for side in (1.0, -1.0):
        small += [
            ball(0.0155, 4, 6).scaled(0.85, 0.6, 1.25).moved(side * 0.046, -0.117, 0.012).painted(EYE),
            ball(0.026, 3, 5).scaled(0.55, 0.9, 1.2).moved(side * 0.126, 0.004, -0.012).painted(SKIN),
        ]
    return join(skull.painted(paint), cap, *small).moved(z=1.612)


def _limbs(name):
    """The left limbs; those of the other side are their mirror images."""
    hip, knee = HIP[1], HIP[1] - THIGH

    def leg_weights(p):
        upper, lower = smooth(hip - 0.10, hip + 0.01, p[:, 2]), smooth(knee + 0.065, knee - 0.065, p[:, 2])
        return {"hips": upper, f"{name} thigh": (1.0 - upper) * (1.0 - lower), f"{name} shin": lower}

    def foot_weights(p):
        shaft = smooth(0.10, 0.17, p[:, 2])
        return {f"{name} foot": 1.0 - shaft, f"{name} shin": shaft}

    def arm_weights(p):
        down = (p - SHOULDER) @ ARM
        trunk, lower = smooth(0.05, -0.05, down), smooth(ELBOW - 0.055, ELBOW + 0.055, down)
        return {"spine": trunk, f"{name} arm": (1.0 - trunk) * (1.0 - lower), f"{name} forearm": lower}

    yield _leg(), leg_weights
    yield _boot(), foot_weights
    yield _sleeve(), arm_weights
    yield _hand(), lambda p: {f"{name} forearm": np.ones(len(p))}


def _leg():
    knee = HIP[1] - THIGH
    cuff = [(0.062, 0.165), (0.079, 0.168), (0.081, 0.215), (0.072, 0.222)]
    cloth = [
        (0.072, 0.222), (0.076, 0.38), (0.075, knee - 0.05), (0.077, knee + 0.01), (0.082, knee + 0.06),
        (0.094, 0.72), (0.088, 0.83), (0.060, 0.90),
    ]  # fmt: skip
    part = join(lathe(cuff, 10).painted(TURN_UP), lathe(cloth, 10).painted(TROUSERS))
    return part.bent(lambda p: _calf(p) + p + (HIP[0], 0.0, 0.0))


def _calf(p):
    """The knee stands a little before, the calf behind."""
    z = p[:, 2]
    shift = 0.016 * np.exp(-(((z - 0.36) / 0.09) ** 2)) - 0.010 * np.exp(-(((z - 0.52) / 0.08) ** 2))
    return np.stack([np.zeros(len(p)), shift, np.zeros(len(p))], axis=1)


def _boot():
    shoe = ball(1.0, 6, 10).bent(_shoe).painted(lambda p: np.where((p[:, 2] < 0.02)[:, None], SOLE, BOOT))
    shaft = lathe([(0.054, 0.06), (0.061, 0.16), (0.066, 0.180)], 8)
    return join(shoe, shaft.moved(y=0.008).painted(BOOT)).moved(HIP[0])


def _shoe(p):
    """A ball drawn out to a shoe with a flat sole, its toes broad and lower than its instep."""
    x, y, z = p.T
    ahead = 0.5 - 0.5 * y  # 0 at the heel, 1 at the toes
    wide = 0.052 + 0.014 * smooth(0.3, 0.8, ahead)
    tall = 0.100 - 0.032 * smooth(0.35, 0.85, ahead)
    height = np.maximum(z, -0.55)
    height = (height + 0.55) / 1.55
    return np.stack([x * wide, 0.092 - 0.268 * ahead, height * tall], axis=1)


def _sleeve():
    cuff = [(0.030, WRIST + 0.010), (0.048, WRIST + 0.004), (0.049, WRIST - 0.042), (0.042, WRIST - 0.050)]
    cloth = [
        (0.042, WRIST - 0.050), (0.051, ELBOW + 0.05), (0.052, ELBOW), (0.053, ELBOW - 0.05), (0.059, 0.11),
        (0.062, 0.01), (0.050, -0.035), (0.026, -0.052), (0.0, -0.057),
    ]  # fmt: skip
    part = join(
        *(
            lathe([(radius, -down) for radius, down in profile], 9).painted(color)
            for profile, color in ((cuff, RIB), (cloth, JUMPER))
        )
    )
    return part.turned((0, 1, 0), -11.0).moved(*SHOULDER)


def _hand():
    palm = ball(1.0, 5, 8).scaled(0.030, 0.042, 0.060).moved(z=-WRIST - 0.045)
    thumb = ball(1.0, 3, 5).scaled(0.014, 0.017, 0.034).turned((1, 0, 0), -35.0)
    part = join(palm, thumb.moved(0.0, -0.036, -WRIST - 0.030))
    return part.painted(SKIN).turned((0, 1, 0), -11.0).moved(*SHOULDER)

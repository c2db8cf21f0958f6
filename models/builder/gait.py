"""A walk: the joints' rotations over one cycle of two steps, with feet that do not slide.

The pelvis and the feet are given their courses, and each leg is bent so that it joins them. Z is up, the
figure walks towards -Y, on the spot: the ground passes below it with the speed SPEED. Matrices are for row
vectors; each joint's frame at rest is that of the world.
"""

from __future__ import annotations

import math

import numpy as np

SECONDS = 1.1
"""A cycle: one step with each leg."""
STEP = 0.62
SPEED = 2.0 * STEP / SECONDS
KEYS = 20
THIGH, SHIN, ANKLE = 0.40, 0.41, 0.09
"""Lengths of the bones, and the ankle's height above the sole."""
HEEL, BALL = -0.075, 0.15
"""Where the foot touches the ground when it rolls, before the ankle (+) and behind it (-)."""
HIP = (0.088, 0.90)
"""A hip joint's distance from the middle, and its height in the figure that stands."""
PELVIS = 0.93
STANCE = 0.62
"""The share of a cycle for which a foot is on the ground."""


def walk():
    """Phases (KEYS + 1,) of 0 to 1, and for each joint its rotations to its parent (KEYS + 1, 3, 3).

    "hips" has its place too, as "hips at" (KEYS + 1, 3).
    """
    phases = np.arange(KEYS + 1) / KEYS
    poses = [_pose(phase % 1.0) for phase in phases]
    return phases, {name: np.array([pose[name] for pose in poses]) for name in poses[0]}


def _pose(phase):
    turn = 2.0 * math.pi * phase
    # the left foot lands at phase 0: then the pelvis is lowest, and its left side in front
    sway, bob = 0.022 * math.sin(turn - 0.3), -0.024 * math.cos(2.0 * turn - 0.5)
    at = np.array([sway, 0.0, PELVIS - 0.035 + bob])
    pelvis = rotation(Y, -3.5 * math.sin(turn)) @ rotation(Z, -7.0 * math.cos(turn))
    chest = rotation(X, 5.0) @ rotation(Y, 2.0 * math.sin(turn)) @ rotation(Z, 7.0 * math.cos(turn))
    head = rotation(X, -1.0 + 1.5 * math.cos(2.0 * turn - 1.2)) @ rotation(Z, 1.5 * math.cos(turn))
    pose = {
        "hips": pelvis,
        "hips at": at,
        "spine": chest @ pelvis.T,
        "head": head @ chest.T,
    }
    for side, name, shift in ((1.0, "left", 0.0), (-1.0, "right", 0.5)):
        pose |= _leg(side, name, (phase + shift) % 1.0, at, pelvis)
        pose |= _arm(side, name, 2.0 * math.pi * (phase + shift))
    return pose


def _arm(side, name, turn):
    """An arm swings against the leg of its side, and its elbow bends more when it is in front."""
    forward = -math.cos(turn - 0.15)
    swing = 4.0 + 27.0 * forward
    bend = 24.0 + 16.0 * math.sin(0.5 * math.pi * max(forward, -0.6)) - 4.0 * math.sin(turn)
    return {
        f"{name} arm": rotation(X, -swing) @ rotation(Z, -side * 6.0 * max(forward, 0.0)),
        f"{name} forearm": rotation(X, -bend) @ rotation(Z, -side * 8.0),
    }


def _leg(side, name, phase, at, pelvis):
    ahead, height, pitch = _foot(phase)
    ankle = np.array([side * 0.075, -ahead, height])
    hip = at + np.array([side * HIP[0], 0.0, HIP[1] - PELVIS]) @ pelvis
    reach = ankle - hip
    length = float(np.linalg.norm(reach))
    if length > THIGH + SHIN - 1e-3:
        raise ValueError(f"the leg is too short by {length - THIGH - SHIN} at phase {phase}")
    along = reach / length
    before = _across(np.array([side * 0.12, -1.0, 0.0]), along)  # the knee points a little outwards
    cosine = (THIGH * THIGH + length * length - SHIN * SHIN) / (2.0 * THIGH * length)
    knee = hip + THIGH * (cosine * along + math.sqrt(1.0 - cosine * cosine) * before)
    thigh, shin = _frame(knee - hip, before), _frame(ankle - knee, before)
    foot = rotation(X, -pitch) @ rotation(Z, side * 7.0)
    return {
        f"{name} thigh": thigh @ pelvis.T,
        f"{name} shin": shin @ thigh.T,
        f"{name} foot": foot @ shin.T,
    }


def _foot(phase):
    """How far the ankle is ahead of the pelvis, its height, and how far the toes point up (degrees)."""
    if phase <= STANCE:
        return _on_the_ground(phase)
    # a smooth curve from where the toes leave to where the heel lands, with their velocities
    share = (phase - STANCE) / (1.0 - STANCE)
    step = 1e-4
    start, end = np.array(_on_the_ground(STANCE)), np.array(_on_the_ground(0.0))
    leaving = (start - _on_the_ground(STANCE - step)) / step * (1.0 - STANCE)
    landing = (np.array(_on_the_ground(step)) - end) / step * (1.0 - STANCE)
    t, t2, t3 = share, share**2, share**3
    curve = (
        (2 * t3 - 3 * t2 + 1) * start
        + (t3 - 2 * t2 + t) * leaving
        + (3 * t2 - 2 * t3) * end
        + (t3 - t2) * landing
    )
    ahead, height, pitch = curve.tolist()
    return ahead, height + 0.035 * math.sin(math.pi * share) ** 2, pitch


def _on_the_ground(phase):
    """The same while the foot rolls from its heel over its sole to its ball, which stay where they are."""
    flat = STEP * (0.53 - 2.0 * phase)  # where the ankle were if the sole lay flat
    landing = 20.0 * (1.0 - _ease(phase / 0.12))
    leaving = -58.0 * _ease((phase - 0.34) / (STANCE - 0.34) * 0.82) / _ease(0.82)
    pitch = landing + leaving
    pivot = HEEL if pitch > 0.0 else BALL
    c, s = math.cos(math.radians(pitch)), math.sin(math.radians(pitch))
    # from the pivot to the ankle is (-pivot, ANKLE), turned upwards by the pitch
    return flat + pivot - pivot * c - ANKLE * s, ANKLE * c - pivot * s, pitch


def _ease(share):
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


X, Y, Z = np.eye(3)


def rotation(axis, degrees):
    """The matrix of a turn, counter-clockwise seen from the positive end of a coordinate axis."""
    k = int(np.argmax(axis))
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    made = np.eye(3)
    i, j = (k + 1) % 3, (k + 2) % 3
    made[i, i] = made[j, j] = c
    made[i, j], made[j, i] = s, -s
    return made


def _across(vector, along):
    """The unit vector nearest to `vector` at a right angle to the unit vector `along`."""
    flat = vector - along * (vector @ along)
    return flat / np.linalg.norm(flat)


def _frame(bone, before):
    """The rotation that turns a bone from -Z to `bone`, and its front from -Y towards `before`."""
    up = -bone / np.linalg.norm(bone)
    back = -_across(before, up)
    return np.stack([np.cross(back, up), back, up])


def quaternions(matrices):
    """The unit quaternions (w, x, y, z) of rotations (n, 3, 3), each in the half-space of the one before."""
    found = []
    for m in matrices:
        xx, yy, zz = m[0, 0], m[1, 1], m[2, 2]
        squares = np.maximum(
            np.array([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz]), 0
        )
        quat = np.sqrt(squares) / 2.0
        # all signs follow from the largest component
        products = np.array([
            [quat[0], m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]],
            [m[1, 2] - m[2, 1], quat[1], m[0, 1] + m[1, 0], m[2, 0] + m[0, 2]],
            [m[2, 0] - m[0, 2], m[0, 1] + m[1, 0], quat[2], m[1, 2] + m[2, 1]],
            [m[0, 1] - m[1, 0], m[2, 0] + m[0, 2], m[1, 2] + m[2, 1], quat[3]],
        ])  # fmt: skip
        quat = quat * np.where(products[int(np.argmax(quat))] < 0.0, -1.0, 1.0)
        if found and quat @ found[-1] < 0.0:
            quat = -quat
        found.append(quat / np.linalg.norm(quat))
    return np.array(found)

"""Conventions of space, and the arithmetic of position, rotation, scale and shear.

Stated here once, for the whole package:

- Right-handed, Z up, Y forward, X right. Row vectors: a point p maps to ``p @ M``; a 4x4 matrix has its
  translation in the last row; child to world is ``local @ parent @ ... @ root``. All float64.
- HPR are degrees: heading turns about Z, pitch about X, roll about Y, each counter-clockwise seen from
  the positive end of its axis. Roll acts first, then pitch, then heading: ``R = R_y(r) @ R_x(p) @ R_z(h)``.
- Quaternions are (w, x, y, z), and turn a vector as their matrix does.
- The upper 3x3 of a transform is ``diag(scale) @ shear_matrix @ R`` with shear (xy, xz, yz) in

      [[1,  xy, 0],
       [0,  1,  0],
       [xz, yz, 1]]

These are Panda3D's conventions (manual, "Common State Changes"; the order of shear and the signs that a
decomposition chooses were found by testing its classes).

glTF, and with it pyrender, has Y up; its cameras look and its lights shine along -Z, and its matrices are for
column vectors. One quarter turn about X, (x, y, z) there is (x, -z, y) here, converts points, normals and the
own axes of nodes, cameras and lights alike. It only moves numbers and changes their signs, so nothing is
rounded. The functions that do it are at the end of this module.

Vectors are tuples of floats here: a few multiplications cost less than one NumPy call, and tuples are
immutable.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.scene.arrays import Float64

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
Rows = tuple[Vec3, Vec3, Vec3]
"""A 3x3 matrix, row by row."""

_EPSILON = 2.0**-52


def rows_from_hpr(hpr: Vec3) -> Rows:
    """Return the rotation of (heading, pitch, roll) in degrees; its rows are the turned X, Y and Z axes."""
    h, p, r = map(math.radians, hpr)
    sh, ch = math.sin(h), math.cos(h)
    sp, cp = math.sin(p), math.cos(p)
    sr, cr = math.sin(r), math.cos(r)
    return (
        (cr * ch - sr * sp * sh, cr * sh + sr * sp * ch, -sr * cp),
        (-cp * sh, cp * ch, sp),
        (sr * ch + cr * sp * sh, sr * sh - cr * sp * ch, cr * cp),
    )


def quat_from_hpr(hpr: Vec3) -> Quat:
    """Return the unit quaternion of (heading, pitch, roll) in degrees."""
    h, p, r = (math.radians(angle) * 0.5 for angle in hpr)
    roll = (math.cos(r), 0.0, math.sin(r), 0.0)
    pitch = (math.cos(p), math.sin(p), 0.0, 0.0)
    heading = (math.cos(h), 0.0, 0.0, math.sin(h))
    return multiply_quats(multiply_quats(roll, pitch), heading)


def multiply_quats(first: Quat, second: Quat) -> Quat:
    """Return the rotation by `first`, then by `second` (the order of row vectors)."""
    aw, ax, ay, az = second
    bw, bx, by, bz = first
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def rotate_by_quat(vector: Vec3, quat: Quat) -> Vec3:
    """Return `vector` rotated by a unit quaternion."""
    x, y, z = vector
    row_x, row_y, row_z = rows_from_quat(quat)
    return (
        x * row_x[0] + y * row_y[0] + z * row_z[0],
        x * row_x[1] + y * row_y[1] + z * row_z[1],
        x * row_x[2] + y * row_y[2] + z * row_z[2],
    )


def rows_from_quat(quat: Quat) -> Rows:
    """Return the rotation of a unit quaternion; its rows are the turned axes."""
    w, x, y, z = quat
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )


def quat_from_rows(rows: Rows) -> Quat:
    """Return the quaternion of a rotation, by its largest component (Shepperd, J. Guid. Control, 1978)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rows
    trace = xx + yy + zz
    largest = max(trace, xx, yy, zz)
    if largest == trace:
        quat = (1 + trace, yz - zy, zx - xz, xy - yx)
    elif largest == xx:
        quat = (yz - zy, 1 + xx - yy - zz, xy + yx, zx + xz)
    elif largest == yy:
        quat = (zx - xz, xy + yx, 1 - xx + yy - zz, yz + zy)
    else:
        quat = (xy - yx, zx + xz, yz + zy, 1 - xx - yy + zz)
    length = math.hypot(*quat)
    w, x, y, z = quat
    return (w / length, x / length, y / length, z / length)


def hpr_from_quat(quat: Quat) -> Vec3:
    """Return (heading, pitch, roll) of a unit quaternion in degrees; see `decompose_matrix`."""
    return decompose_matrix(rows_from_quat(quat))[0]


def compose_matrix(pos: Vec3, rotation: Rows, scale: Vec3, shear: Vec3) -> Float64:
    """Return the 4x4 matrix ``diag(scale) @ shear_matrix @ rotation`` with `pos` in its last row."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    sx, sy, sz = scale
    if shear != (0.0, 0.0, 0.0):
        # In this order: the sheared Z needs the plain X and Y.
        k_xy, k_xz, k_yz = shear
        zx, zy, zz = zx + k_xz * xx + k_yz * yx, zy + k_xz * xy + k_yz * yy, zz + k_xz * xz + k_yz * yz
        xx, xy, xz = xx + k_xy * yx, xy + k_xy * yy, xz + k_xy * yz
    return np.array(
        (
            (sx * xx, sx * xy, sx * xz, 0.0),
            (sy * yx, sy * yy, sy * yz, 0.0),
            (sz * zx, sz * zy, sz * zz, 0.0),
            (pos[0], pos[1], pos[2], 1.0),
        )
    )


def decompose_matrix(rows: Rows) -> tuple[Vec3, Vec3, Vec3]:
    """Split a 3x3 matrix into (hpr in degrees, scale, shear).

    The answer is not unique; this is Panda3D's. The Y row gives heading and pitch, the X row then gives the
    roll, so scale x and y are never negative, and a mirrored matrix has a negative scale z. If an axis has no
    length, the angle that it would give is 0.
    """
    x_row, y_row, z_row = rows
    heading = -math.atan2(y_row[0], y_row[1]) if y_row[0] or y_row[1] else 0.0
    s, c = math.sin(heading), math.cos(heading)
    (x0, x1, x2), (_, y1, y2), (z0, z1, z2) = (
        (row[0] * c + row[1] * s, row[1] * c - row[0] * s, row[2]) for row in (x_row, y_row, z_row)
    )
    pitch = math.atan2(y2, y1) if y1 or y2 else 0.0
    s, c = math.sin(pitch), math.cos(pitch)
    (x1, x2), y1, (z1, z2) = (
        (x1 * c + x2 * s, x2 * c - x1 * s),
        y1 * c + y2 * s,
        (z1 * c + z2 * s, z2 * c - z1 * s),
    )
    roll = math.atan2(-x2, x0) if x0 or x2 else 0.0
    s, c = math.sin(roll), math.cos(roll)
    x0 = x0 * c - x2 * s
    z0, z2 = z0 * c - z2 * s, z2 * c + z0 * s
    shear = (x1 / x0 if x0 else 0.0, z0 / z2 if z2 else 0.0, z1 / z2 if z2 else 0.0)
    hpr = (math.degrees(heading), math.degrees(pitch), math.degrees(roll))
    return hpr, (x0, y1, z2), shear


def look_at_quat(forward: Vec3, up: Vec3) -> Quat:
    """Return the rotation that turns +Y to `forward` exactly, and +Z as near to `up` as that allows.

    If `up` is zero or along `forward`, the world's Z is used instead; if that is along `forward` too, X stays
    unchanged. A zero `forward` is +Y. These fallbacks are Panda3D's.
    """
    y = _unit(forward) or (0.0, 1.0, 0.0)
    x = _unit(_cross_of_units(y, _unit(up))) or _unit(_cross_of_units(y, (0.0, 0.0, 1.0))) or (1.0, 0.0, 0.0)
    return quat_from_rows((x, y, _cross(x, y)))


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _cross_of_units(a: Vec3, b: Vec3 | None) -> Vec3:
    """Return the cross product of two unit vectors; exactly zero if they are parallel up to rounding."""
    product = _cross(a, b) if b is not None else (0.0, 0.0, 0.0)
    return product if max(map(abs, product)) > 4 * _EPSILON else (0.0, 0.0, 0.0)


def _unit(v: Vec3) -> Vec3 | None:
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length) if length else None


_FROM_GLTF: Float64 = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""The quarter turn from glTF's axes to ours, for row vectors."""


def vectors_from_gltf(vectors: ArrayLike) -> Float64:
    """Convert points or directions, shape (..., 3), from glTF's axes to ours; float64."""
    return np.asarray(np.asarray(vectors, dtype=np.float64) @ _FROM_GLTF[:3, :3])


def vectors_to_gltf(vectors: ArrayLike) -> Float64:
    """Convert points or directions, shape (..., 3), from our axes to glTF's; float64."""
    return np.asarray(np.asarray(vectors, dtype=np.float64) @ _FROM_GLTF[:3, :3].T)


def matrix_from_gltf(matrix: ArrayLike) -> Float64:
    """Convert matrices, shape (..., 4, 4), from glTF's, for column vectors, to ours, for row vectors."""
    return np.asarray(_FROM_GLTF.T @ np.asarray(matrix, dtype=np.float64).swapaxes(-1, -2) @ _FROM_GLTF)


def matrix_to_gltf(matrix: ArrayLike) -> Float64:
    """Convert a 4x4 matrix of a transform from ours, for row vectors, to glTF's, for column vectors."""
    return np.asarray((_FROM_GLTF @ np.asarray(matrix, dtype=np.float64) @ _FROM_GLTF.T).T)

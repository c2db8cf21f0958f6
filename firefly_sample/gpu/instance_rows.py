"""Rows of instances for the geometry pass and for shadow maps: the cast to float32 of their matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frame_plan import Batch
from firefly_sample.plan.shadows.maps import CasterBatch

INSTANCE_DTYPE = np.dtype(
    [
        ("in_view_x", np.float32, 4),
        ("in_view_y", np.float32, 4),
        ("in_view_z", np.float32, 4),
        ("in_normal_x", np.float32, 3),
        ("in_normal_y", np.float32, 3),
        ("in_normal_z", np.float32, 3),
        ("in_base_color", np.float32, 4),
        ("in_ambient", np.float32, 3),
        ("in_emission", np.float32, 3),
        ("in_specular", np.float32, 4),
        ("in_id", np.uint32),
    ]
)
"""One instance: the columns of model-to-view for positions and for normals, its colours, and id + 1."""

CASTER_DTYPE = np.dtype([*((f"in_clip_{axis}", np.float32, 4) for axis in "xyzw"), ("in_alpha", np.float32)])
"""One caster of a shadow: the columns of model-to-clip, and the factor of its alpha."""


def instance_rows(batches: Sequence[Batch]) -> NDArray[Any]:
    """The instances of batches, one batch after the other.

    Normals go through the cofactor matrix, which needs no inverse.
    """
    rows = np.zeros(sum(len(batch.ids) for batch in batches), dtype=INSTANCE_DTYPE)
    if not len(rows):
        return rows
    matrices = np.concatenate([batch.model_to_view for batch in batches])
    cofactors = normal_columns(matrices)
    for column, axis in enumerate("xyz"):
        rows[f"in_view_{axis}"] = matrices[:, :, column]
        rows[f"in_normal_{axis}"] = cofactors[:, :, column]
    factors = [batch.factors for batch in batches]
    rows["in_base_color"] = np.concatenate([own.base_colors for own in factors])
    rows["in_ambient"] = np.concatenate([own.ambients for own in factors])
    rows["in_emission"] = np.concatenate([own.emissions for own in factors])
    rows["in_specular"] = np.concatenate([own.speculars for own in factors])
    rows["in_id"] = np.concatenate([batch.ids for batch in batches]).astype(np.uint32) + 1
    return rows


def normal_columns(model_to_view: NDArray[np.float64]) -> NDArray[np.float64]:
    """What takes normals along, up to a length, for row vectors: shape (n, 3, 3), its largest entries 1."""
    linear = model_to_view[:, :3, :3]
    after, before = linear[:, [1, 2, 0]], linear[:, [2, 0, 1]]
    cofactors = after[:, :, [1, 2, 0]] * before[:, :, [2, 0, 1]]
    cofactors -= after[:, :, [2, 0, 1]] * before[:, :, [1, 2, 0]]
    # a flat matrix has no sides: it keeps the sign of one that is not mirrored
    cofactors *= np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[:, None, None]
    # shaders normalise anyway; this keeps tiny and huge scales inside float32
    largest = np.abs(cofactors).reshape(-1, 9).max(axis=1)[:, None, None]
    return np.asarray(cofactors / np.where(largest > 0, largest, 1.0))


def caster_rows(batch: CasterBatch) -> NDArray[Any]:
    """The casters of a batch."""
    rows = np.zeros(len(batch.alphas), dtype=CASTER_DTYPE)
    for column, axis in enumerate("xyzw"):
        rows[f"in_clip_{axis}"] = batch.model_to_clip[:, :, column]
    rows["in_alpha"] = batch.alphas
    return rows

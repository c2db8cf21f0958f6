"""Compressed meshes: KHR_draco_mesh_compression and EXT_meshopt_compression."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from firefly_sample.model.gltf.document import Document
    from firefly_sample.model.gltf.json_object import JsonObject


def decode_meshopt(document: Document, view: JsonObject) -> NDArray[np.uint8] | None:
    """Return the bytes of a compressed buffer view; None: take them from its fallback buffer."""
    raise view.error("extensions.EXT_meshopt_compression", "is not supported: export without it")

"""Compressed meshes: KHR_draco_mesh_compression and EXT_meshopt_compression.

Both are decoded by packages of the extra "formats". Without them, a file that also holds the numbers
uncompressed is read all the same, and for others the error names the command that installs them.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.extras import install_command

if TYPE_CHECKING:
    from firefly_sample.model.gltf.accessors import Layout
    from firefly_sample.model.gltf.document import Document
    from firefly_sample.model.gltf.json_object import JsonObject

DRACO, MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"
_STRIDES: dict[tuple[str, str], Collection[int]] = {
    ("ATTRIBUTES", "NONE"): range(4, 257, 4),
    ("ATTRIBUTES", "OCTAHEDRAL"): (4, 8),
    ("ATTRIBUTES", "QUATERNION"): (8,),
    ("ATTRIBUTES", "EXPONENTIAL"): range(4, 257, 4),
    ("TRIANGLES", "NONE"): (2, 4),
    ("INDICES", "NONE"): (2, 4),
}
"""The bytes of an element that each mode and filter of meshopt allows."""


class DracoMesh:
    """A decoded mesh: `triangles` (m, 3), and the attributes whose names are in `ids`."""

    def __init__(self, decoded: Any, extension: JsonObject) -> None:
        self._decoded = decoded
        self._extension = extension
        attributes = extension.required_object("attributes")
        self.ids = {name: attributes.whole(name) for name in attributes.json}
        self.triangles: NDArray[np.int64] = np.asarray(decoded.faces, np.int64).reshape(-1, 3)

    def attribute(self, name: str, accessor: JsonObject, layout: Layout) -> NDArray[Any]:
        """Return the numbers of an attribute, which must have the shape that its accessor says."""
        from firefly_sample.model.gltf.accessors import converted

        found = self._decoded.get_attribute_by_unique_id(self.ids[name])
        if found is None:
            raise self._extension.error(f"attributes.{name}", f"there is no attribute {self.ids[name]}")
        values = np.asarray(found["data"])
        if values.shape != (layout.count, *layout.shape):
            raise self._extension.error(
                f"attributes.{name}",
                f"has the shape {values.shape}, but its accessor {(layout.count, *layout.shape)}",
            )
        return converted(accessor, layout, values)


def decode_draco(primitive: JsonObject) -> DracoMesh | None:
    """Return the decoded mesh of a primitive; None if it is not compressed, or need not be decoded."""
    extension = primitive.extension(DRACO)
    if extension is None:
        return None
    try:
        import DracoPy
    except ImportError:
        if _has_plain_positions(primitive):
            return None
        raise _missing(extension, "DracoPy") from None
    where = extension.place("bufferView")
    if "bufferView" not in extension:
        raise extension.error("bufferView", "is missing")
    data, _ = primitive.document.read_buffer_view(extension.json["bufferView"], where)
    try:
        decoded = DracoPy.decode(data.tobytes())
    except Exception as error:  # it raises Exception itself, and classes of its own
        raise extension.error("", f"damaged ({_one_line(error)})") from error
    if not hasattr(decoded, "faces"):
        raise extension.error("", "holds points, but its primitive has triangles")
    return DracoMesh(decoded, extension)


def _has_plain_positions(primitive: JsonObject) -> bool:
    positions = primitive.required_object("attributes").accessors()["POSITION"]
    return "bufferView" in primitive.document.item("accessors", positions, primitive.where)


def decode_meshopt(document: Document, view: JsonObject) -> NDArray[np.uint8] | None:
    """Return the bytes of a compressed buffer view; None: take them from its fallback buffer.

    What is checked first are the rules of the extension's section "JSON schema updates".
    """
    extension = view.extension(MESHOPT)
    assert extension is not None
    try:
        import meshoptimizer
    except ImportError:
        if document.has_data(view.whole("buffer")):
            return None
        raise _missing(extension, "meshoptimizer") from None
    count, stride = extension.whole("count"), extension.whole("byteStride", least=1, most=256)
    mode, chosen = extension.text("mode"), extension.text("filter", "NONE")
    if count * stride != view.whole("byteLength"):
        raise extension.error("count", "times byteStride is not the byteLength of the view")
    if stride not in _STRIDES.get((mode, chosen), ()) or (mode == "TRIANGLES" and count % 3):
        raise extension.error(
            "", f"mode {mode}, filter {chosen}, stride {stride} and count {count} do not fit"
        )
    data = document.slice_buffer(extension)
    document.claim(count * stride // 4, extension.where)
    decode = {
        "ATTRIBUTES": meshoptimizer.decode_vertex_buffer,
        "TRIANGLES": meshoptimizer.decode_index_buffer,
        "INDICES": meshoptimizer.decode_index_sequence,
    }[mode]
    try:
        decoded = decode(count, stride, data)
    except (ValueError, RuntimeError) as error:
        raise extension.error("", f"damaged ({_one_line(error)})") from None
    # it returns small indices in the first half of an array
    decoded = np.ascontiguousarray(decoded).reshape(-1).view(np.uint8)[: count * stride]
    filters = {
        "OCTAHEDRAL": meshoptimizer.decode_filter_oct,
        "QUATERNION": meshoptimizer.decode_filter_quat,
        "EXPONENTIAL": meshoptimizer.decode_filter_exp,
    }
    if chosen in filters:
        decoded = filters[chosen](decoded, count, stride)
    return np.asarray(decoded, np.uint8)


def _missing(extension: JsonObject, package: str) -> ModelError:
    return extension.error("", f"needs the package {package}: run {install_command('formats')}")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__

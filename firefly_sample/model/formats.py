"""The tables of model formats other than glTF: their suffixes, up axes and packages."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Literal, cast

from firefly_sample.errors import MissingPackageError, ModelError, did_you_mean
from firefly_sample.extras import install_command

Up = Literal["x", "y", "z"]

EXTRA = "formats"
"""The extra of this package that names the packages of the formats that trimesh reads."""


@dataclass(frozen=True)
class Format:
    """A format, and how files of it are treated."""

    title: str
    up: Up = "z"
    """The axis that points up unless the user, or a file of this format, says otherwise."""
    packages: dict[str, str] | None = None
    """The packages that its reader imports, as {module: package}."""
    extra: str = EXTRA
    """The extra of this package that installs them."""
    undrawable: str = ""
    """The content of every file of a format without triangles, and the way out."""


_XML_GRAPH = {"lxml": "lxml", "networkx": "networkx"}
_CURVES = "holds curves, which are not drawn: export a mesh, for example .stl"

FORMATS = {
    "obj": Format("Wavefront OBJ", up="y"),
    "ply": Format("PLY, text or binary"),
    "stl": Format("STL, text or binary"),
    "stl_ascii": Format("STL, text"),
    "off": Format("OFF"),
    "dae": Format("COLLADA", packages={"collada": "pycollada"}),
    "zae": Format("COLLADA with its textures in an archive", packages={"collada": "pycollada"}),
    "3mf": Format("3MF", packages=_XML_GRAPH),
    "3dxml": Format("3DXML", packages=_XML_GRAPH),
    "xaml": Format("XAML", packages={"lxml": "lxml"}),
    "step": Format("STEP", packages={"cascadio": "cascadio"}),
    "stp": Format("STEP", packages={"cascadio": "cascadio"}),
    "ctm": Format("OpenCTM", packages={"openctm": "openctm"}),
    "xyz": Format("XYZ", undrawable="holds points, which are not drawn: export a mesh, for example .ply"),
    "dxf": Format("DXF", undrawable=_CURVES),
    "svg": Format("SVG", undrawable=_CURVES),
    "binvox": Format("binvox", undrawable="holds voxels, which are not drawn: export a mesh, such as .ply"),
    "zip": Format("an archive with a model"),
    "tar.gz": Format("an archive with a model"),
    "tar.bz2": Format("an archive with a model"),
    "bz2": Format("a compressed model"),
}
"""Formats by suffix, which is also trimesh's name of them."""

PANDA3D_FORMATS = {
    f"{suffix}{packed}": Format(title, packages={"panda3d": "panda3d"}, extra="panda3d")
    for suffix, title in (("egg", "Panda3D, text"), ("bam", "Panda3D, binary"))
    for packed in ("", ".pz", ".gz")
}
"""The formats that Panda3D reads, by suffix."""

_ALL = FORMATS | PANDA3D_FORMATS

ARCHIVES = ("zae", "zip", "tar.gz", "tar.bz2", "bz2")
"""Suffixes of files that hold other files."""


def suffix_of(path: Path) -> str:
    """Return a file's suffix in small letters and without its dot, such as "stl" or "tar.gz"."""
    name = path.name.lower()
    double = [suffix for suffix in _ALL if "." in suffix and name.endswith(f".{suffix}")]
    return double[0] if double else path.suffix.lower()[1:]


def is_panda3d(path: Path) -> bool:
    """Return whether a file's suffix is one of Panda3D's formats."""
    return suffix_of(path) in PANDA3D_FORMATS


def find_format(path: Path) -> Format:
    """Return the format of a file by its suffix, once it is sure that files of it can be read here.

    Raises
    ------
    ModelError
        If the suffix is unknown, or stands for a format without triangles.
    MissingPackageError
        If the format needs a package that is not installed.
    """
    suffix = suffix_of(path)
    found = _ALL.get(suffix) or _format_of_trimesh(suffix)
    if found is None:
        drawn = sorted({"glb", "gltf"} | {known for known, made in _ALL.items() if not made.undrawable})
        hint = did_you_mean(suffix, drawn)
        listed = ", ".join(f".{known}" for known in drawn)
        what = f"the suffix .{suffix} is unknown{hint}" if suffix else "its name has no suffix"
        raise ModelError(f"model {path}: {what}; the formats are {listed}")
    if found.undrawable:
        raise ModelError(f"model {path}: {found.title} {found.undrawable}")
    missing = [package for module, package in (found.packages or {}).items() if find_spec(module) is None]
    if missing:
        raise MissingPackageError(
            f"model {path}: .{suffix} files ({found.title}) need {' and '.join(missing)} of the extra "
            f"{found.extra!r}: run {install_command(found.extra)}"
        )
    return found


def up_axis(path: Path, up: str | None, declared: Up) -> Up:
    """Return the up axis that a user asks for; `declared`, the file's, when that is None or "auto"."""
    if up in (None, "auto"):
        return declared
    if up not in ("x", "y", "z"):
        raise ModelError(f"model {path}: the up axis must be 'auto', 'x', 'y' or 'z', got {up!r}")
    return cast("Up", up)


def _format_of_trimesh(suffix: str) -> Format | None:
    """Return a format that this table lacks and trimesh reads, because of a package that is installed."""
    import trimesh

    readable = trimesh.available_formats() - {"glb", "gltf"}
    return Format(suffix.upper()) if suffix in readable else None

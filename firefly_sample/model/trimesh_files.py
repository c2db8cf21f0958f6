"""Model files of formats other than glTF as a `ModelData`.

OBJ and COLLADA are read by readers of our own, which say why. trimesh reads the rest.

Units are kept: a number in the file is a number in the scene, even if the file names a unit (3MF, COLLADA).
STEP is the exception: its converter makes metres. Colours are display colours (sRGB), as other viewers show
them, and are made linear. Both sides of every triangle are drawn, because these formats do not say which is
meant. Meshes without normals are smooth where their triangles meet at 30 degrees or less, and sharp
elsewhere: see `firefly_sample.model.creases`.
"""

from __future__ import annotations

from pathlib import Path

from firefly_sample.errors import FireflyError, ModelError, printable
from firefly_sample.model.archives import unpacked
from firefly_sample.model.data import ModelData
from firefly_sample.model.formats import ARCHIVES, FORMATS, find_format, suffix_of
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.reader import read_gltf
from firefly_sample.model.isolated import read_isolated
from firefly_sample.model.readers import read_here


def read_with_trimesh(path: Path, up: str | None, max_texture_megapixels: float) -> ModelData:
    """Return the content of a model file of any format but glTF.

    Parameters
    ----------
    path : Path
        A file of one of the formats in `firefly_sample.model.formats`, or an archive that holds one.
    up : {"x", "y", "z", "auto"}, optional
        The axis that points up in the file. "auto" and None: what a .dae says, Y of .obj, Z of all others.
    max_texture_megapixels : float
        Larger textures are refused before they are decoded.

    Raises
    ------
    ModelError
        If the file is missing or damaged, of an unknown format, or holds no triangles.
    MissingPackageError
        If its format needs a package that is not installed.
    """
    found = find_format(path)
    if not path.is_file():
        fault = "is a folder" if path.is_dir() else "not a file" if path.exists() else "no such file"
        raise ModelError(f"model {path}: {fault}")
    if not path.stat().st_size:
        raise ModelError(f"model {path}: the file is empty")
    suffix = suffix_of(path)
    if suffix in ARCHIVES:
        with unpacked(path) as inner:
            try:
                if suffix_of(inner) in ("glb", "gltf"):
                    model = read_gltf(Document.open(inner), None, max_texture_megapixels)
                else:
                    model = read_with_trimesh(inner, up, max_texture_megapixels)
            except FireflyError as error:
                raise type(error)(
                    str(error).replace(printable(str(inner)), f"{path}: {inner.name}")
                ) from None
        if suffix != "bz2":
            model.name = path.name[: -len(suffix) - 1]
        return model
    if found.packages is not None or suffix not in FORMATS:
        return read_isolated(path, suffix, up, max_texture_megapixels)
    return read_here(path, suffix, up, max_texture_megapixels)

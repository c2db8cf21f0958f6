"""Formats other than glTF, read in this process: OBJ and COLLADA by own readers, the others by trimesh."""

from __future__ import annotations

from pathlib import Path

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.data import ModelData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import FORMATS, up_axis
from firefly_sample.model.pixels import one_line


def read_here(path: Path, suffix: str, up: str | None, max_texture_megapixels: float) -> ModelData:
    """Return the content of a file that is no archive, read in this process."""
    losses = Losses()
    folder = Folder(path, losses, max_texture_megapixels)
    try:
        model = _read(path, suffix, up, folder, losses)
    except OSError as error:
        raise ModelError(f"model {path}: cannot be read ({error.strerror or one_line(error)})") from None
    except MemoryError:
        raise ModelError(f"model {path}: reading it takes more memory than there is: simplify it") from None
    if not model.geoms:
        also = "".join(f"; not drawn: {line}" for line in losses.lines())
        raise ModelError(f"model {path}: holds no triangles, so there is nothing to draw{also}")
    model.losses.extend(losses.lines())
    return model


def _read(path: Path, suffix: str, asked: str | None, folder: Folder, losses: Losses) -> ModelData:
    if suffix == "dae":
        from firefly_sample.model.dae_model import read_dae

        return read_dae(path, asked, folder, losses)
    up = up_axis(path, asked, FORMATS[suffix].up if suffix in FORMATS else "z")
    if suffix == "obj":
        from firefly_sample.model.obj import read_obj

        return read_obj(path, up, folder, losses)
    from firefly_sample.model.trimesh_scenes import read_scene

    return read_scene(path, suffix, up, folder, losses)

"""load_model: any model file as a tree of nodes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from firefly_sample.disk_cache import fingerprint
from firefly_sample.errors import ModelError, SceneError
from firefly_sample.model.conventions import turn
from firefly_sample.model.data import ModelData
from firefly_sample.model.formats import find_format, is_panda3d, up_axis
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.reader import read_gltf
from firefly_sample.model.kept import load_kept, model_key, save_kept
from firefly_sample.model.pixels import made_image
from firefly_sample.model.tree import make_tree
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.settings import to_number

GLTF_SUFFIXES = (".glb", ".gltf")


def load_model(
    path: str | Path,
    *,
    scene: str | int | None = None,
    max_texture_megapixels: float = 100.0,
    up: str | None = None,
) -> NodePath:
    """Load a new tree of nodes from a model file.

    docs/formats.md lists the formats other than glTF 2 (.glb, .gltf). The root is a `ModelRoot`, which is
    named after the file and plays its animations; its `warnings` name what is not drawn. Units are kept, and
    axes are turned so that Z is up. Nodes keep their names, order and transforms. Primitives of one mesh
    become Geoms of one node, and nodes with the same mesh share Geoms. Cameras and lights are nodes too.

    Panda3D itself reads its own files, .bam and .egg, which keep their numbers: they are drawn as Panda3D
    draws them by ``Settings(look="panda3d")``.

    Files of other formats are cached and not parsed twice: see `firefly_sample.disk_cache`.

    Parameters
    ----------
    path : str or Path
    scene : str or int, optional
        The name or the index of a scene of a glTF file, "1" for 1; its default scene when absent.
    max_texture_megapixels : float
        Textures with more million pixels are refused before they are decoded.
    up : {"x", "y", "z"}, optional
        The axis of the file that is up, for other formats than glTF, which has Y up.

    Raises
    ------
    ModelError
        If the file is missing or damaged, or needs something that this package cannot read.
    """
    path = Path(path)
    limit = to_number(max_texture_megapixels)
    if not limit > 0.0:
        raise ModelError(
            f"model {path}: max_texture_megapixels must be a number above 0, got {max_texture_megapixels!r}"
        )
    if path.suffix.lower() not in GLTF_SUFFIXES:
        if scene is not None:
            raise ModelError(f"model {path}: there is no scene {scene!r}: only glTF files have scenes")
        if is_panda3d(path):
            find_format(path)
            from firefly_sample.model.panda3d.files import read_panda3d

            matrix = np.eye(4)
            matrix[:3, :3] = turn(up_axis(path, up, "z"))
            made = NodePath(read_panda3d(path, limit))
            made.set_mat(matrix)
            return made
        from firefly_sample.model.trimesh_files import read_with_trimesh

        return _make(path, read_with_trimesh(path, up, limit), None)
    document = Document.open(path)

    def parse() -> ModelData:
        return read_gltf(document, scene, limit)

    _read_all(document)
    key = model_key(path.stem, document.files, scene, limit)
    kept = load_kept(key, parse) if key else None
    return _make(path, parse(), key) if kept is None else kept


def _read_all(document: Document) -> None:
    """Read all files beside the model, since its content depends on them."""
    for kind in ("buffers", "images"):
        for item in document.items(kind):
            uri = item.text("uri", None)
            if uri is not None:
                try:
                    document.read_uri(uri, item.place("uri"))
                except ModelError:
                    continue  # an error only if it is used


def _make(path: Path, model: ModelData, key: str | None) -> NodePath:
    """Return the tree of a file, and keep the file under a key; its images are decoded, to check them."""
    pixels = [image.decode() for image in model.images]
    model.images = [
        made_image(decoded, image.name) for image, decoded in zip(model.images, pixels, strict=True)
    ]
    digests = [fingerprint(decoded) for decoded in pixels] if key else None
    try:
        root = make_tree(model, digests)
    except SceneError as error:
        raise ModelError(f"model {path}: {error}") from error
    if key and digests is not None:
        save_kept(key, model, digests)
    return root

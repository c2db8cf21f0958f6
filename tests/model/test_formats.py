"""A file of every format that trimesh knows: its picture, or the line that says why there is none."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.exchange import load as trimesh_load
from trimesh.path.exchange import load as trimesh_paths

from firefly_sample.errors import MissingPackageError, ModelError
from firefly_sample.model import formats
from firefly_sample.model.data import ModelData
from firefly_sample.model.formats import ARCHIVES, FORMATS
from firefly_sample.model.load import load_model
from firefly_sample.model.tree import make_tree
from firefly_sample.model.trimesh_files import read_with_trimesh
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.model.format_files import (
    COLORED,
    ORANGE,
    SUFFIXES,
    UNDRAWABLE,
    VERTICES,
    dae,
    ply_text,
    write,
    zipped,
)
from tests.model.format_pictures import SIZE, covered, front

GREY = (231, 231, 231)
"""The display code of the plain material, 0.8."""
SILHOUETTES = {
    "z": [(0, 0), (1, 0), (0, 3)],
    "y": [(0, 0), (1, 0), (0, 2)],
    "x": [(0, 0), (-2, 0), (0, 1)],
}
"""The tetrahedron from the front, as x and z, by the axis that is up."""


@pytest.fixture(scope="module")
def draw():
    """The display colours of a scene under white ambient light, shape (SIZE, SIZE, 3)."""
    with make_renderer((SIZE, SIZE), Settings(tone="none")) as renderer:
        yield lambda scene: renderer.render(scene).color


def declared_up(suffix: str) -> str:
    return "y" if suffix == "obj" else "z"


def metres(suffix: str) -> float:
    """What makes units of a file again: those of STEP become metres."""
    return 1000.0 if suffix in ("step", "stp") else 1.0


def test_the_table_has_exactly_the_formats_of_trimesh() -> None:
    """So that a new version of trimesh, or of its packages, shows."""
    loaders = (
        trimesh_load.mesh_loaders,
        trimesh_paths.path_loaders,
        trimesh_load.voxel_loaders,
        trimesh_load.compressed_loaders,
    )
    # .drc needs the program draco_decoder, which is found where the scripts of DracoPy are in the PATH
    theirs = {suffix for table in loaders for suffix in table} - {"drc"}
    assert FORMATS.keys() | {"glb", "gltf"} == theirs
    drawn = {suffix for suffix, made in FORMATS.items() if not made.undrawable}
    assert drawn < trimesh.available_formats() - {"drc"} <= theirs  # with the packages of the extra


def test_there_is_a_file_of_every_format() -> None:
    assert {*SUFFIXES, *UNDRAWABLE} == FORMATS.keys()
    assert {suffix for suffix, made in FORMATS.items() if made.undrawable} == UNDRAWABLE.keys()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_format_is_drawn(suffix: str, tmp_path: Path, draw) -> None:
    path = write(tmp_path, suffix)
    model = read_with_trimesh(path, None, 100)
    if declared_up(suffix) == "z":
        check_triangles_and_units(model, suffix)
    root = make_tree(model, None)
    picture = draw(front(root, metres(suffix)))
    expected = np.zeros((SIZE, SIZE, 3), dtype=int)
    expected[covered(np.array(SILHOUETTES[declared_up(suffix)]))] = ORANGE if suffix in COLORED else GREY
    assert np.abs(picture - expected).max() <= 1
    assert root.get_name() == "tetra"
    assert root.node().warnings == ()


def test_triangles_of_obj(tmp_path: Path) -> None:
    check_triangles_and_units(read_with_trimesh(write(tmp_path, "obj"), "z", 100), "obj")


@pytest.mark.parametrize("up", ["x", "y", "z"])
@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
def test_the_up_axis_is_turned_up(suffix: str, up: str, tmp_path: Path, draw) -> None:
    scene = front(load_model(write(tmp_path, suffix), up=up))
    picture = draw(scene)
    assert (picture.any(axis=-1) == covered(np.array(SILHOUETTES[up]))).all()


@pytest.mark.parametrize(("declared", "up"), [("X_UP", "x"), ("Y_UP", "y"), ("Z_UP", "z")])
def test_collada_says_which_axis_is_up(declared: str, up: str, tmp_path: Path) -> None:
    path = tmp_path / "tetra.dae"
    path.write_bytes(dae(declared))
    shape = load_model(path).get_tight_bounds()
    path.write_bytes(dae("Z_UP"))
    assert np.array_equal(shape, load_model(path, up=up).get_tight_bounds())


def check_triangles_and_units(model: ModelData, suffix: str) -> None:
    """Check that triangles and units are those of the file, with Z up."""
    (geom,) = model.geoms
    corners = geom.arrays["vertices"][geom.arrays["triangles"]] * metres(suffix)
    volumes = np.linalg.det(corners)
    assert len(corners) == 4
    assert volumes.sum() == pytest.approx(6.0, rel=1e-6)  # six times the volume, so all are outwards
    assert {tuple(row) for row in corners.reshape(-1, 3).round(5).tolist()} == set(
        map(tuple, VERTICES.tolist())
    )
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    if suffix != "3dxml":  # whose normals the file gives
        assert np.allclose(geom.arrays["normals"][geom.arrays["triangles"]], normals[:, None], atol=1e-6)


@pytest.mark.parametrize("suffix", UNDRAWABLE)
def test_formats_without_triangles_say_so(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"file.{suffix}"
    path.write_bytes(UNDRAWABLE[suffix])
    with pytest.raises(ModelError, match=r"holds (points|curves|voxels), which are not drawn: export a mesh"):
        load_model(path)


NEEDING = [suffix for suffix, made in FORMATS.items() if made.packages]


@pytest.mark.parametrize("suffix", NEEDING)
def test_a_missing_package_is_named_with_its_extra(suffix: str, tmp_path: Path, monkeypatch) -> None:
    """As where the package is not installed: nothing is found under the names that are asked for."""
    monkeypatch.setattr(formats, "find_spec", lambda name: None)
    path = write(tmp_path, suffix)
    with pytest.raises(MissingPackageError) as caught:
        load_model(path)
    line = str(caught.value)
    for package in (FORMATS[suffix].packages or {}).values():
        assert package in line
    assert line.startswith(f"model {path}: .{suffix} files")
    assert "of the extra 'formats': run " in line
    assert "-m pip install" in line


def test_packages_of_the_table_are_those_of_the_extra() -> None:
    import tomllib

    root = Path(__file__).resolve().parents[2]
    extra = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"][
        "formats"
    ]
    listed = {re.split(r"[^\w-]", requirement)[0] for requirement in extra}
    needed = {package for made in FORMATS.values() for package in (made.packages or {}).values()}
    assert needed <= listed
    assert all(find_spec(module) for made in FORMATS.values() for module in made.packages or {})


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("model.foo", r"the suffix \.foo is unknown; the formats are \.3dxml, .*\.glb, .*\.zip$"),
        ("model.sltp", r"the suffix \.sltp is unknown \(did you mean 'st"),
        ("model", r"its name has no suffix; the formats are "),
        ("missing.stl", r"missing\.stl: no such file$"),
    ],
)
def test_unknown_and_missing_files(name: str, line: str, tmp_path: Path) -> None:
    if not name.startswith("missing"):
        (tmp_path / name).write_bytes(b"rubbish")
    with pytest.raises(ModelError, match=line):
        load_model(tmp_path / name)


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "model.stl").mkdir()
    with pytest.raises(ModelError, match="is a folder"):
        load_model(tmp_path / "model.stl")


def test_up_axes_have_three_names(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="the up axis must be 'auto', 'x', 'y' or 'z', got 'w'"):
        load_model(write(tmp_path, "stl"), up="w")


@pytest.mark.parametrize(
    ("files", "line"),
    [
        ({"a.ply": b"", "b.stl": b""}, r"must hold one model file, and holds 'a\.ply', 'b\.stl'"),
        ({"readme.txt": b""}, "must hold one model file, and holds none"),
        ({"../a.ply": ply_text()}, r"has a file outside its own folder: '\.\./a\.ply'"),
        ({"/a.ply": ply_text()}, "has a file outside its own folder"),
        ({"a.ply": b"ply\n"}, r"model.zip: a\.ply: damaged \.ply file"),
    ],
)
def test_archives_hold_one_model(files: dict[str, bytes], line: str, tmp_path: Path) -> None:
    path = tmp_path / "model.zip"
    path.write_bytes(zipped(files))
    with pytest.raises(ModelError, match=line):
        load_model(path)
    assert os.listdir(tmp_path) == ["model.zip"]


@pytest.mark.parametrize("suffix", ARCHIVES)
def test_damaged_archives(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"model.{suffix}"
    path.write_bytes(b"rubbish")
    with pytest.raises(ModelError, match=rf"model\.{suffix}: damaged archive"):
        load_model(path)


def test_an_archive_may_not_unpack_to_too_much(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("firefly_sample.model.archives.LARGEST_CONTENT", 1 << 20)
    path = tmp_path / "model.zip"
    path.write_bytes(zipped({"model.ply": bytes(1 << 21)}))
    assert path.stat().st_size < 4096
    with pytest.raises(ModelError, match="unpacks to more than 1 MiB: unpack it yourself"):
        load_model(path)


def test_glTF_in_an_archive_is_drawn(tmp_path: Path) -> None:
    inner = trimesh.Trimesh(VERTICES, [[0, 2, 1]], process=False).export(file_type="glb")
    path = tmp_path / "model.zip"
    path.write_bytes(zipped({"deep/inner.glb": inner}))
    (geom,) = read_with_trimesh(path, None, 100).geoms
    assert len(geom.arrays["triangles"]) == 1

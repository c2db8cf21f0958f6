"""Damage to files of every format: data or a ModelError of one line, whatever it is."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model import isolated
from firefly_sample.model.readers import read_here
from firefly_sample.model.trimesh_files import read_with_trimesh
from tests.model.format_files import FILES, dae, model_3mf, ply_binary, stl_text, write, xaml, zipped
from tests.model.mutations import mutated_bytes

PLAIN = {
    "obj": FILES["obj"](),
    "ply": FILES["ply"](),
    "binary.ply": ply_binary(),
    "stl": FILES["stl"](),
    "text.stl": stl_text(),
    "off": FILES["off"](),
    "dae": dae(),
    "zip": FILES["zip"](),
    "tar.gz": FILES["tar.gz"](),
}


@pytest.mark.parametrize("name", PLAIN)
def test_mutated_files(name: str, tmp_path: Path) -> None:
    """In this process, sixty of each: what is no ModelError fails the test."""
    chance = random.Random(name)
    path = tmp_path / f"model.{name}"
    refused = []
    for _ in range(60):
        path.write_bytes(mutated_bytes(PLAIN[name], chance))
        try:
            model = read_here(path, "dae", None, 1.0) if name == "dae" else read_with_trimesh(path, None, 1.0)
        except ModelError as error:
            refused.append(str(error))
            continue
        for geom in model.geoms:
            assert np.isfinite(geom.arrays["vertices"]).all()
            assert geom.arrays["triangles"].max() < len(geom.arrays["vertices"])
    assert refused
    assert all(line.startswith(f"model {path}") and "\n" not in line for line in refused)


def test_mutated_files_of_packages(tmp_path: Path) -> None:
    """One process for all of them, without its limits; none may end it but STEP, which is tried by itself."""
    code = """
import random, sys
from pathlib import Path
from firefly_sample.errors import ModelError
from firefly_sample.model.readers import read_here
from tests.model.format_files import FILES
from tests.model.mutations import mutated_bytes
chance = random.Random(1)
for suffix in ("3mf", "3dxml", "xaml"):
    path = Path(sys.argv[1]) / f"model.{suffix}"
    for _ in range(40):
        path.write_bytes(mutated_bytes(FILES[suffix](), chance))
        try:
            read_here(path, suffix, None, 1.0)
        except ModelError as error:
            assert "\\n" not in str(error)
print("whole")
"""
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.stdout.endswith("whole\n"), done.stderr[-2000:]


@pytest.mark.parametrize(("suffix", "seed"), [("step", 0), ("step", 1), ("ctm", 1)])
def test_mutated_files_in_their_own_process(suffix: str, seed: int, tmp_path: Path) -> None:
    path = tmp_path / f"model.{suffix}"
    path.write_bytes(mutated_bytes(FILES[suffix](), random.Random(seed)))
    with suppress(ModelError):
        assert read_with_trimesh(path, None, 1.0).geoms


def replace_cascadio(folder: Path, act: str, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A .step file, for which the package that reads it does something else."""
    (folder / "cascadio.py").write_text(f"import os\ndef step_to_glb(*_, **__):\n    {act}\n")
    monkeypatch.syspath_prepend(str(folder))
    return write(folder, "step")


@pytest.mark.parametrize(
    ("act", "line"),
    [
        (
            f"os.kill(os.getpid(), {int(signal.SIGSEGV)})",
            r"damaged: its reader crashed \(SIGSEGV\): export it again",
        ),
        ("os._exit(3)", "damaged: its reader ended without a result \\(exit code 3\\): export it again"),
        ("bytearray(3 << 30)", "reading it takes more memory than there is: simplify it"),
        ("while True: pass", "reading it takes more than 3 seconds: simplify it"),
        ("raise ValueError('two\\nlines')", r"damaged \.step file \(two lines\): export it again"),
    ],
)
def test_a_reader_that_fails_is_one_line(act: str, line: str, tmp_path: Path, monkeypatch) -> None:
    # the imports alone may take more than three seconds on a busy machine
    monkeypatch.setattr(isolated, "SECONDS", 3 if "while" in act else 30)
    path = replace_cascadio(tmp_path, act, monkeypatch)
    with pytest.raises(ModelError, match=line) as caught:
        read_with_trimesh(path, None, 1.0)
    assert str(caught.value).startswith(f"model {path}: ")


def test_parts_of_parts_of_parts_are_bounded(tmp_path: Path) -> None:
    """Seventeen objects, each of two of the one before, are 131,072 tetrahedra; trimesh stops before."""
    components = "".join(
        f'<object id="{number}"><components><component objectid="{number - 1}"/>'
        f'<component objectid="{number - 1}"/></components></object>'
        for number in range(2, 19)
    )
    path = tmp_path / "model.3mf"
    path.write_bytes(model_3mf(components=components, items='<item objectid="18"/>'))
    assert path.stat().st_size < 4096
    with suppress(ModelError):
        assert len(read_with_trimesh(path, None, 1.0).nodes) < 100_000


BOMB = "".join(f'<!ENTITY b{n} "{f"&b{n - 1};" * 10}">' for n in range(1, 20))
DECLARED = f'<!DOCTYPE a [<!ENTITY b0 "boom">{BOMB}<!ENTITY file SYSTEM "file:///etc/hostname">]>'


@pytest.mark.parametrize("entity", ["&b19;", "&file;"])
def test_entities_of_xml_are_not_followed(entity: str, tmp_path: Path) -> None:
    path = tmp_path / "model.xaml"
    path.write_bytes(DECLARED.encode() + xaml().replace(b'Opacity="1"', f'Opacity="{entity}"'.encode()))
    with pytest.raises(ModelError) as caught:
        read_here(path, "xaml", None, 1.0)
    assert os.uname().nodename not in str(caught.value)
    path = tmp_path / "model.3mf"
    text = (
        f'{DECLARED}<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">{entity}</model>'
    )
    path.write_bytes(zipped({"3D/3dmodel.model": text.encode()}))
    with pytest.raises(ModelError):
        read_here(path, "3mf", None, 1.0)


@pytest.mark.parametrize(
    ("element", "loss"),
    [
        ('<m:colorgroup id="5"><m:color color="#FF0000"/></m:colorgroup>', "colours of 3MF files"),
        (
            '<basematerials id="5"><base name="a" displaycolor="#FF0000"/></basematerials>',
            "base materials of 3MF files",
        ),
    ],
)
def test_colors_of_3mf_are_named(element: str, loss: str, tmp_path: Path) -> None:
    path = tmp_path / "model.3mf"
    path.write_bytes(model_3mf(extra=element))
    assert read_here(path, "3mf", None, 1.0).losses == [loss]

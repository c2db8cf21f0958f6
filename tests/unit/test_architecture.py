"""Imports go one way, nothing heavy is imported before it is needed, and GL stays in its folders."""

from __future__ import annotations

import ast
import statistics
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import firefly_sample

PACKAGE = Path(firefly_sample.__file__).parent

LAYERS = (
    (
        {
            "errors",
            "extras",
            "settings",
            "assets",
            "whole_files",
            "columns",
            "srgb",
            "compositing",
            "planar",
            "showing",
            "mipmaps",
            "disk_cache",
            "memo",
            "losses",
            "measure",  # old names
            "reference",
        },
    ),
    ({"scene"},),
    ({"camera", "frame", "encoding"},),
    ({"model"},),
    ({"scenes"}, {"plan"}),
    ({"gpu"}, {"packing"}),
    ({"passes"}, {"readback"}),
    ({"pipeline"}, {"pending"}),
    ({"renderer"},),
    ({"capture", "viewer", "interop"},),
    ({"lab"},),
    ({"__main__", "cli", "commands"},),
)
"""From below to above: each imports what stands before it and what is in its own set. Sets beside each other
know nothing of each other."""

FORBIDDEN = {("gpu", "scene"), ("gpu", "scenes"), ("gpu", "model"), ("plan", "model"), ("passes", "model")}
"""(who, whom) that the layers alone would allow."""

HOMES = {
    "moderngl": {"gpu", "passes", "lab"},
    "glcontext": {"gpu"},
    "OpenGL": set(),
    "trimesh": {"model", "interop", "lab"},
    "glfw": {"viewer"},
    "panda3d": {"interop", "model", "lab"},
    "pyrender": {"interop"},
    "cyclopts": {"cli", "commands"},
    "rich": {"commands"},
    "embreex": {"lab"},
    "distributed": {"capture"},
    "dask": {"capture"},
    "OpenEXR": {"encoding"},
    "pycocotools": {"capture"},
    "av": {"encoding"},
}
"""Who may import a library at all."""

EARLY = {"numpy": None, "moderngl": {"gpu", "passes", "lab"}, "cyclopts": {"cli", "commands"}}
"""Libraries that may be imported while a module loads, and by whom (None: everybody)."""


class Import(NamedTuple):
    """One import statement: the module it is in, what it names, and whether it runs when the module loads."""

    module: str
    target: str
    early: bool
    line: int

    @property
    def where(self) -> str:
        return f"{self.module}:{self.line}"


def part(module: str) -> str:
    """The entry of the layout that a module belongs to: ``firefly_sample.scene.node`` is in "scene"."""
    return module.split(".")[1] if "." in module else ""


def imports_of(path: Path) -> Iterator[Import]:
    module = ".".join(("firefly_sample", *path.relative_to(PACKAGE).with_suffix("").parts))
    module = module.removesuffix(".__init__")
    for node, early in import_statements(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(module, alias.name, early, node.lineno)
        else:
            assert node.level == 0, f"{module}:{node.lineno}: relative imports hide where they go"
            for alias in node.names:
                target = node.module or ""
                if (PACKAGE.parent / target.replace(".", "/")).is_dir():
                    target = f"{target}.{alias.name}"  # a module, or a name of a package's __init__
                yield Import(module, target, early, node.lineno)


def import_statements(
    node: ast.AST, early: bool = True
) -> Iterator[tuple[ast.Import | ast.ImportFrom, bool]]:
    """The import statements below a node, each with whether it runs when the module loads."""
    early = early and not (isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or is_for_types(node))
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child, early
        elif not isinstance(child, ast.expr):  # no expression holds a statement; most nodes are expressions
            yield from import_statements(child, early)


def is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


@cache
def imports() -> tuple[Import, ...]:
    """All imports of the package, read when a test first asks: every worker collects this file."""
    return tuple(
        found
        for path in sorted(PACKAGE.rglob("*.py"))
        if "_assets" not in path.parts
        for found in imports_of(path)
    )


def own_imports() -> list[Import]:
    return [found for found in imports() if found.target.split(".")[0] == "firefly_sample"]


def foreign_imports() -> list[Import]:
    own = {"firefly_sample", *sys.stdlib_module_names}
    return [found for found in imports() if found.target.split(".")[0] not in own]


def may_import(who: str, whom: str) -> bool:
    """Whether the layers allow it."""
    place = {
        name: (level, index)
        for level, groups in enumerate(LAYERS)
        for index, group in enumerate(groups)
        for name in group
    }
    if (who, whom) in FORBIDDEN:
        return False
    return place[whom][0] < place[who][0] or place[whom] == place[who]


def test_the_reader_of_imports_sees_each_kind(tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "PACKAGE", tmp_path / "firefly_sample")
    path = tmp_path / "firefly_sample" / "gpu" / "device.py"
    path.parent.mkdir(parents=True)
    path.write_text(
        "import moderngl\n"
        "from firefly_sample import gpu\n"
        "from firefly_sample.plan.build import build_plan\n"
        "if TYPE_CHECKING:\n    import trimesh\n"
        "class A:\n    import numpy\n    def f(self):\n        from PIL import Image\n"
        "try:\n    import glfw\nexcept ImportError:\n    pass\n"
    )
    assert {(found.target, found.early) for found in imports_of(path)} == {
        ("moderngl", True),
        ("firefly_sample.gpu", True),
        ("firefly_sample.plan.build", True),
        ("trimesh", False),
        ("numpy", True),
        ("PIL", False),
        ("glfw", True),
    }
    assert {found.module for found in imports_of(path)} == {"firefly_sample.gpu.device"}


def test_every_module_has_its_place():
    known = {name for groups in LAYERS for group in groups for name in group}
    assert {part(found.module) for found in imports()} - {""} <= known


def test_imports_go_one_way():
    wrong = [
        f"{found.where} imports {found.target}"
        for found in own_imports()
        if part(found.module) and part(found.target) and part(found.target) != "__version__"
        if not may_import(part(found.module), part(found.target))
    ]
    assert wrong == []


def test_nobody_inside_uses_the_public_names():
    """They are for users; inside, they would lead upwards. The version alone has no other home."""
    used = {
        found.target
        for found in own_imports()
        if found.module != "firefly_sample" and found.target.count(".") <= 1
    }
    names = {target.removeprefix("firefly_sample.") for target in used}
    assert names & set(firefly_sample.__all__) <= {"__version__"}
    assert "firefly_sample" not in used


def test_libraries_stay_where_they_belong():
    wrong = [
        f"{found.where} imports {found.target}"
        for found in foreign_imports()
        if part(found.module) not in HOMES.get(found.target.split(".")[0], {part(found.module)})
    ]
    assert wrong == []


def test_nothing_heavy_is_imported_early():
    wrong = []
    for found in foreign_imports():
        library = found.target.split(".")[0]
        allowed = EARLY.get(library, set())
        if found.early and allowed is not None and part(found.module) not in allowed:
            wrong.append(f"{found.where} imports {found.target}")
    assert wrong == []


def test_every_public_name_can_be_imported():
    assert firefly_sample.__all__ == sorted(firefly_sample.__all__)
    for name in firefly_sample.__all__:
        value = getattr(firefly_sample, name)
        assert getattr(value, "__name__", name) == name
    assert set(firefly_sample.__all__) <= set(dir(firefly_sample))
    with pytest.raises(AttributeError, match="no attribute 'Rendrer'"):
        firefly_sample.Rendrer  # noqa: B018


def run(code: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=600, check=True
    ).stdout


def test_importing_the_package_loads_no_library():
    code = "import sys, firefly_sample; firefly_sample.SoftwareDriverWarning; print(*sorted(sys.modules))"
    loaded = run(code).split()
    heavy = {*HOMES, "PIL", "numpy"}
    assert heavy.isdisjoint(name.split(".")[0] for name in loaded)


def test_a_plan_needs_neither_gl_nor_trimesh():
    loaded = run("import sys, firefly_sample; firefly_sample.build_plan; print(*sorted(sys.modules))").split()
    assert {"moderngl", "glcontext", "trimesh", "glfw", "PIL"}.isdisjoint(loaded)


def test_importing_the_package_takes_little_longer_than_numpy():
    """Processor time, which other work on the machine hardly changes."""
    code = "import resource; {}; print(sum(resource.getrusage(resource.RUSAGE_SELF)[:2]))"

    def seconds(modules: str) -> float:
        return float(run(code.format(f"import {modules}")))

    pairs = [(seconds("numpy"), seconds("numpy, firefly_sample")) for _ in range(5)]
    alone, both = (statistics.median(column) for column in zip(*pairs, strict=True))
    assert both - alone < 0.2

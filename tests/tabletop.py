"""The recipe of docs/tabletop.md: its package, built and unpacked, and what stands on its table."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from zipfile import ZipFile

import numpy as np
from scipy.spatial import ConvexHull
from trimesh import Trimesh
from trimesh.collision import CollisionManager

from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.traversal import iter_visible

PAGE = (Path(__file__).parents[1] / "docs" / "tabletop.md").read_text()
MODULE, PYPROJECT = (re.search(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)[1] for kind in ("python", "toml"))
CATEGORIES = {"bonsai", "cat", "orrery", "stump", "walker"}


@contextmanager
def installed(folder: Path) -> Iterator[Path]:
    """Install the package below a folder for this process, until the end of the block."""
    packages = install(folder)
    sys.path.insert(0, str(packages))
    try:
        yield packages
    finally:
        sys.path.remove(str(packages))
        sys.modules.pop("tabletop", None)


def install(folder: Path) -> Path:
    """Build the package as the page shows it, and return a folder with what pip would install."""
    source, packages = folder / "source", folder / "site-packages"
    source.mkdir()
    (source / "tabletop.py").write_text(MODULE)
    (source / "pyproject.toml").write_text(PYPROJECT)
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder]
    subprocess.run(build, cwd=source, check=True, capture_output=True, timeout=600)
    (wheel,) = folder.glob("*.whl")
    ZipFile(wheel).extractall(packages)
    return packages


def objects_of(scene):
    """The paths of the objects on the table."""
    return scene.root.find_all_matches("content/object*")


def vertices_of(path):
    """All vertices at and below a path in world space, shape (n, 3)."""
    parts = []
    for visit in iter_visible(path):
        if isinstance(visit.node, GeomNode):
            for geom, _ in visit.node.geoms:
                used = geom.vertices[np.unique(geom.triangles)]
                parts.append(used @ visit.net[:3, :3] + visit.net[3, :3])
    return np.concatenate(parts)


def overlapping(objects):
    """The pairs of names, of a dict of vertices, whose convex hulls intersect: all that could touch."""
    manager = CollisionManager()
    for name, vertices in objects.items():
        hull = Trimesh(vertices, ConvexHull(vertices).simplices, process=False)
        hull.remove_unreferenced_vertices()
        manager.add_object(name, hull)
    return manager.in_collision_internal(return_names=True)[1]

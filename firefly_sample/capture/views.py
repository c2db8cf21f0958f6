"""The views of a capture: the cameras that see each moment, as a value that can be compared and pickled.

Frame ``moment * len(views) + view`` shows a moment from a view. `firefly_sample.capture.viewed_scene` puts a
scene's camera there.
"""

from __future__ import annotations

import math
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from firefly_sample.camera import pose_from_matrix
from firefly_sample.errors import OutputError
from firefly_sample.plan.view import camera_matrices
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.other_camera import pivot_distance
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.transform_state import TransformState

if TYPE_CHECKING:
    from firefly_sample.capture.view_lens import ViewLens

MOST_VIEWS = 100_000
_EXAMPLES = "'orbit:24' for 24 cameras around the scene, or the path of a JSON file with poses, 'poses.json'"


class Views(ABC):
    """Cameras that see the same moment. Subclasses are frozen values."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def as_json(self) -> dict[str, Any]:
        """Return plain values of which `parse_views` makes equal views."""

    @abstractmethod
    def transform(self, view: int, scene: Scene, focus: Float64 | None) -> TransformState:
        """Return the transform from a view's camera to the world.

        `scene` is at its moment, and has its own camera; `focus` is the point that an orbit goes around.
        """

    @abstractmethod
    def lens(self, view: int) -> ViewLens | None:
        """Return the lens of a view; None for that of the scene's own camera."""

    @abstractmethod
    def check_size(self, size: tuple[int, int]) -> None:
        """Raise an OutputError if a view's intrinsics are for pictures of another shape."""


@dataclass(frozen=True)
class OrbitViews(Views):
    """The scene's own camera, and it turned around the vertical axis through the focus.

    View k is turned by ``360 * k / count`` degrees, counter-clockwise seen from above. It looks at the same
    point of that axis from the same height and distance. The axis goes through the point of the view axis
    that is as far ahead as the focus.
    """

    count: int

    def __len__(self) -> int:
        return self.count

    def as_json(self) -> dict[str, Any]:
        """Return the number of cameras."""
        return {"orbit": self.count}

    def transform(self, view: int, scene: Scene, focus: Float64 | None) -> TransformState:
        """Return the transform from a view's camera to the world: see `Views.transform`."""
        turn = range(self.count)[view]
        if turn == 0:
            return scene.camera.get_net_transform()
        matrix = camera_matrices(scene).view_to_world
        eye, forward = matrix[3, :3], matrix[1, :3]
        pivot = eye + pivot_distance(scene, focus, eye, forward) * forward
        return TransformState.make_mat(_turned(matrix, pivot[:2], turn, self.count))

    def lens(self, view: int) -> ViewLens | None:
        """Return None: all views have the lens of the scene's own camera."""
        return None

    def check_size(self, size: tuple[int, int]) -> None:
        """Accept every size: the lens is the scene's own."""


def _turned(matrix: Float64, pivot: Float64, part: int, parts: int) -> Float64:
    """Return a matrix turned by parts of a full turn about the vertical axis through (x, y)."""
    quarter, rest = divmod(4 * part, parts)  # quarter turns are exact
    angle = 0.5 * math.pi * rest / parts
    cos, sin = math.cos(angle), math.sin(angle)
    cos, sin = ((cos, sin), (-sin, cos), (-cos, -sin), (sin, -cos))[quarter]
    turn = np.array([[cos, sin], [-sin, cos]])
    turned = matrix.copy()
    turned[:3, :2] = matrix[:3, :2] @ turn
    turned[3, :2] = (matrix[3, :2] - pivot) @ turn + pivot
    return turned


@dataclass(frozen=True)
class ListedViews(Views):
    """Cameras at given poses. Bytes are compared, hashed and pickled faster than numbers.

    Attributes
    ----------
    matrices : bytes
        Of float64, shape (n, 4, 4): from each camera to the world, for row vectors.
    which : bytes
        Of int32, shape (n,): each camera's index into `lenses`.
    lenses : tuple of (ViewLens or None)
        Each once.
    source : str
        What errors name.
    """

    matrices: bytes = field(repr=False)
    which: bytes = field(repr=False)
    lenses: tuple[ViewLens | None, ...]
    source: str = field(compare=False)

    def __len__(self) -> int:
        return len(self.which) // 4

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if not name.startswith("_")}

    @cached_property
    def _matrices(self) -> Float64:
        return np.frombuffer(self.matrices, dtype=np.float64).reshape(-1, 4, 4)

    def transform(self, view: int, scene: Scene, focus: Float64 | None) -> TransformState:
        """Return the transform from a view's camera to the world."""
        return TransformState.make_mat(self._matrices[range(len(self))[view]])

    def _lens_index(self, view: int) -> int:
        return int(np.frombuffer(self.which, dtype=np.int32)[view])

    def lens(self, view: int) -> ViewLens | None:
        """Return the lens of a view; None for that of the scene's own camera."""
        return self.lenses[self._lens_index(view)]

    def check_size(self, size: tuple[int, int]) -> None:
        """Raise an OutputError if a view's intrinsics are for pictures of another shape."""
        width, height = size
        which = np.frombuffer(self.which, dtype=np.int32)
        for index, lens in enumerate(self.lenses):
            if lens is not None and lens.intrinsics is not None and not lens.fits(size):
                own = lens.intrinsics.size
                raise OutputError(
                    f"{self.source}: view {int(np.argmax(which == index))}: 'width' and 'height' are "
                    f"{own[0]}x{own[1]}, and pictures of {width}x{height} have another shape: capture at "
                    f"--size {own[0]}x{own[1]} or a multiple"
                )

    def as_json(self) -> dict[str, Any]:
        """Return poses and lenses, as a file of views has them; a lens that all share stands at the top."""
        shared = self.lenses[0] if len(self.lenses) == 1 else None
        views = []
        for view, matrix in enumerate(self._matrices):
            lens = None if shared is not None else self.lens(view)
            pose = pose_from_matrix(matrix, "panda3d").tolist()
            views.append({**({} if lens is None else lens.as_json()), "camera_to_world": {"panda3d": pose}})
        return {**({} if shared is None else shared.as_json()), "views": views}


def parse_views(views: object) -> Views:
    """Return the views of "orbit:24", of the path of a JSON file, or of such a file's content.

    For files see `firefly_sample.capture.view_files.read_views`. Views are returned as they are.

    Raises
    ------
    OutputError
        If the text or the content is wrong, or a file cannot be read.
    """
    from firefly_sample.capture.view_files import listed_views, read_views

    if isinstance(views, Views):
        return views
    if isinstance(views, Mapping) and views.keys() == {"orbit"}:
        return _orbit(views["orbit"], views)
    if isinstance(views, Mapping | list | tuple):
        return listed_views(views, "views")
    text = views.strip() if isinstance(views, str) else ""
    if match := re.fullmatch(r"orbit:(\d{1,9})", text, re.ASCII):
        return _orbit(int(match[1]), views)
    if isinstance(views, os.PathLike) or (isinstance(views, str) and text and os.path.exists(views)):
        return read_views(views)
    if text.startswith("orbit"):
        return _orbit(None, views)
    missing = ", and there is no such file" if text else ""
    raise OutputError(f"views must be {_EXAMPLES}; got {views!r}{missing}")


def _orbit(count: object, given: object) -> OrbitViews:
    if isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= MOST_VIEWS:
        return OrbitViews(count)
    raise OutputError(
        f"an orbit has 1 to {MOST_VIEWS:,} cameras, for example 'orbit:24' for one every 15 degrees, got "
        f"{given!r}"
    )

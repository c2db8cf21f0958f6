"""Cameras from JSON: our own form, a NeRF's ``transforms.json``, and the manifest of a capture.

The form follows from the keys:

- a list, or ``{"views": [...]}``: our own. A camera has "camera_to_world" with its pose in one convention of
  `firefly_sample.camera` or several, and may have the keys of `Intrinsics.as_dict`, or "camera_angle_x". Such
  keys beside "views" count for all cameras that lack them.
- ``{"frames": [{"transform_matrix": ...}]}``: NeRF's, with OpenGL's poses. The lens is "fl_x", "fl_y", "cx",
  "cy", "w", "h" or "camera_angle_x", at the top or in a frame; cx and cy count from the picture's corner.
- ``{"frames": [{"camera": ...}]}``, also in "captures": a manifest. Its views are the distinct cameras of its
  frames, in order.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.camera import CONVENTIONS, FrameCamera, matrix_from_poses
from firefly_sample.capture.view_lens import ANGLE, LENS_KEYS, ViewLens, lens_of
from firefly_sample.capture.views import MOST_VIEWS, ListedViews
from firefly_sample.errors import LensError, OutputError, SceneError, did_you_mean
from firefly_sample.scene.arrays import LARGEST, Float64
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.settings import number_or_none

_POSE = "camera_to_world"
_DISTORTION = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
_PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL", "RADIAL")
"""NeRF's camera models that are a pinhole's where the distortion is 0."""


class Camera(NamedTuple):
    """A view's matrix for row vectors, shape (4, 4), and its lens."""

    matrix: Float64
    lens: ViewLens | None


def read_views(file: str | os.PathLike[str]) -> ListedViews:
    """Return the views of a JSON file in one of the forms of this module.

    Raises
    ------
    OutputError
        If it cannot be read, or something in it is wrong: the message names the file, the view and the key.
    """
    path = Path(file)
    try:
        content = json.loads(path.read_bytes())
    except OSError as error:
        raise OutputError(f"cannot read the views of {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise OutputError(f"{path}: views must be JSON, and this is not: {error}") from None
    return listed_views(content, str(path))


def listed_views(content: object, source: str) -> ListedViews:
    """Return the views of such a file's content; errors begin with `source`."""
    lenses: dict[ViewLens | None, int] = {}
    try:
        cameras = list(_cameras(content))
        _check_count(cameras)
        which = [lenses.setdefault(camera.lens, len(lenses)) for camera in cameras]
        for lens, index in lenses.items():
            with _naming(f"view {which.index(index)}"):
                if lens is not None:
                    lens.make(PerspectiveLens())  # one that is too extreme for float64 is refused here
    except SceneError as error:
        raise OutputError(f"{source}: {error}") from None
    matrices = np.array([camera.matrix for camera in cameras])
    return ListedViews(matrices.tobytes(), np.array(which, np.int32).tobytes(), tuple(lenses), source)


def _cameras(content: object) -> Iterator[Camera]:
    """Yield the cameras of a file; a SceneError says what is wrong."""
    if isinstance(content, list | tuple):
        return _own({}, content)
    if isinstance(content, Mapping):
        if "captures" in content:
            parts = [_object(part, "a capture") for part in _list(content, "captures")]
            return _recorded([frame for part in parts for frame in _list(part, "frames")])
        if "frames" in content:
            frames = _list(content, "frames")
            keys = {key for frame in frames if isinstance(frame, Mapping) for key in frame}
            if "transform_matrix" in keys:
                return _nerf(content, frames)
            if "camera" in keys or not frames:
                return _recorded(frames)
            raise SceneError(
                "its 'frames' have neither 'transform_matrix' (NeRF) nor 'camera' (a manifest): if it is the "
                "manifest of an earlier version, capture again"
            )
        if "views" in content:
            shared = {key: value for key, value in content.items() if key != "views"}
            _check_keys("beside 'views'", shared, LENS_KEYS)
            return _own(shared, _list(content, "views"))
    raise SceneError(
        "there are no views: it must be a list of cameras, an object with 'views', a NeRF's transforms.json "
        "or a manifest.json"
    )


def _check_count(cameras: Sequence[Any]) -> None:
    if not 1 <= len(cameras) <= MOST_VIEWS:
        raise SceneError(f"there must be 1 to {MOST_VIEWS:,} views, got {len(cameras):,}")


def _own(shared: Mapping[str, Any], cameras: Any) -> Iterator[Camera]:
    _check_count(cameras)  # before the first is read: a hundred thousand take many seconds
    for number, given in enumerate(cameras):
        with _naming(f"view {number}"):
            camera = given.as_dict() if isinstance(given, FrameCamera) else _object(given, "a camera")
            yield _camera(shared, camera)


def _recorded(frames: list[Any]) -> Iterator[Camera]:
    """Yield the distinct cameras of a manifest's frames."""
    seen = set()
    for number, given in enumerate(frames):
        with _naming(f"frame {given.get('index', number) if isinstance(given, Mapping) else number}"):
            camera = _camera({}, _object(_get(_object(given, "a frame"), "camera"), "'camera'"))
        key = camera.matrix.tobytes(), camera.lens
        if key not in seen:
            seen.add(key)
            yield camera


def _camera(shared: Mapping[str, Any], given: Mapping[str, Any]) -> Camera:
    _check_keys("in a camera", given, (_POSE, *LENS_KEYS))
    poses = _object(_get(given, _POSE), f"{_POSE!r}")
    _check_keys(f"in {_POSE!r}", poses, CONVENTIONS)
    if not poses:
        raise SceneError(f"{_POSE!r} has no pose: give one of {', '.join(CONVENTIONS)}")
    matrix = _matrix(_POSE, poses)
    return Camera(matrix, lens_of({**shared, **given}))


def _nerf(top: Mapping[str, Any], frames: list[Any]) -> Iterator[Camera]:
    _check_count(frames)
    for number, given in enumerate(frames):
        with _naming(f"view {number}"):
            frame = _object(given, "a frame")
            matrix = _matrix("transform_matrix", {"opengl": _get(frame, "transform_matrix")})
            yield Camera(matrix, _nerf_lens({**top, **frame}))


def _nerf_lens(given: Mapping[str, Any]) -> ViewLens | None:
    """Return the lens of a NeRF's frame, with what stands at the top; None if it says nothing of one."""
    for name in _DISTORTION:
        if given.get(name, 0) != 0:
            raise SceneError(f"{name!r} is {_short(given[name])}, and no lens with distortion is drawn")
    model = given.get("camera_model", _PINHOLES[0])
    if given.get("is_fisheye") or model not in _PINHOLES:
        key = "is_fisheye" if given.get("is_fisheye") else "camera_model"
        raise SceneError(f"{key!r} is {_short(given[key])}, and only pinhole cameras are drawn")
    if "fl_x" not in given and ANGLE not in given:
        return None
    if "fl_x" not in given and "w" not in given and "h" not in given:
        return lens_of({ANGLE: given[ANGLE]})
    width, height = _pixels(given, "w"), _pixels(given, "h")
    fl_x = _number(given, "fl_x", above=0) if "fl_x" in given else _focal(width, given, ANGLE)
    fl_y = _focal(height, given, "camera_angle_y") if "camera_angle_y" in given else fl_x
    return lens_of(
        {
            "width": width,
            "height": height,
            "fx": fl_x,
            "fy": _number(given, "fl_y", above=0) if "fl_y" in given else fl_y,
            "cx": _number(given, "cx") if "cx" in given else 0.5 * width,
            "cy": _number(given, "cy") if "cy" in given else 0.5 * height,
            "pixel_center": 0.5,
        }
    )


def _focal(length: float, given: Mapping[str, Any], key: str) -> float:
    """Return the focal length in pixels of an angle in radians over a picture's width or height."""
    angle = _number(given, key)
    if not 0.0 < angle < math.pi:
        raise SceneError(f"{key!r} must be an angle between 0 and pi radians, got {angle!r}")
    return 0.5 * length / math.tan(0.5 * angle)


def _matrix(key: str, poses: Mapping[str, Any]) -> Float64:
    """Return the matrix of poses that stand at a key, by convention."""
    try:
        matrix = matrix_from_poses(poses)
    except SceneError as error:
        raise SceneError(f"{key!r}: {error}") from None
    if np.abs(matrix[3, :3]).max() > LARGEST:
        raise SceneError(f"{key!r}: its position must be at most {LARGEST:g} units along each axis")
    return matrix


@contextmanager
def _naming(name: str) -> Iterator[None]:
    """Put a name in front of the messages of errors in the block."""
    try:
        yield
    except LensError as error:
        raise SceneError(f"{name}: its lens: {error}") from None
    except SceneError as error:
        raise SceneError(f"{name}: {error}") from None


def _object(given: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        raise SceneError(f"{what} must be an object, got {_short(given)}")
    return given


def _list(given: Mapping[str, Any], key: str) -> list[Any]:
    value = _get(given, key)
    if not isinstance(value, list | tuple):
        raise SceneError(f"{key!r} must be a list, got {_short(value)}")
    return list(value)


def _number(given: Mapping[str, Any], key: str, above: float = -math.inf) -> float:
    value = _get(given, key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SceneError(f"{key!r} must be a number, got {_short(value)}")
    found = number_or_none(value)  # of an integer that is too large for a float, None
    if found is None or not above < found < math.inf:
        bound = "a finite number" if above == -math.inf else f"a finite number above {above:g}"
        raise SceneError(f"{key!r} must be {bound}, got {_short(value)}")
    return found


def _pixels(given: Mapping[str, Any], key: str) -> int:
    value = _number(given, key, above=0)
    if value != int(value):
        raise SceneError(f"{key!r} must be a whole number of pixels, got {value!r}")
    return int(value)


def _get(given: Mapping[str, Any], key: str) -> Any:
    if key not in given:
        raise SceneError(f"{key!r} is missing")
    return given[key]


def _check_keys(where: str, given: Mapping[str, Any], known: tuple[str, ...]) -> None:
    for key in given:
        if key not in known:
            raise SceneError(f"there is no key {key!r} {where}{did_you_mean(key, known)}")


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."

"""What a render gives: named images, each with its space, unit and invalid value, and how it was made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError, did_you_mean
from firefly_sample.settings import to_whole

Image = NDArray[np.uint8] | NDArray[np.int32] | NDArray[np.float32]


@dataclass(frozen=True)
class OutputInfo:
    """What one image of a `Frame` holds.

    Attributes
    ----------
    dtype : str
        NumPy's name.
    channels : int
        1 means shape (height, width), otherwise (height, width, channels).
    space, unit, invalid : str
        The space of its values, their unit, and the value where nothing was drawn.
    sampled : bool
        True if its values are point samples at pixel centres, which no average can replace.
    help : str
        One sentence.
    """

    dtype: str
    channels: int
    space: str
    unit: str
    invalid: str
    sampled: bool
    help: str


OUTPUTS: dict[str, OutputInfo] = {
    "color": OutputInfo(
        "uint8",
        3,
        "display",
        "sRGB code",
        "the background",
        False,
        "the picture after exposure, tone curve and sRGB",
    ),
    "radiance": OutputInfo(
        "float32",
        3,
        "scene",
        "linear radiance",
        "the background",
        False,
        "the picture before exposure and tone curve",
    ),
    "albedo": OutputInfo(
        "float32", 3, "surface", "linear reflectance 0..1", "0", True, "diffuse base colour"
    ),
    "normal": OutputInfo(
        "float32",
        3,
        "view",
        "unit vector",
        "(0, 0, 0)",
        True,
        "normal, turned to the eye on two-sided surfaces",
    ),
    "normal_world": OutputInfo(
        "float32", 3, "world", "unit vector", "(0, 0, 0)", True, "the same in world space"
    ),
    "depth": OutputInfo(
        "float32", 1, "view", "scene units", "inf", True, "distance along the view axis (not along the ray)"
    ),
    "position": OutputInfo("float32", 3, "view", "scene units", "NaN", True, "surface position"),
    "position_world": OutputInfo(
        "float32",
        3,
        "world",
        "scene units",
        "NaN",
        True,
        "surface position; float32 is coarse far from the origin",
    ),
    "id": OutputInfo(
        "int32",
        1,
        "scene",
        "index into Frame.id_names",
        "-1",
        True,
        "which geometry instance, counted over what is not hidden",
    ),
    "visibility": OutputInfo(
        "int32",
        2,
        "scene",
        "instance drawn, triangle of its mesh",
        "-1",
        True,
        "which triangle of which instance, counted in the frame's drawing order",
    ),
    "specular": OutputInfo(
        "float32", 3, "surface", "linear reflectance 0..1", "0", True, "colour of highlights"
    ),
    "shininess": OutputInfo("float32", 1, "surface", "exponent 0..1e6", "0", True, "exponent of highlights"),
    "emission": OutputInfo(
        "float32", 3, "scene", "linear radiance", "0", True, "what surfaces give off by themselves"
    ),
    "light": OutputInfo(
        "float32",
        3,
        "scene",
        "linear radiance",
        "0",
        True,
        "light alone: what white surfaces without highlights would show",
    ),
    "overdraw": OutputInfo(
        "int32",
        1,
        "screen",
        "fragments",
        "none: it counts there too",
        True,
        "how often the passes of light shade a pixel",
    ),
    "volumes": OutputInfo(
        "uint8",
        3,
        "display",
        "code",
        "0",
        True,
        "light volumes where they shade, as flat colours that add up",
    ),
    "wireframe": OutputInfo(
        "uint8", 3, "display", "code", "0", True, "edges of the light volumes that can be seen"
    ),
    "shadow_atlas": OutputInfo(
        "float32",
        1,
        "light",
        "depth 0..1",
        "0 (1 with position=depth24)",
        True,
        "all shadow maps, in a size of their own, 0x0 without any: 1 is near the light (else reversed)",
    ),
    "particle_shadow_atlas": OutputInfo(
        "float32",
        3,
        "light",
        "optical depth, or sum of alphas",
        "0",
        True,
        "what particles take of their light up to each slice, in a size of its own, 0x0 without any",
    ),
}
"""Every output by name, in the order in which they are listed to people."""


@dataclass(frozen=True)
class LightCounts:
    """Where a frame's lights went.

    Attributes
    ----------
    in_scene : int
        Lights that are attached and not hidden.
    in_view : int
        Those whose volume meets the view and that can change it; these are drawn.
    dropped : int
        Lights in view that were not drawn: 0, always; it is counted so that it can be checked.
    """

    in_scene: int
    in_view: int
    dropped: int


@dataclass(frozen=True, eq=False)
class Frame:
    """One rendered frame. Images are arrays whose first row is the top of the picture.

    Each image is an attribute and an item: ``frame.color`` and ``frame["color"]``. See `OUTPUTS` for
    dtype, shape, space, unit and invalid value. All are as large as the picture but the two atlases.

    Attributes
    ----------
    images : dict of str to ndarray
        The outputs that were asked for.
    time : float
        Seconds.
    size : (int, int)
        Width and height in pixels.
    milliseconds : dict of str to float
        Time of each pass, in drawing order; see `firefly_sample.gpu.timers`.
    shaded : int or None
        What the passes of light shaded, where the renderer was told to count: fragments, and of clusters the
        lights in the lists of all pixels.
    lights : LightCounts
        Lights in the scene, in view and dropped.
    driver : str
        The GL renderer string.
    software : bool
        True if that is a software rasteriser.
    draw_calls : int
        How often OpenGL was told to draw.
    id_names : tuple of str
        The geometry instance behind each value of the output "id": the names from the root down to its
        node, joined by slashes. The second node of a name below its parent has "#2" after it, the third "#3".
    warnings : tuple of str
        What the plan has to say, for example blended materials that were drawn as cut-outs.
    """

    images: dict[str, Image]
    time: float
    size: tuple[int, int]
    milliseconds: dict[str, float]
    lights: LightCounts
    driver: str
    software: bool
    shaded: int | None = None
    draw_calls: int = 0
    id_names: tuple[str, ...] = ()
    warnings: tuple[str, ...] = field(default=())

    def __getitem__(self, output: str) -> Image:
        try:
            return self.images[output]
        except KeyError:
            _check_name(output)
            have = ", ".join(self.images)
            raise OutputError(
                f"this frame has no {output!r}: it was rendered with outputs {have}; add {output!r} to them"
            ) from None

    def __getattr__(self, name: str) -> Image:
        if name in OUTPUTS:
            return self[name]
        raise AttributeError(f"a frame has no attribute {name!r}{did_you_mean(name, OUTPUTS)}")


def check_outputs(outputs: Iterable[str], supersample: int = 1) -> tuple[str, ...]:
    """`outputs` as a tuple without repetitions, in the given order.

    Raises
    ------
    OutputError
        If one does not exist, none is given, or point samples are asked for with supersampling.
    """
    names = tuple(dict.fromkeys([outputs] if isinstance(outputs, str) else outputs))
    if not names:
        raise OutputError(f"no outputs were asked for: choose from {', '.join(OUTPUTS)}")
    for name in names:
        _check_name(name)
        if supersample != 1 and OUTPUTS[name].sampled:
            raise OutputError(
                f"output {name!r} is a sample at the pixel's centre and cannot be averaged: "
                f"set supersample to 1 (got {supersample}) or leave {name!r} out"
            )
    return names


def _check_name(name: str) -> None:
    if name not in OUTPUTS:
        raise OutputError(
            f"there is no output {name!r}{did_you_mean(name, OUTPUTS)}: choose from {', '.join(OUTPUTS)}"
        )


def check_size(size: tuple[int, int]) -> tuple[int, int]:
    """`size` (width, height) as whole numbers.

    Raises
    ------
    OutputError
        If it is not two whole numbers of 1 or more, or a side is above 2^20, which no driver draws.
    """
    try:
        width, height = map(to_whole, size)
    except (TypeError, ValueError):
        width = height = None
    if width is None or height is None or width < 1 or height < 1:
        raise OutputError(f"size must be two whole numbers of pixels, 1 or more, got {size!r}")
    if max(width, height) > 2**20:
        raise OutputError(f"size {width}x{height} is above any driver's limit: choose a smaller one")
    return width, height

"""A rendered frame: named images, each with its space, unit and invalid value, and how it was made."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError, did_you_mean
from firefly_sample.settings import to_whole
from firefly_sample.showing import png_bytes, show_picture

if TYPE_CHECKING:
    from firefly_sample.camera import FrameCamera

Image = NDArray[np.uint8] | NDArray[np.int32] | NDArray[np.float32]


@dataclass(frozen=True)
class OutputInfo:
    """The meaning of one image of a `Frame`.

    Attributes
    ----------
    dtype : str
        NumPy's name.
    channels : int
        1 means shape (height, width), otherwise (height, width, channels).
    space, unit, invalid : str
        The space of its values, their unit, and the value where nothing was drawn.
    help : str
        One sentence.
    sampled : bool
        True if its values are point samples at pixel centres, which must not be averaged.
    """

    dtype: str
    channels: int
    space: str
    unit: str
    invalid: str
    help: str
    sampled: bool = True


OUTPUTS: dict[str, OutputInfo] = {
    "color": OutputInfo(
        "uint8",
        3,
        "display",
        "sRGB code",
        "the background",
        "the picture after exposure, tone curve and sRGB",
        sampled=False,
    ),
    "color_alpha": OutputInfo(
        "uint8",
        4,
        "display",
        "sRGB code, and alpha",
        "0",
        "the picture without its background, straight alpha",
        sampled=False,
    ),
    "radiance": OutputInfo(
        "float32",
        3,
        "scene",
        "linear radiance",
        "the background",
        "the picture before exposure and tone curve",
        sampled=False,
    ),
    "albedo": OutputInfo("float32", 3, "surface", "linear reflectance 0..1", "0", "diffuse base colour"),
    "normal": OutputInfo(
        "float32", 3, "view", "unit vector", "(0, 0, 0)", "normal; on two-sided surfaces it faces the eye"
    ),
    "normal_world": OutputInfo("float32", 3, "world", "unit vector", "(0, 0, 0)", "normal"),
    "depth": OutputInfo(
        "float32", 1, "view", "scene units", "inf", "distance along the view axis (not along the ray)"
    ),
    "position": OutputInfo("float32", 3, "view", "scene units", "NaN", "surface position"),
    "position_world": OutputInfo(
        "float32", 3, "world", "scene units", "NaN", "surface position; float32 is coarse far from the origin"
    ),
    "id": OutputInfo(
        "int32",
        1,
        "scene",
        "index into Frame.id_names",
        "-1",
        "number of the geometry instance; hidden instances have none",
    ),
    "visibility": OutputInfo(
        "int32",
        2,
        "scene",
        "two indices",
        "-1",
        "index of the instance in drawing order (not its id), and index of the triangle in its mesh",
    ),
    "specular": OutputInfo("float32", 3, "surface", "linear reflectance 0..1", "0", "colour of highlights"),
    "shininess": OutputInfo("float32", 1, "surface", "exponent 0..1e6", "0", "exponent of highlights"),
    "metallic": OutputInfo(
        "float32", 1, "surface", "share 0..1", "0", "share of a metal; 0 also of other materials"
    ),
    "roughness": OutputInfo(
        "float32", 1, "surface", "0..1", "0", "roughness of metallic-roughness materials; 0 of others"
    ),
    "emission": OutputInfo("float32", 3, "scene", "linear radiance", "0", "light that surfaces emit"),
    "light": OutputInfo(
        "float32", 3, "scene", "linear radiance", "0", "light as white surfaces without highlights show it"
    ),
    "overdraw": OutputInfo(
        "int32",
        1,
        "screen",
        "fragments",
        "counted there too",
        "how often the lighting passes shade a pixel",
    ),
    "volumes": OutputInfo(
        "uint8", 3, "display", "code", "0", "light volumes where they shade, as flat colours that are added"
    ),
    "wireframe": OutputInfo("uint8", 3, "display", "code", "0", "visible edges of the light volumes"),
    "shadow_atlas": OutputInfo(
        "float32",
        1,
        "light",
        "depth 0..1",
        "the value of far",
        "all shadow maps: 1 near the light and 0 far, or the reverse with a standard depth buffer; "
        "0x0 without any",
    ),
    "particle_shadow_atlas": OutputInfo(
        "float32",
        3,
        "light",
        "optical depth, or sum of alphas",
        "0",
        "sum of the particles' shadow from the light to each slice; 0x0 without any",
    ),
}
"""Every output by name, in the order in which they are listed to people."""


@dataclass(frozen=True)
class LightCounts:
    """Counts of a frame's lights.

    Attributes
    ----------
    in_scene : int
        Lights that are attached and not hidden.
    in_view : int
        Lights that can change a pixel of the view; these are drawn.
    dropped : int
        Lights in view that were not drawn: always 0, which can be checked.
    """

    in_scene: int
    in_view: int
    dropped: int


@dataclass(frozen=True, eq=False)
class Frame:
    """One rendered frame. Images are arrays whose first row is the top of the picture.

    Each image is an attribute and an item: ``frame.color`` and ``frame["color"]``. See `OUTPUTS` for
    dtype, shape, space, unit and invalid value. All but the two atlases have the size of the picture.

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
        How much the lighting passes shaded, if the renderer was told to count: fragments, or with clusters
        the lights in the lists of all pixels.
    lights : LightCounts
        Lights in the scene, in view and dropped.
    driver : str
        The GL renderer string.
    software : bool
        True if that is a software rasteriser.
    camera : FrameCamera
        The camera that the picture was drawn with: intrinsics and pose. With the output "depth" it gives
        points of the world: ``frame.camera.world_points(frame.depth)``.
    draw_calls : int
        The number of draw calls.
    id_names : tuple of str
        The geometry instance of each value of the output "id": the names from the root down to its node,
        joined by slashes. The second node of one name below a parent has "#2" after it, the third "#3".
    warnings : tuple of str
        Warnings of the plan, for example on blended materials that are drawn as cut-outs.
    """

    images: dict[str, Image]
    time: float
    size: tuple[int, int]
    milliseconds: dict[str, float]
    lights: LightCounts
    driver: str
    software: bool
    camera: FrameCamera = field(kw_only=True)
    shaded: int | None = None
    draw_calls: int = 0
    id_names: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        images = ", ".join(f"{name} {image.dtype} {image.shape}" for name, image in self.images.items())
        return (
            f"<Frame {self.size[0]}x{self.size[1]} at {self.time:g} s: {images or 'no images'};\n"
            f" {self.lights.in_view} of {self.lights.in_scene} lights in view; {self.driver}>"
        )

    def _repr_png_(self) -> bytes | None:
        """Return the picture as PNG, which notebooks show; None if all outputs are data."""
        output = self._picture()
        return None if output is None else png_bytes(self.images[output].astype(np.uint8, copy=False))

    def show(self, output: str | None = None) -> None:
        """Show the picture in the notebook, or with the desktop's program for pictures.

        Parameters
        ----------
        output : str, optional
            "color" when absent, or else "color_alpha", or else the first output of 8 bits. Outputs of other
            dtypes are data: ``matplotlib.pyplot.imshow(frame.depth)`` scales them.

        Raises
        ------
        OutputError
            If the frame does not have the output, or it is not a picture.
        ViewerError
            If the process has no display.
        """
        name = output if output is not None else self._picture() or "color"
        image = self[name]
        if image.dtype != np.uint8:
            raise OutputError(
                f"output {name!r} is {image.dtype} data and not a picture: show 'color', or scale it with "
                f"matplotlib.pyplot.imshow(frame.{name})"
            )
        show_picture(image.astype(np.uint8, copy=False), f"{name} at {self.time:g} s")

    def _picture(self) -> str | None:
        """Return the name of the output that shows what was drawn, or None if all are data."""
        shown = [name for name, image in self.images.items() if image.dtype == np.uint8]
        return next((name for name in ("color", "color_alpha", *shown) if name in shown), None)

    def __getitem__(self, output: str) -> Image:
        if output not in self.images:
            _check_name(output)
            raise OutputError(
                f"this frame has no {output!r}: it was rendered with outputs {', '.join(self.images)}; "
                f"add {output!r} to them"
            )
        return self.images[output]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.images]

    def __getattr__(self, name: str) -> Image:
        if name in OUTPUTS:
            return self[name]
        raise AttributeError(f"a frame has no attribute {name!r}{did_you_mean(name, OUTPUTS)}")

    def save(
        self,
        path: str | Path,
        output: str | None = None,
        *,
        quality: int | None = None,
        depth_scale: float | None = None,
    ) -> None:
        """Write the frame to a file, whole or not at all; the suffix decides on the format.

        Parameters
        ----------
        path : str or Path
            ``.png``, ``.webp``, ``.jpg`` and ``.jpeg`` hold one 8-bit picture, and ``.png`` also the output
            "depth" or "id" with 16 bits. ``.npz`` and ``.exr`` hold any number of the other outputs.
        output : str or None
            The output to write; None for the picture, or for all that ``.npz`` and ``.exr`` are for.
        quality : int or None
            1 to 100, of JPEG and WebP; None for JPEG's 95, and for WebP without loss.
        depth_scale : float or None
            Scene units of one code of a 16-bit depth; None for a thousandth.

        Raises
        ------
        OutputError
            If the format cannot hold the output or one of its values; the message says which one can.
        """
        from firefly_sample.encoding.saving import save_frame

        save_frame(self, path, output, quality, depth_scale)


def check_outputs(outputs: Iterable[str], supersample: int = 1) -> tuple[str, ...]:
    """Return `outputs` as a tuple without repetitions, in the given order.

    It raises `OutputError` if one does not exist, if there is none, or for point samples with supersampling.
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
    """Return `size` (width, height) as whole numbers, or raise `OutputError`.

    A side has 1 to 2^20 pixels, which is more than any driver draws.
    """
    width = height = None
    with suppress(TypeError, ValueError):
        width, height = map(to_whole, size)
    if width is None or height is None or width < 1 or height < 1:
        raise OutputError(f"size must be two whole numbers of pixels, 1 or more, got {size!r}")
    if max(width, height) > 2**20:
        raise OutputError(f"size {width}x{height} is above any driver's limit: choose a smaller one")
    return width, height

"""What a surface is made of: base colour, texture, cut-out alpha, sidedness."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import SceneError

__all__ = ["AlphaMode", "Material", "Texture"]

AlphaMode = Literal["opaque", "mask", "blend"]


class Texture:
    """An image that a material samples.

    Parameters
    ----------
    pixels : array_like of uint8, shape (height, width, 4)
        sRGB colour and linear alpha (coverage); the first row is the top of the picture.
    name : str
        Used in messages and in the plan.
    """

    def __init__(self, pixels: ArrayLike, name: str = "texture") -> None:
        self.name = name
        self.revision = 0
        self.set_pixels(pixels)

    def set_pixels(self, pixels: ArrayLike) -> None:
        """Replace the image, of any size; `pixels` is copied and then read-only.

        Raises
        ------
        SceneError
            If it has another shape.
        """
        image: NDArray[np.uint8] = np.array(pixels, dtype=np.uint8, order="C")
        if image.ndim != 3 or image.shape[2] != 4 or 0 in image.shape:
            raise SceneError(
                f"texture {self.name!r}: pixels must have shape (height, width, 4), got {image.shape}"
            )
        image.setflags(write=False)
        self.pixels = image
        self.revision += 1

    def __repr__(self) -> str:
        height, width = self.pixels.shape[:2]
        return f"Texture({self.name!r}, {width}x{height})"


class Material:
    """How a surface reflects light.

    Parameters
    ----------
    name : str
        Used in messages and in the plan.
    base_color : sequence of 4 floats
        Linear diffuse reflectance in 0..1, and opacity; multiplies the texture.
    texture : Texture, optional
        Base colour texture.
    alpha_mode : {"opaque", "mask", "blend"}
        "mask" cuts out what has less alpha than `alpha_cutoff`. Deferred shading keeps one surface a
        pixel, so "blend" is drawn as "mask" and the plan warns about it.
    alpha_cutoff : float
        The alpha below which a "mask" surface is not there.
    double_sided : bool
        Both sides are drawn and the normal is turned towards the eye.

    Raises
    ------
    SceneError
        If a number is not finite or out of its range.
    """

    def __init__(
        self,
        name: str = "material",
        base_color: ArrayLike = (1.0, 1.0, 1.0, 1.0),
        texture: Texture | None = None,
        alpha_mode: AlphaMode = "opaque",
        alpha_cutoff: float = 0.5,
        double_sided: bool = False,
    ) -> None:
        self.name = name
        self.texture = texture
        self.double_sided = double_sided
        if alpha_mode not in ("opaque", "mask", "blend"):
            raise SceneError(
                f"material {name!r}: alpha_mode must be 'opaque', 'mask' or 'blend', got {alpha_mode!r}"
            )
        self.alpha_mode: AlphaMode = alpha_mode
        if not 0.0 <= alpha_cutoff <= 1.0:
            raise SceneError(f"material {name!r}: alpha_cutoff must lie in 0..1, got {alpha_cutoff!r}")
        self.alpha_cutoff = float(alpha_cutoff)
        self.revision = 0
        self.set_base_color(base_color)

    def set_base_color(self, color: ArrayLike) -> None:
        """Set the linear base colour (r, g, b, a), each in 0..1."""
        rgba = np.array(color, dtype=np.float64)
        if rgba.shape != (4,) or not np.isfinite(rgba).all() or rgba.min() < 0 or rgba.max() > 1:
            raise SceneError(
                f"material {self.name!r}: base_color must be four numbers in 0..1, got {color!r}"
            )
        self.base_color = rgba
        self.revision += 1

    def __repr__(self) -> str:
        return f"Material({self.name!r})"

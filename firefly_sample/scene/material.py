"""Materials of surfaces, and their textures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import (
    LARGEST,
    Float64,
    ReadOnlyArrays,
    as_codes,
    as_color,
    as_colors,
    new_serial,
    read_only,
)
from firefly_sample.settings import to_number

AlphaMode = Literal["opaque", "mask", "blend"]
Wrap = Literal["repeat", "clamp", "mirror"]
MagFilter = Literal["nearest", "linear"]
MinFilter = Literal[
    "nearest",
    "linear",
    "nearest_mipmap_nearest",
    "linear_mipmap_nearest",
    "nearest_mipmap_linear",
    "linear_mipmap_linear",
]

LARGEST_SHININESS = 1e6
"""The G-buffer stores the logarithm of shininess, up to this value."""
LARGEST_SCALE = 1e3
"""Of a normal map, either way."""


_Choice = TypeVar("_Choice", Wrap, MinFilter, MagFilter)


class Sampling(NamedTuple):
    """The wrap modes and filters of a `Texture`."""

    wrap_u: Wrap
    wrap_v: Wrap
    minfilter: MinFilter
    magfilter: MagFilter


class Texture(ReadOnlyArrays):
    """An image for a material, and how it is sampled.

    Parameters
    ----------
    pixels : array_like, shape (height, width, 4)
        sRGB colour and linear alpha (coverage) in 8 bits; the first row is the top of the picture. uint16,
        floats of 0 to 1 and bool are rounded to 8 bits: see `firefly_sample.scene.arrays`.
    name : str
    wrap_u, wrap_v : {"repeat", "clamp", "mirror"}
        What happens beyond the image, across and up: it repeats, its edge goes on, or it repeats and every
        second copy is mirrored.
    minfilter : {"nearest", "linear", "nearest_mipmap_nearest", "linear_mipmap_nearest", \
"nearest_mipmap_linear", "linear_mipmap_linear"}
        The filter of texels that are smaller than a pixel, by OpenGL's names: first the filter within a
        mipmap level, then whether the nearest level is taken or two are mixed.
    magfilter : {"nearest", "linear"}
        The filter of texels that are larger than a pixel.

    Two textures may share an image and differ in their sampling: ``copy.copy`` makes such a second one.

    Attributes
    ----------
    serial, revision : int
        As of a `Geom`; the sampling counts as well.
    size : (int, int)
        Width and height.
    digest : str or None
        A hash of the pixels if the image came from a file, under which derived data is cached: see
        `firefly_sample.disk_cache`.
    """

    digest: str | None
    size: tuple[int, int]
    _pixels: NDArray[np.uint8] | None
    _decode: Callable[[], NDArray[np.uint8]] | None
    _least_alpha: float | None = None

    def __init__(
        self,
        pixels: ArrayLike,
        name: str = "texture",
        *,
        wrap_u: Wrap = "repeat",
        wrap_v: Wrap = "repeat",
        minfilter: MinFilter = "linear_mipmap_linear",
        magfilter: MagFilter = "linear",
    ) -> None:
        self.name = name
        self.serial = new_serial()
        self.revision = 0
        self._set_sampling(wrap_u, wrap_v, minfilter, magfilter)
        self.set_pixels(pixels)

    @classmethod
    def from_file(
        cls,
        decode: Callable[[], NDArray[np.uint8]],
        size: tuple[int, int],
        digest: str | None,
        name: str,
        *,
        wrap_u: Wrap = "repeat",
        wrap_v: Wrap = "repeat",
        minfilter: MinFilter = "linear_mipmap_linear",
        magfilter: MagFilter = "linear",
    ) -> Texture:
        """Return a texture whose pixels, of this size, are decoded when they are first needed.

        `decode` is called at most once; with cached mipmaps the pixels are not needed.
        """
        texture = cls.__new__(cls)
        texture.name, texture.size, texture.digest = name, size, digest
        texture.serial, texture.revision = new_serial(), 1
        texture._pixels, texture._decode = None, decode
        texture._set_sampling(wrap_u, wrap_v, minfilter, magfilter)
        return texture

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """The image, read-only."""
        if self._decode is not None:
            self._pixels, self._decode = self._checked(self._decode()), None
        assert self._pixels is not None
        return self._pixels

    def set_pixels(self, pixels: ArrayLike) -> None:
        """Replace the image, of any size; `pixels` is copied and then read-only."""
        image = self._checked(pixels)
        self._pixels, self._decode, self._least_alpha = image, None, None
        self.digest = None
        self.size = (image.shape[1], image.shape[0])
        self.revision += 1

    def set_wrap_u(self, wrap: Wrap) -> None:
        """Set what happens beyond the image's left and right edges."""
        self._set_sampling(wrap, self.wrap_v, self.minfilter, self.magfilter)
        self.revision += 1

    def set_wrap_v(self, wrap: Wrap) -> None:
        """Set what happens beyond the image's lower and upper edges."""
        self._set_sampling(self.wrap_u, wrap, self.minfilter, self.magfilter)
        self.revision += 1

    def set_minfilter(self, minfilter: MinFilter) -> None:
        """Set the filter of texels that are smaller than a pixel."""
        self._set_sampling(self.wrap_u, self.wrap_v, minfilter, self.magfilter)
        self.revision += 1

    def set_magfilter(self, magfilter: MagFilter) -> None:
        """Set the filter of texels that are larger than a pixel."""
        self._set_sampling(self.wrap_u, self.wrap_v, self.minfilter, magfilter)
        self.revision += 1

    def _set_sampling(self, wrap_u: Wrap, wrap_v: Wrap, minfilter: MinFilter, magfilter: MagFilter) -> None:
        self.wrap_u: Wrap = self._choice("wrap_u", wrap_u, get_args(Wrap))
        self.wrap_v: Wrap = self._choice("wrap_v", wrap_v, get_args(Wrap))
        self.minfilter: MinFilter = self._choice("minfilter", minfilter, get_args(MinFilter))
        self.magfilter: MagFilter = self._choice("magfilter", magfilter, get_args(MagFilter))

    @property
    def sampling(self) -> Sampling:
        """All four settings as one hashable value."""
        return Sampling(self.wrap_u, self.wrap_v, self.minfilter, self.magfilter)

    def _choice(self, what: str, given: _Choice, choices: tuple[_Choice, ...]) -> _Choice:
        if not isinstance(given, str) or given not in choices:
            *others, last = map(repr, choices)
            raise SceneError(
                f"texture {self.name!r}: {what} must be {', '.join(others)} or {last}, got {given!r}"
            )
        return given

    def least_alpha(self) -> float:
        """Return the smallest alpha of all texels, 0..1; it is computed once per image."""
        if self._least_alpha is None:
            self._least_alpha = int(self.pixels[..., 3].min()) / 255.0
        return self._least_alpha

    def _checked(self, pixels: ArrayLike) -> NDArray[np.uint8]:
        what = f"texture {self.name!r}: pixels"
        image = as_codes(what, pixels)
        if image.ndim != 3 or image.shape[2] != 4 or 0 in image.shape:
            raise SceneError(f"{what} must have shape (height, width, 4), got {image.shape}")
        return read_only(image)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state with decoded pixels: another process may lack the function that decodes them."""
        return self.__dict__ | {"_pixels": self.pixels, "_decode": None}

    def __copy__(self) -> Texture:
        twin = type(self).__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin.serial = new_serial()
        return twin

    def __deepcopy__(self, _: dict[int, Any]) -> Texture:
        return self.__copy__()  # its pixels are never changed, only replaced

    def __repr__(self) -> str:
        return f"Texture({self.name!r}, {self.size[0]}x{self.size[1]})"


class Material(ReadOnlyArrays):
    """The light that a surface reflects and emits, by one of two models, or by none.

    A Phong material's radiance is ambient + diffuse + specular + emission: ambient light times `ambient` and
    the texture; each light times `base_color`, the texture and the cosine of its angle; each light's
    highlight times `specular`; and `emission` times the emission texture.

    With `metallic`, it is a metallic-roughness material, as glTF 2.0 has them (appendix B): base colour,
    `metallic` and `roughness` decide all that it reflects, and `ambient`, `specular` and `shininess` must be
    left out. With `unlit`, a surface shows its base colour as it is, and no light meets it.

    Parameters
    ----------
    name : str
    base_color : sequence of 4 floats
        Linear diffuse reflectance in 0..1, and opacity; multiplies the texture.
    texture : Texture, optional
    alpha_mode : {"opaque", "mask", "blend"}
        "mask" cuts out fragments whose alpha, the product of those of base colour, texture and vertex
        colours, is below `alpha_cutoff`. "blend" lets through what is behind, by 1 - alpha: see
        `Settings.transparency`.
    alpha_cutoff : float
        Blended surfaces cast shadows where their alpha is not below it.
    double_sided : bool
        Draw both sides, and turn the normal towards the eye.
    ambient : sequence of 3 floats, optional
        Linear reflectance of ambient light in 0..1, which multiplies the texture; `base_color` when absent.
    emission : sequence of 3 floats
        Linear radiance that the surface emits, 0 or more.
    specular : sequence of 3 floats
        Linear reflectance of highlights in 0..1; black ones cost nothing.
    shininess : float
        The exponent of highlights, 0 to 1e6: the larger, the smaller the highlight. See
        `Settings.specular_model`.
    emission_texture : Texture, optional
        Its colours multiply `emission`; its alpha does not matter.
    emission_texcoord : {0, 1}
        The texture coordinates of the emission texture: a Geom's `texcoords`, or its `texcoords_1` if it has
        those.
    metallic : float, optional
        The share of a metal, 0 to 1: a metal reflects in its base colour, and nothing diffusely. A material
        with a number is a metallic-roughness one, even if it is 0.
    roughness : float
        0 to 1, of a metallic-roughness material: 0 is a mirror. Below 1/32 it is drawn as 1/32.
    metallic_roughness_texture : Texture, optional
        Its green multiplies `roughness`, its blue `metallic`; its numbers are linear as stored.
    normal_texture : Texture, optional
        Normals in tangent space, n/2 + 1/2, linear as stored: x along the Geom's tangents, y along its
        bitangents, z along its normals (glTF 2.0, section 3.9.3).
    normal_scale : float
        Multiplies x and y of these normals.
    occlusion_texture : Texture, optional
        Its red, linear as stored, multiplies ambient light.
    occlusion_strength : float
        0 to 1: the multiplier is 1 + strength * (red - 1).
    metallic_roughness_texcoord, normal_texcoord, occlusion_texcoord : {0, 1}
        As `emission_texcoord`.
    unlit : bool

    Raises
    ------
    SceneError
        Also by the setters, if a number is not finite or out of its range.
    """

    def __init__(
        self,
        name: str = "material",
        base_color: ArrayLike = (1.0, 1.0, 1.0, 1.0),
        texture: Texture | None = None,
        alpha_mode: AlphaMode = "opaque",
        alpha_cutoff: float = 0.5,
        double_sided: bool = False,
        *,
        ambient: ArrayLike | None = None,
        emission: ArrayLike = (0.0, 0.0, 0.0),
        specular: ArrayLike = (0.0, 0.0, 0.0),
        shininess: float = 0.0,
        emission_texture: Texture | None = None,
        emission_texcoord: int = 0,
        metallic: float | None = None,
        roughness: float = 1.0,
        metallic_roughness_texture: Texture | None = None,
        normal_texture: Texture | None = None,
        normal_scale: float = 1.0,
        occlusion_texture: Texture | None = None,
        occlusion_strength: float = 1.0,
        metallic_roughness_texcoord: int = 0,
        normal_texcoord: int = 0,
        occlusion_texcoord: int = 0,
        unlit: bool = False,
    ) -> None:
        self.name = name
        self.texture = texture
        self.emission_texture = emission_texture
        self.metallic_roughness_texture = metallic_roughness_texture
        self.normal_texture = normal_texture
        self.occlusion_texture = occlusion_texture
        self.emission_texcoord = self._texcoord("emission_texcoord", emission_texcoord)
        self.metallic_roughness_texcoord = self._texcoord(
            "metallic_roughness_texcoord", metallic_roughness_texcoord
        )
        self.normal_texcoord = self._texcoord("normal_texcoord", normal_texcoord)
        self.occlusion_texcoord = self._texcoord("occlusion_texcoord", occlusion_texcoord)
        self.normal_scale = self._number("normal_scale", normal_scale, -LARGEST_SCALE, LARGEST_SCALE)
        self.occlusion_strength = self._number("occlusion_strength", occlusion_strength)
        self.unlit = bool(unlit)
        self.double_sided = double_sided
        if alpha_mode not in ("opaque", "mask", "blend"):
            raise SceneError(
                f"material {name!r}: alpha_mode must be 'opaque', 'mask' or 'blend', got {alpha_mode!r}"
            )
        self.alpha_mode: AlphaMode = alpha_mode
        self.alpha_cutoff = to_number(alpha_cutoff)
        if not 0.0 <= self.alpha_cutoff <= 1.0:
            raise SceneError(f"material {name!r}: alpha_cutoff must lie in 0..1, got {alpha_cutoff!r}")
        self.revision = 0
        self.metallic: float | None = None
        self.ambient: Float64 | None = None
        self.specular, self.shininess = np.zeros(3), 0.0
        self.set_base_color(base_color)
        self.set_ambient(ambient)
        self.set_emission(emission)
        self.set_specular(specular)
        self.set_shininess(shininess)
        self.set_roughness(roughness)
        if metallic is not None:
            self.set_metallic(metallic)
        if self.metallic_roughness_texture is not None and self.metallic is None:
            raise SceneError(
                f"material {name!r}: metallic_roughness_texture multiplies metallic, which is absent: give it"
            )

    def set_base_color(self, color: ArrayLike) -> None:
        """Set the linear base colour (r, g, b, a), each in 0..1."""
        self.base_color = self._color("base_color", color, 4)
        self.revision += 1

    def set_diffuse(self, color: ArrayLike) -> None:
        """Set the linear base colour like `set_base_color`; three numbers keep the opacity."""
        rgb = as_colors(f"material {self.name!r}: base_color", color)
        self.set_base_color([*rgb, self.base_color[3]] if rgb.shape == (3,) else color)

    def set_ambient(self, color: ArrayLike | None) -> None:
        """Set the linear reflectance of ambient light (r, g, b); None is the base colour."""
        self.ambient = None if color is None else self._color("ambient", color)
        self._check_model()
        self.revision += 1

    def set_emission(self, color: ArrayLike) -> None:
        """Set the linear radiance (r, g, b) that the surface emits."""
        self.emission = self._color("emission", color, largest=LARGEST)
        self.revision += 1

    def set_specular(self, color: ArrayLike) -> None:
        """Set the linear reflectance of highlights (r, g, b)."""
        self.specular = self._color("specular", color)
        self._check_model()
        self.revision += 1

    def set_shininess(self, shininess: float) -> None:
        """Set the exponent of highlights."""
        exponent = to_number(shininess)
        if not 0.0 <= exponent <= LARGEST_SHININESS:
            raise SceneError(
                f"material {self.name!r}: shininess must be a number of 0 to {LARGEST_SHININESS:g}, "
                f"got {shininess!r}"
            )
        self.shininess = exponent
        self._check_model()
        self.revision += 1

    def set_metallic(self, metallic: float | None) -> None:
        """Set the share of a metal; None makes a Phong material."""
        self.metallic = None if metallic is None else self._number("metallic", metallic)
        self._check_model()
        self.revision += 1

    def set_roughness(self, roughness: float) -> None:
        """Set the roughness of a metallic-roughness material."""
        self.roughness = self._number("roughness", roughness)
        self.revision += 1

    def _check_model(self) -> None:
        """Raise a SceneError if a metallic-roughness material has what only Phong materials have."""
        if self.metallic is not None and (self.ambient is not None or self.specular.any() or self.shininess):
            raise SceneError(
                f"material {self.name!r}: a metallic material has no ambient, specular and shininess: "
                "leave these out, or metallic"
            )

    def _number(self, what: str, given: float, least: float = 0.0, largest: float = 1.0) -> float:
        number = to_number(given)
        if not least <= number <= largest:
            raise SceneError(
                f"material {self.name!r}: {what} must be a number of {least:g} to {largest:g}, got {given!r}"
            )
        return number

    def _texcoord(self, what: str, given: int) -> int:
        if not isinstance(given, int | np.integer) or given not in (0, 1):
            raise SceneError(f"material {self.name!r}: {what} must be 0 or 1, got {given!r}")
        return int(given)

    def _color(self, what: str, color: ArrayLike, channels: int = 3, largest: float = 1.0) -> Float64:
        return as_color(f"material {self.name!r}: {what}", color, channels, largest)

    def __repr__(self) -> str:
        return f"Material({self.name!r})"

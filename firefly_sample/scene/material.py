"""Materials of surfaces."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import LARGEST, Float64, ReadOnlyArrays, as_color, as_colors
from firefly_sample.scene.camel_case import CamelCase
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import to_number

AlphaMode = Literal["opaque", "mask", "blend"]

LARGEST_SHININESS = 1e6
"""The G-buffer stores the logarithm of shininess, up to this value."""
LARGEST_SCALE = 1e3
"""Of a normal map, either way."""


class Material(CamelCase, ReadOnlyArrays):
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
    modulate_texture : Texture, optional
        Its colour and its alpha multiply those of `texture`, such as a light map does; alone, they take their
        place.
    modulate_texcoord : {0, 1}
        As `emission_texcoord`.
    local_viewer : bool
        In the look "panda3d", see highlights from where the eye is, not along the view axis: Panda3D's
        `Material.set_local`. Other looks always do.

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
        modulate_texture: Texture | None = None,
        modulate_texcoord: int = 0,
        local_viewer: bool = False,
    ) -> None:
        self.name = name
        self.texture = self._texture("texture", texture)
        self.emission_texture = self._texture("emission_texture", emission_texture)
        self.metallic_roughness_texture = self._texture(
            "metallic_roughness_texture", metallic_roughness_texture
        )
        self.normal_texture = self._texture("normal_texture", normal_texture)
        self.occlusion_texture = self._texture("occlusion_texture", occlusion_texture)
        self.modulate_texture = self._texture("modulate_texture", modulate_texture)
        self.emission_texcoord = self._texcoord("emission_texcoord", emission_texcoord)
        self.metallic_roughness_texcoord = self._texcoord(
            "metallic_roughness_texcoord", metallic_roughness_texcoord
        )
        self.normal_texcoord = self._texcoord("normal_texcoord", normal_texcoord)
        self.occlusion_texcoord = self._texcoord("occlusion_texcoord", occlusion_texcoord)
        self.modulate_texcoord = self._texcoord("modulate_texcoord", modulate_texcoord)
        self.normal_scale = self._number("normal_scale", normal_scale, -LARGEST_SCALE, LARGEST_SCALE)
        self.occlusion_strength = self._number("occlusion_strength", occlusion_strength)
        self.unlit = bool(unlit)
        self.local_viewer = bool(local_viewer)
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
        ambient = None if color is None else self._color("ambient", color)
        self._check_model(self.metallic, ambient is not None)
        self.ambient = ambient
        self.revision += 1

    def set_emission(self, color: ArrayLike) -> None:
        """Set the linear radiance (r, g, b) that the surface emits."""
        self.emission = self._color("emission", color, largest=LARGEST)
        self.revision += 1

    def set_specular(self, color: ArrayLike) -> None:
        """Set the linear reflectance of highlights (r, g, b)."""
        specular = self._color("specular", color)
        self._check_model(self.metallic, bool(specular.any()))
        self.specular = specular
        self.revision += 1

    def set_shininess(self, shininess: float) -> None:
        """Set the exponent of highlights."""
        exponent = to_number(shininess)
        if not 0.0 <= exponent <= LARGEST_SHININESS:
            raise SceneError(
                f"material {self.name!r}: shininess must be a number of 0 to {LARGEST_SHININESS:g}, "
                f"got {shininess!r}"
            )
        self._check_model(self.metallic, exponent > 0.0)
        self.shininess = exponent
        self.revision += 1

    def set_local(self, local: bool) -> None:
        """Set `local_viewer`, by Panda3D's name."""
        self.local_viewer = bool(local)
        self.revision += 1

    def get_local(self) -> bool:
        """Return `local_viewer`, by Panda3D's name."""
        return self.local_viewer

    def set_metallic(self, metallic: float | None) -> None:
        """Set the share of a metal; None makes a Phong material."""
        share = None if metallic is None else self._number("metallic", metallic)
        phong = self.ambient is not None or bool(self.specular.any()) or self.shininess > 0.0
        self._check_model(share, phong)
        self.metallic = share
        self.revision += 1

    def set_roughness(self, roughness: float) -> None:
        """Set the roughness of a metallic-roughness material."""
        self.roughness = self._number("roughness", roughness)
        self.revision += 1

    def _check_model(self, metallic: float | None, phong: bool) -> None:
        """Raise a SceneError if a metallic-roughness material has what only Phong ones have (`phong`)."""
        if metallic is not None and phong:
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

    def _texture(self, what: str, given: Texture | None) -> Texture | None:
        if given is not None and not isinstance(given, Texture):
            raise SceneError(f"material {self.name!r}: {what} must be a Texture or None, got {given!r}")
        return given

    def _texcoord(self, what: str, given: int) -> int:
        if not isinstance(given, int | np.integer) or given not in (0, 1):
            raise SceneError(f"material {self.name!r}: {what} must be 0 or 1, got {given!r}")
        return int(given)

    def _color(self, what: str, color: ArrayLike, channels: int = 3, largest: float = 1.0) -> Float64:
        return as_color(f"material {self.name!r}: {what}", color, channels, largest)

    def __repr__(self) -> str:
        return f"Material({self.name!r})"

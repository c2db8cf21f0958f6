"""Every choice that trades speed for accuracy, and its default, in one frozen dataclass."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, get_args

from firefly_sample.errors import SettingsError

__all__ = [
    "LARGEST_ATLAS",
    "LightMethod",
    "Look",
    "PositionMethod",
    "Settings",
    "SpecularModel",
    "Tone",
    "Window",
]

Look = Literal["correct", "classic"]
PositionMethod = Literal["linear32f", "depth32f", "depth24"]
LightMethod = Literal["volumes", "fullscreen", "loop"]
Tone = Literal["exponential", "none"]
SpecularModel = Literal["phong", "blinn_phong"]
Window = Literal["karis", "gltf"]

HALF_CODE = 1.5e-4
"""Half a code of 255 in the dark, where sRGB is linear: 0.5 / 255 / 12.92."""

_CHOICES: dict[str, tuple[Any, ...]] = {
    "look": get_args(Look),
    "position": get_args(PositionMethod),
    "lights": get_args(LightMethod),
    "tone": (None, *get_args(Tone)),
    "supersample": (1, 2),
    "volume_depth_test": (True, False),
    "specular": get_args(SpecularModel),
    "window": get_args(Window),
    "clamp_light": (True, False),
    "shadow_taps": (1, 4, 16),
}

LARGEST_ATLAS = 16384
"""What drivers have of a texture's side."""

_RANGES: dict[str, tuple[float, float]] = {"cutoff_budget": (0.0, 1e30), "cutoff_threshold": (0.0, 1e30)}


@dataclass(frozen=True)
class Settings:
    """How a frame is computed.

    Attributes
    ----------
    look : {"correct", "classic"}
        "classic" draws what Panda3D's sample draws, faults of shading included: textures as stored,
        light added in display space into 8 bits, normals not decoded. It is there to compare with.
    position : {"linear32f", "depth32f", "depth24"}
        Where a pixel's position comes from: a linear distance in an R32F target of its own (4 bytes a
        pixel, error 5e-7 at any near and far), a reversed 32-bit float depth buffer (2e-7, and a copy of
        the buffer), or a 24-bit depth buffer through A, B, C, D as the original does (error grows with
        far/near: 1e-6 at 10, 7e-5 at 1000, useless at 1e6).
    lights : {"volumes", "fullscreen", "loop"}
        One instanced draw of spheres; one full-screen pass a light; or one full-screen pass that loops
        over all lights. The picture is the same; the last two are there to be measured.
    volume_depth_test : bool
        Shade a volume's back faces only where they lie behind the surface. False is what the original
        does: the same picture for two to three times the work.
    cutoff_budget : float
        How much radiance, after exposure, all lights together may lose at any pixel because each is drawn
        only as far as it matters. The default is half a display code in the dark; 0 cuts nothing off.
        Lights with a radius or a max distance end there and lose nothing.
    cutoff_threshold : float, optional
        Cuts each light off where its own radiance has fallen to this instead, however many there are:
        5/256 and 0.01 are in wide use, cheap, and visible.
    window : {"karis", "gltf"}
        How a light with a max distance R ends: times (1 - (d/R)^4)^2, whose slope ends at 0 as well (Karis,
        "Real Shading in Unreal Engine 4", 2013), or times 1 - (d/R)^4, as glTF's KHR_lights_punctual has it.
    specular : {"phong", "blinn_phong"}
        Highlights by the angle between the reflected light and the eye, or between the normal and the
        vector halfway between light and eye: rounder, and about four times the shininess for the same size.
    clamp_light : bool
        Limit each light's diffuse part to the surface's own colour and its highlight to 1, before it fades:
        nothing is overexposed, and lights brighter than 1 are not.
    shadow_taps : {1, 4, 16}
        Comparisons with the shadow map at each pixel: the nearest texel, two by two weighted, or four by
        four weighted, whose edges are as soft as three texels.
    shadow_atlas : int
        Texels along a side that the texture of all shadow maps may have, 256 to 16384. It is made only as
        large as the maps need.
    supersample : {1, 2}
        2 draws four samples a pixel and averages their linear radiance: four times the cost, smooth
        leaves. Keep 1 for measuring.
    exposure : float
        Radiance is multiplied by this, and by the scene's own exposure, before the tone curve.
    tone : {"exponential", "none"}, optional
        "exponential" maps radiance L to 1 - exp(-L) in each channel: 0 stays 0 with slope 1, and nothing
        clips. "none" clips at 1. Absent: the look's own, exponential for "correct", none for "classic".

    Raises
    ------
    SettingsError
        If a value is not one of a setting's choices or two settings contradict; it lists the choices.
    """

    look: Look = "correct"
    position: PositionMethod = "linear32f"
    lights: LightMethod = "volumes"
    volume_depth_test: bool = True
    cutoff_budget: float = HALF_CODE
    cutoff_threshold: float | None = None
    window: Window = "karis"
    specular: SpecularModel = "phong"
    clamp_light: bool = False
    shadow_taps: int = 4
    shadow_atlas: int = 8192
    supersample: int = 1
    exposure: float = 1.0
    tone: Tone | None = None

    def __post_init__(self) -> None:
        for name, choices in _CHOICES.items():
            value = getattr(self, name)
            if value not in choices or (value is not None and type(value) is not type(choices[-1])):
                shown = ", ".join(str(choice) for choice in choices if choice is not None)
                raise SettingsError(f"setting {name!r} must be one of {shown}; got {value!r}")
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if value is None and name == "cutoff_threshold":
                continue
            try:
                number = float(value)
            except (TypeError, ValueError):
                number = math.nan
            if not low <= number <= high:
                raise SettingsError(
                    f"setting {name!r} must be a number of {low:g} to {high:g}; got {value!r}"
                )
            object.__setattr__(self, name, number)
        if type(self.shadow_atlas) is not int or not 256 <= self.shadow_atlas <= LARGEST_ATLAS:
            raise SettingsError(
                f"setting 'shadow_atlas' must be a whole number of 256 to {LARGEST_ATLAS}; "
                f"got {self.shadow_atlas!r}"
            )
        try:
            exposure = float(self.exposure)
        except (TypeError, ValueError):
            exposure = math.nan
        if not 0.0 < exposure <= 1e30:
            raise SettingsError(f"setting 'exposure' must be above 0, at most 1e30; got {self.exposure!r}")
        object.__setattr__(self, "exposure", exposure)
        if self.look == "classic" and (self.tone == "exponential" or self.exposure != 1.0):
            raise SettingsError(
                "look 'classic' has neither a tone curve nor an exposure: leave 'tone' and 'exposure' "
                "at their defaults, or choose look 'correct'"
            )

    @property
    def tone_curve(self) -> Tone:
        """The tone curve in force, the look's own when `tone` is absent."""
        if self.tone is not None:
            return self.tone
        return "none" if self.look == "classic" else "exponential"

    def with_changes(self, **changes: Any) -> Settings:
        """A copy with some settings changed.

        Raises
        ------
        SettingsError
            If a name is not a setting; it lists those that are.
        """
        names = [field.name for field in fields(self)]
        for name in changes:
            if name not in names:
                raise SettingsError(f"there is no setting {name!r}: there are {', '.join(names)}")
        return replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        """The settings as plain JSON values, with the tone curve in force."""
        return asdict(self) | {"tone": self.tone_curve}

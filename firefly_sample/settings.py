"""Every choice that trades speed for accuracy, and its default, in one frozen dataclass."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, get_args

from firefly_sample.errors import SettingsError, did_you_mean

Look = Literal["correct", "classic"]
PositionMethod = Literal[
    "linear32f", "depth32f", "depth24", "depth16", "inverse_matrix", "stored16f", "stored32f"
]
NormalFormat = Literal["oct16", "rgb10a2", "rgba8", "oct8", "rgba16f", "rgba32f"]
AlbedoFormat = Literal["sqrt10", "sqrt8", "srgb8", "rgba8", "rgba16f", "rgba32f"]
Interpolation = Literal["rasterizer", "float64"]
Accumulation = Literal["rgba32f", "rgba16f", "r11g11b10f", "rgba8"]
LightMethod = Literal["auto", "volumes", "clustered", "fullscreen", "loop", "forward"]
VolumeProxy = Literal["cube", "icosphere0", "icosphere1", "icosphere2", "icosphere3"]
LightResolution = Literal["full", "half"]
Tone = Literal["exponential", "none"]
SpecularModel = Literal["phong", "blinn_phong"]
RangeFalloff = Literal["karis", "gltf"]
ParticleShadows = Literal["optical_depth", "blend", "loop", "none"]
ParticleShadowFormat = Literal["float32", "float16", "unorm8"]
ParticleOrder = Literal["view", "half_angle", "unsorted"]

HALF_CODE = 1.5e-4
"""Half a code of 255 in the dark, where sRGB is linear: 0.5 / 255 / 12.92."""

CHOICES: dict[str, tuple[Any, ...]] = {
    "look": get_args(Look),
    "position": get_args(PositionMethod),
    "normals": get_args(NormalFormat),
    "albedo": get_args(AlbedoFormat),
    "interpolation": get_args(Interpolation),
    "accumulation": get_args(Accumulation),
    "light_method": get_args(LightMethod),
    "volume_proxy": get_args(VolumeProxy),
    "light_resolution": get_args(LightResolution),
    "tone": (None, *get_args(Tone)),
    "supersample": (1, 2),
    "volume_depth_test": (True, False),
    "specular_model": get_args(SpecularModel),
    "range_falloff": get_args(RangeFalloff),
    "clamp_light": (True, False),
    "shadow_taps": (1, 4, 16),
    "particle_shadows": get_args(ParticleShadows),
    "particle_shadow_format": get_args(ParticleShadowFormat),
    "particle_shadow_interpolation": (True, False),
    "particle_order": get_args(ParticleOrder),
}

LARGEST_ATLAS = 16384
"""What drivers have of a texture's side."""
SHADOW_RESOLUTIONS = 16, 16384
"""Texels along a side: the smallest shadow map that holds its border, and the largest that drivers have."""

_WHOLE = {
    "shadow_atlas": (256, LARGEST_ATLAS),
    "shadow_resolution": SHADOW_RESOLUTIONS,
    "particle_shadow_slices": (8, 256),
    "particle_shadow_tile": (16, 1024),
    "particle_shadow_reads": (1, 256),
    "particle_order_depths": (2, 65536),
}
_MAY_BE_ABSENT = ("cutoff_threshold", "shadow_resolution", "particle_shadow_reads", "particle_order_depths")
_NOT_CLASSIC = ("normals", "albedo", "interpolation", "accumulation", "light_resolution", "clamp_light")
_ONE_BY_ONE = ("auto", "volumes", "fullscreen")
"""Methods that blend each light by itself."""
NOT_FORWARD = {"light_resolution": "full", "interpolation": "rasterizer"}
"""What needs a G-buffer, and what is left without one."""
_RANGES: dict[str, tuple[float, float]] = {"cutoff_budget": (0.0, 1e30), "cutoff_threshold": (0.0, 1e30)}


@dataclass(frozen=True)
class Settings:
    """How a frame is computed.

    Attributes
    ----------
    look : {"correct", "classic"}
        "classic" shades as Panda3D's sample "fireflies" does, to compare with. It reproduces the sample's
        faults: normals are in the wrong axes and never decoded, so that light comes from wrong directions;
        colours are multiplied as stored; each light is cut off and rounded as it is added into 8 bits.
        docs/lighting.md lists them, and what still differs.
    position : {"linear32f", "depth32f", "depth24", "depth16", "inverse_matrix", "stored16f", "stored32f"}
        Where a pixel's position comes from. A linear distance in an R32F target of its own: 4 bytes a pixel,
        relative error 4e-7 at any near and far. A reversed 32-bit float depth buffer: the same, and a copy of
        it. A standard 24- or 16-bit depth buffer through A, B, C, D: the error grows with distance over
        near, at far/near 1000 it is 1.4e-4 with 24 bits and 8e-3 with 16. "inverse_matrix" is 24-bit depth
        through the inverse of the view-projection matrix, as many tutorials have it: no more accurate, and it
        errs far from the world's origin. View-space positions in a target of their own: 16 bytes a pixel in
        float32; 8 in half floats, which err by 5e-4, or 1e-3 where a driver cuts them off, and end at 65504.
    normals : {"oct16", "rgb10a2", "rgba8", "oct8", "rgba16f", "rgba32f"}
        How normals are stored. "oct16" and "oct8" are octahedral, two times 16 or 8 bits: 4 or 2 bytes a
        pixel, at most 0.004 or 0.95 degrees off. "rgba8" and "rgb10a2" are n/2 + 1/2: 4 bytes, 0.39 or 0.1
        degrees. "rgba16f" and "rgba32f" store n: 8 or 16 bytes, 0.03 or 3e-6 degrees. Highlights magnify the
        error by the root of the shininess.
    albedo : {"sqrt10", "sqrt8", "srgb8", "rgba8", "rgba16f", "rgba32f"}
        How base colours are stored. "sqrt10" keeps square roots in ten bits each, 4 bytes a pixel, exact to
        decode; "sqrt8" is four times as coarse for the same bytes: two display codes where a dark surface is
        brightly lit. "srgb8" is the driver's own encoding, as fine where the driver is exact. "rgba8" stores
        linear values: what is dark loses most of its digits. "rgba16f" and "rgba32f" take 8 and 16 bytes and
        lose 5e-4, or 1e-3 where a driver cuts off, and nothing.
    interpolation : {"rasterizer", "float64"}
        How normals and distances get from a triangle's corners to its pixels. A rasterizer does it in
        float32 and well, but for triangles a hundredth of a pixel high, whose normals come out half a
        degree off. "float64" finds those again from their corners, to 4e-7: 8 bytes a pixel and a pass, a
        quarter of the frame on a CPU. Vertex colours, and depth where positions come from it, stay the
        rasterizer's.
    accumulation : {"rgba32f", "rgba16f", "r11g11b10f", "rgba8"}
        The target that lights are added up in. 500 lights lose 1e-6 in "rgba32f" (16 bytes a pixel), up to
        12% in "rgba16f" (8) on a driver that truncates, half in "r11g11b10f" (4), and nearly everything that
        is dim in "rgba8" (4), which also clips at 1. docs/numerics.md tells how these figures come about.
    light_method : {"auto", "volumes", "clustered", "fullscreen", "loop", "forward"}
        How lights find their pixels. "volumes" is one instanced draw of volumes, a fragment for each light.
        "clustered" cuts the view into tiles and depth slices, lists which lights may reach each cell, and
        walks a pixel's list at once: half the pairs of pixel and light, and one read of the G-buffer for all.
        "auto" estimates for each frame which of the two is cheaper. "fullscreen" is a full-screen pass a
        light; "loop" is one full-screen pass that walks all lights; "forward" has no G-buffer at all: every
        fragment is shaded by every light as it is drawn, seen or not. The picture is the same; the last three
        are there to be measured. The look "classic" takes "auto", "volumes" and "fullscreen", which add each
        light by itself.
    volume_proxy : {"cube", "icosphere0", "icosphere1", "icosphere2", "icosphere3"}
        The mesh drawn for a light that reaches in all directions: 12, 20, 80, 320 or 1280 triangles, which
        cover 91, 21, 6, 1.7 or 0.4 per cent more than the sphere. The picture is the same: few triangles
        shade more fragments, many cost vertices.
    light_resolution : {"full", "half"}
        "half" lights one pixel in four and lets the others take it from neighbours on the same surface: a
        quarter of the light's cost, and a pass to spread it, so that only very many lights make up for that;
        wrong where surfaces are thinner than two pixels or light is finer.
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
    range_falloff : {"karis", "gltf"}
        How a light with a max distance R ends: times (1 - (d/R)^4)^2, whose slope ends at 0 as well (Karis,
        "Real Shading in Unreal Engine 4", 2013), or times 1 - (d/R)^4, as glTF's KHR_lights_punctual has it.
    specular_model : {"phong", "blinn_phong"}
        Highlights by the angle between the reflected light and the eye, or between the normal and the
        vector halfway between light and eye: rounder, and about four times the shininess for the same size.
    clamp_light : bool
        Limit each light's diffuse part to the surface's own colour and its highlight to 1, before it fades:
        nothing is overexposed, and lights brighter than 1 are not.
    shadow_taps : {1, 4, 16}
        Comparisons with the shadow map at each pixel: the nearest texel, two by two weighted, or four by
        four weighted, whose edges are as soft as three texels. Measured against rays, two by two errs least:
        one texel has steps, and what is soft is further from a hard shadow.
    shadow_resolution : int, optional
        Texels along a side of every shadow map, 16 to 16384; each light's own when absent. An edge is as far
        off as a texel is wide; twice as many along a side cost four times the memory and the fill.
    shadow_atlas : int
        Texels along a side that the texture of all shadow maps may have, 256 to 16384. It is made only as
        large as the maps need.
    particle_shadows : {"optical_depth", "blend", "loop", "none"}
        How particles shadow each other and what lies behind them. "optical_depth" adds up -ln(1 - alpha) in
        slices across the light, sums the slices once, and takes the exponential: right for any alpha.
        "blend" adds alphas, slice upon slice in as many steps, and takes 1 - sum: darker, black where 1 is
        reached. "loop" keeps slices as they are, and whoever asks for a shadow adds up those before: the
        first two's predecessor. "none" leaves shadows out.
    particle_shadow_slices : int
        Slices of a cloud along the light, 8 to 256. Twice as many cost twice the memory and twice the sums,
        and take a quarter or more off the error.
    particle_shadow_tile : int
        Texels across each slice, 16 to 1024. Half as many cost a quarter of the memory and the sums, and show
        at a shadow's edge: four times the error there.
    particle_shadow_format : {"float32", "float16", "unorm8"}
        How a slice's texels are stored. "float16" errs by 5e-4 of the sum, more on a driver that cuts off.
        "unorm8" cannot hold less than 1/510, so that faint particles vanish; not with "optical_depth", which
        may be above 1.
    particle_shadow_reads : int, optional
        Slices before its own, the nearest ones, that "loop" adds up, 1 to 256; all when absent.
    particle_shadow_interpolation : bool
        Find shadows between slices by the depth in them, where the cloud allows it too; else in steps.
    particle_order : {"view", "half_angle", "unsorted"}
        Particles are drawn from back to front: along the view axis, which is right; along the axis half-way
        between view and light, which suits both; or as they come, which saves the sorting.
    particle_order_depths : int, optional
        Depths that the order tells apart, 2 to 65536, between the nearest and the farthest particle in view;
        all that float32 tells apart when absent.
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
    normals: NormalFormat = "oct16"
    albedo: AlbedoFormat = "sqrt10"
    interpolation: Interpolation = "rasterizer"
    accumulation: Accumulation = "rgba32f"
    light_method: LightMethod = "auto"
    volume_proxy: VolumeProxy = "icosphere1"
    light_resolution: LightResolution = "full"
    volume_depth_test: bool = True
    cutoff_budget: float = HALF_CODE
    cutoff_threshold: float | None = None
    range_falloff: RangeFalloff = "karis"
    specular_model: SpecularModel = "phong"
    clamp_light: bool = False
    shadow_taps: int = 4
    shadow_resolution: int | None = None
    shadow_atlas: int = 8192
    particle_shadows: ParticleShadows = "optical_depth"
    particle_shadow_slices: int = 64
    particle_shadow_tile: int = 128
    particle_shadow_format: ParticleShadowFormat = "float32"
    particle_shadow_reads: int | None = None
    particle_shadow_interpolation: bool = True
    particle_order: ParticleOrder = "view"
    particle_order_depths: int | None = None
    supersample: int = 1
    exposure: float = 1.0
    tone: Tone | None = None

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            given = value = getattr(self, name)
            if type(choices[-1]) is int:
                value = to_whole(given)
                object.__setattr__(self, name, value)
            if value not in choices or (value is not None and type(value) is not type(choices[-1])):
                shown = ", ".join(str(choice) for choice in choices if choice is not None)
                raise SettingsError(f"setting {name!r} must be one of {shown}; got {given!r}")
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if value is None and name in _MAY_BE_ABSENT:
                continue
            number = to_number(value)
            if not low <= number <= high:
                raise SettingsError(
                    f"setting {name!r} must be a number of {low:g} to {high:g}; got {value!r}"
                )
            object.__setattr__(self, name, number)
        for name, (first, last) in _WHOLE.items():
            value = getattr(self, name)
            if value is None and name in _MAY_BE_ABSENT:
                continue
            whole = to_whole(value)
            if whole is None or not first <= whole <= last:
                raise SettingsError(
                    f"setting {name!r} must be a whole number of {first} to {last}; got {value!r}"
                )
            object.__setattr__(self, name, whole)
        exposure = to_number(self.exposure)
        if not 0.0 < exposure <= 1e30:
            raise SettingsError(f"setting 'exposure' must be above 0, at most 1e30; got {self.exposure!r}")
        object.__setattr__(self, "exposure", exposure)
        self._check_together()

    def _check_together(self) -> None:
        if self.particle_shadow_format == "unorm8" and self.particle_shadows == "optical_depth":
            raise SettingsError(
                "setting 'particle_shadow_format' must not be unorm8 with particle_shadows=optical_depth, which adds up "
                "to more than 1: choose float16, or particle_shadows=blend or loop"
            )
        if self.particle_shadow_reads is not None and self.particle_shadows != "loop":
            raise SettingsError(
                "setting 'particle_shadow_reads' is for particle_shadows=loop: leave it out, or choose that"
            )
        if self.light_method == "forward":
            for name, value in NOT_FORWARD.items():
                if getattr(self, name) != value:
                    raise SettingsError(
                        f"setting {name!r} must be {value} with light_method=forward, which shades fragments as "
                        "they are drawn and keeps no G-buffer: choose other lights"
                    )
        if self.look != "classic":
            return
        if self.tone == "exponential" or self.exposure != 1.0:
            raise SettingsError(
                "look 'classic' has neither a tone curve nor an exposure: leave 'tone' and 'exposure' "
                "at their defaults, or choose look 'correct'"
            )
        for name in _NOT_CLASSIC:
            if getattr(self, name) != getattr(type(self), name):
                raise SettingsError(
                    f"look 'classic' stores, adds up and blends as the original does: leave {name!r} at its "
                    "default, or choose look 'correct'"
                )
        if self.light_method not in _ONE_BY_ONE:
            raise SettingsError(
                "look 'classic' adds each light by itself into 8 bits, as the original does: "
                f"'light_method' must be one of {', '.join(_ONE_BY_ONE)}; got {self.light_method!r}"
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

    @classmethod
    def preset(cls, name: str, **changes: Any) -> Settings:
        """The settings of a preset of `PRESETS`, with some of them changed.

        Raises
        ------
        SettingsError
            If there is no such preset, or as `with_changes`.
        """
        if name not in PRESETS:
            raise SettingsError(
                f"there is no preset {name!r}{did_you_mean(name, PRESETS)}: there are {', '.join(PRESETS)}"
            )
        return cls().with_changes(**preset_with(name, changes))


PRESETS: dict[str, dict[str, Any]] = {
    "fast": {
        "normals": "oct8",
        "albedo": "sqrt8",
        "cutoff_threshold": 1e-3,
        "volume_proxy": "icosphere0",
        "shadow_taps": 1,
        "particle_shadow_slices": 32,
        "particle_shadow_tile": 64,
    },
    "balanced": {},
    "accurate": {
        "normals": "rgba32f",
        "albedo": "rgba32f",
        "interpolation": "float64",
        "cutoff_budget": 1e-6,
        "particle_shadow_slices": 128,
        "particle_shadow_tile": 256,
    },
}
"""What differs from the defaults, which are "balanced": the fastest that looks right, the most accurate."""


def number_or_none(value: Any) -> float | None:
    """Return a value as a float; None for text, bools, complex numbers and arrays with dimensions."""
    if type(value) is float:
        return value
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    listed = getattr(value, "ndim", 0) > 0
    if isinstance(value, bool | str | bytes | bytearray) or kind not in "iuf" or listed:
        return None
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return None


def to_number(value: Any) -> float:
    """Return a value as a float; NaN where it is no number."""
    number = number_or_none(value)
    return math.nan if number is None else number


def to_whole(value: Any) -> int | None:
    """Return a value as an int; None for floats, bools and what else is none. NumPy's integers are."""
    try:
        return None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        return None


def preset_with(name: str, changes: Mapping[str, Any]) -> dict[str, Any]:
    """What a preset of `PRESETS` changes, with other changes on top, to which it leaves what they rule out.

    A budget takes its threshold's place; forward shading and the classic look have no use for some of it.
    """
    preset, without = dict(PRESETS[name]), set()
    if changes.get("cutoff_budget") is not None:
        without.add("cutoff_threshold")
    if changes.get("light_method") == "forward":
        without |= set(NOT_FORWARD)
    if changes.get("look") == "classic":
        without |= set(_NOT_CLASSIC)
    return {key: value for key, value in preset.items() if key not in without} | dict(changes)

"""The settings of a frame: every choice that trades speed for accuracy, each declared once."""

# ruff: noqa: RUF009 (`_setting` returns a dataclass field)

from __future__ import annotations

import functools
import inspect
import math
import operator
import types
import typing
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, Literal

from firefly_sample.errors import SettingsError, did_you_mean

Look = Literal["correct", "classic", "pyrender", "flat", "panda3d"]
PositionMethod = Literal[
    "linear32f", "depth32f", "depth24", "depth16", "inverse_matrix", "stored16f", "stored32f"
]
NormalFormat = Literal["oct16", "rgb10a2", "rgba8", "oct8", "rgba16f", "rgba32f"]
AlbedoFormat = Literal["sqrt10", "sqrt8", "srgb8", "rgba8", "rgba16f", "rgba32f"]
Interpolation = Literal["rasterizer", "float64"]
AccumulationFormat = Literal["rgba32f", "rgba16f", "r11g11b10f", "rgba8"]
LightMethod = Literal["auto", "volumes", "clustered", "fullscreen", "loop", "forward"]
VolumeProxy = Literal["cube", "icosphere0", "icosphere1", "icosphere2", "icosphere3"]
LightResolution = Literal["full", "half"]
Tone = Literal["exponential", "none"]
SpecularModel = Literal["phong", "blinn_phong"]
RangeFalloff = Literal["karis", "gltf"]
ParticleShadows = Literal["optical_depth", "blend", "loop", "none"]
ParticleShadowFormat = Literal["float32", "float16", "unorm8"]
Transparency = Literal["sorted", "exact", "weighted"]
ParticleOrder = Literal["view", "half_angle", "unsorted"]

HALF_CODE = 1.5e-4
"""Half a code of 255 in the dark, where sRGB is linear: 0.5 / 255 / 12.92."""
HALF_CODE_OF_POWER = (0.5 / 255.0) ** 2.2
"""The radiance of half a code in the look "pyrender"."""
HALF_CODE_OF_CODES = 0.5 / 255.0
"""The same in the look "panda3d", which shows radiance as it is."""
LARGEST_ATLAS = 16384
"""The largest side of a texture that drivers offer."""
SHADOW_RESOLUTIONS = 16, LARGEST_ATLAS
"""Texels along a side: the smallest shadow map that holds its border, and the largest that drivers offer."""


@dataclass(frozen=True)
class Limit:
    """The values that a setting may have while another setting has certain values.

    Attributes
    ----------
    other : str
        The other setting.
    values : tuple
        The values of `other` for which the limit holds.
    allowed : tuple
        The values that the limited setting may have then.
    because : str
        The reason, as a clause that follows the other setting's name.
    """

    other: str
    values: tuple[Any, ...]
    allowed: tuple[Any, ...]
    because: str


_STORED_AS_BY_PANDA = "stores, adds and blends as Panda3D's sample does"


def _classic(*allowed: Any, because: str = _STORED_AS_BY_PANDA) -> Limit:
    return Limit("look", ("classic",), allowed, because)


def _pyrender(*allowed: Any, because: str = "shades as pyrender does") -> Limit:
    return Limit("look", ("pyrender",), allowed, because)


def _panda3d(*allowed: Any, because: str = "shades as Panda3D's shader generator does") -> Limit:
    return Limit("look", ("panda3d",), allowed, because)


def _flat(*allowed: Any, because: str = "shows base colours as they are stored") -> Limit:
    return Limit("look", ("flat",), allowed, because)


def _forward(allowed: str) -> Limit:
    return Limit(
        "light_method", ("forward",), (allowed,), "shades fragments as they are drawn, without a G-buffer"
    )


@dataclass(frozen=True)
class Setting:
    """One setting as `Settings` declares it.

    Attributes
    ----------
    name : str
    type : type
        Of its values: str, int, float or bool.
    default : Any
        None where the setting may be absent.
    help : str
        One sentence: the help of its option.
    details : str
        More about its values.
    choices : tuple
        All values that it may have; empty if `range` tells them.
    range : (float, float)
        The smallest and the largest number.
    above : bool
        True if the smallest number is itself not allowed.
    words : tuple of str
        Values that it may have besides numbers.
    absent : str
        What holds where the setting is absent; empty if it must have a value.
    limits : tuple of Limit
        What other settings forbid.
    """

    name: str
    type: type
    default: Any
    help: str
    details: str = ""
    choices: tuple[Any, ...] = ()
    range: tuple[float, float] = (0.0, 1e30)
    above: bool = False
    words: tuple[str, ...] = ()
    absent: str = ""
    limits: tuple[Limit, ...] = ()

    @property
    def expected(self) -> str:
        """Return the values that the setting may have, in words."""
        if self.choices:
            return f"one of {', '.join(map(str, self.choices))}"
        low, high = (f"{bound:g}" for bound in self.range)
        bounds = f"above {low}, at most {high}" if self.above else f"of {low} to {high}"
        return ", or ".join((f"a {'whole ' * (self.type is int)}number {bounds}", *self.words))

    def check(self, value: Any) -> Any:
        """Return `value` as the setting's type.

        Raises
        ------
        SettingsError
            If the setting may not have that value.
        """
        if value is None and self.absent:
            return None
        if isinstance(value, str) and value in self.words:
            return str(value)
        if self.choices:
            checked = to_whole(value) if self.type is int else value
            if type(checked) is self.type and checked in self.choices:
                return checked
        else:
            number = to_whole(value) if self.type is int else to_number(value)
            low, high = self.range
            if number is not None and low <= number <= high and not (self.above and number == low):
                return number
        raise SettingsError(f"setting {self.name!r} must be {self.expected}; got {value!r}")

    def broken_limit(self, value: Any, others: Mapping[str, Any]) -> Limit | None:
        """Return the first limit that `value` breaks beside the values of other settings."""
        for limit in self.limits:
            if others.get(limit.other) in limit.values and value not in limit.allowed:
                return limit
        return None


def _setting(default: Any, about: str, details: str = "", **others: Any) -> Any:
    """Return a field of `Settings`; `others` are attributes of `Setting`."""
    return field(default=default, metadata={"help": about, "details": details, **others})


@dataclass(frozen=True)
class Settings:
    """The settings that decide how a frame is computed."""

    look: Look = _setting(
        "correct",
        "Shade correctly, as Panda3D's sample does with its faults, as pyrender or Panda3D do, or not at all "
        "(flat).",
        """The look "classic" reproduces the faults of Panda3D's sample "fireflies": normals are in the wrong
        axes and are never decoded, so that light comes from wrong directions; colours are multiplied as
        stored; each light is cut off and rounded as it is added into 8 bits. docs/lighting.md lists them, and
        what still differs. The look "pyrender" shades metallic-roughness materials by pyrender's formula
        and shows radiance by the power 1/2.2: docs/pyrender.md lists the terms. "flat" shows base colours,
        textures and vertex colours as they are stored, without light. "panda3d" shades by the formula of
        Panda3D's shader generator, and multiplies and shows colours as they are stored: docs/lighting.md has
        the formula.""",
    )
    position_method: PositionMethod = _setting(
        "linear32f",
        "How the position of a pixel is found: from a stored distance, from the depth buffer, or stored.",
        """The method "linear32f" stores the distance along the view axis in an R32F target: 4 bytes per
        pixel, relative error 4e-7 at any near and far. "depth32f" reads a reversed 32-bit float depth buffer:
        the same error, and a copy of the buffer. "depth24" and "depth16" read a standard depth buffer through
        A, B, C and D: the error grows with distance over near; at far/near 1000 it is 1.4e-4 with 24 bits and
        8e-3 with 16. "inverse_matrix" multiplies 24-bit depth by the inverse of the view-projection matrix,
        as many tutorials do: no more accurate, and wrong far from the world's origin. "stored32f" and
        "stored16f" store view-space positions: 16 or 8 bytes per pixel. Half floats have an error of 5e-4, or
        1e-3 where a driver truncates, and end at 65504.""",
    )
    normal_format: NormalFormat = _setting(
        "oct16",
        "The format in which normals are stored.",
        """The formats "oct16" and "oct8" are octahedral, two components of 16 or 8 bits: 4 or 2 bytes per
        pixel, with errors of at most 0.004 or 0.95 degrees. "rgba8" and "rgb10a2" store n/2 + 1/2: 4 bytes,
        0.39 or 0.1 degrees. "rgba16f" and "rgba32f" store n: 8 or 16 bytes, 0.03 or 3e-6 degrees. Highlights
        magnify the error by the square root of the shininess.""",
        limits=(_classic("oct16"),),
    )
    albedo_format: AlbedoFormat = _setting(
        "sqrt10",
        "The format in which base colours are stored.",
        """The format "sqrt10" stores square roots in ten bits each: 4 bytes per pixel, and exact to decode.
        "sqrt8" is four times as coarse for the same bytes: two display codes where a dark surface is brightly
        lit. "srgb8" is the driver's own encoding, as fine as "sqrt8" where the driver is exact. "rgba8"
        stores linear values: dark colours lose most of their digits. "rgba16f" and "rgba32f" take 8 and 16
        bytes; the first has an error of 5e-4, or 1e-3 where a driver truncates, the second none.""",
        limits=(_classic("sqrt10"), _flat("sqrt10")),
    )
    interpolation: Interpolation = _setting(
        "rasterizer",
        "How normals and distances are interpolated: float64 corrects very thin triangles.",
        """The rasterizer works in float32, accurately but for triangles that are a hundredth of a pixel high,
        whose normals come out half a degree wrong. "float64" computes those again from the triangle's
        corners, to 4e-7. That takes 8 bytes per pixel and one more pass, a quarter of the frame on a CPU.
        Vertex colours, and depth where positions come from it, remain the rasterizer's.""",
        limits=(
            _classic("rasterizer"),
            _pyrender("rasterizer"),
            _panda3d("rasterizer"),
            _forward("rasterizer"),
        ),
    )
    accumulation_format: AccumulationFormat = _setting(
        "rgba32f",
        "The format of the target in which lights are added.",
        """500 lights lose 1e-6 in "rgba32f" (16 bytes per pixel), up to 12 % in "rgba16f" (8) on a driver
        that truncates, half in "r11g11b10f" (4), and nearly everything that is dim in "rgba8" (4), which also
        clips at 1. docs/numerics.md explains these figures.""",
        limits=(_classic("rgba32f"),),
    )
    light_method: LightMethod = _setting(
        "auto",
        "How lights are applied: as light volumes, from clustered lists, or the cheaper of both (auto). "
        "fullscreen, loop and forward are there for comparison.",
        """The method "volumes" draws all light volumes in one instanced call, with a fragment for each pixel
        and light. "clustered" cuts the view into tiles and depth slices, lists the lights that may reach each
        cell, and shades each pixel from its cell's list: half as many pairs of pixel and light, and one read
        of the G-buffer for all. "auto" estimates for each frame which of the two is cheaper. "fullscreen"
        draws one full-screen pass per light; "loop" is one full-screen pass that loops over all lights;
        "forward" has no G-buffer: each fragment is shaded by every light as it is drawn, whether it is seen
        or not. The picture is the same.""",
        limits=(
            _classic("auto", "volumes", "fullscreen", because="adds one light after another into 8 bits"),
            _flat("auto", "volumes", "clustered", "fullscreen", "loop", because="has no lights"),
        ),
    )
    volume_proxy: VolumeProxy = _setting(
        "icosphere1",
        "The mesh drawn for a light's sphere: fewer triangles have fewer vertices, but shade more fragments.",
        """The meshes have 12, 20, 80, 320 or 1280 triangles, and cover 91, 21, 6, 1.7 or 0.4 % more than the
        sphere. The picture is the same.""",
    )
    light_resolution: LightResolution = _setting(
        "full",
        "Compute lighting for every pixel, or at half resolution in each direction and upsample it.",
        """At "half", lighting is computed for one pixel in four; the others take their light from neighbours
        on the same surface. That costs a quarter of the lighting and a pass to upsample it, which pays only
        with very many lights. It is wrong where surfaces are thinner than two pixels, or where light varies
        faster.""",
        limits=(_classic("full"), _pyrender("full"), _panda3d("full"), _forward("full")),
    )
    volume_depth_test: bool = _setting(
        True,
        "Shade the back faces of light volumes only where they lie behind the surface.",
        """Without it, as in Panda3D's sample, the picture is the same for two to three times the work.""",
    )
    cutoff_budget: float | None = _setting(
        None,
        "How much radiance, after exposure, all lights together may lose per pixel because each is cut off.",
        """Each light is drawn only as far as it matters. The default is half a display code in the dark; 0
        cuts nothing off. Lights with a radius or a max distance end there and lose nothing.""",
        absent="1.5e-4, or 1.1e-6 with look=pyrender, or 2e-3 with look=panda3d",
    )
    cutoff_threshold: float | None = _setting(
        None,
        "Cut each light off where its own radiance falls to this, for example 0.0195, not by the budget.",
        """It applies to each light, however many there are. 5/256 (0.0195) and 0.01 are in wide use, cheap,
        and visible.""",
        absent="none: the budget decides",
    )
    range_falloff: RangeFalloff = _setting(
        "karis",
        "How a light with a max distance fades out.",
        """At the distance d of a max distance R, light is multiplied by (1 - (d/R)^4)^2, whose slope ends at
        0 as well (Karis, "Real Shading in Unreal Engine 4", 2013), or by 1 - (d/R)^4, as in glTF's
        KHR_lights_punctual.""",
    )
    specular_model: SpecularModel = _setting(
        "phong",
        "The formula of highlights.",
        """The model "phong" uses the angle between the reflected light and the eye; "blinn_phong" the angle
        between the normal and the vector halfway between light and eye: rounder, and it takes about four
        times the shininess for the same size. The look "panda3d" has a formula of its own.""",
        limits=(_panda3d("phong", because="has highlights of its own"),),
    )
    clamp_light: bool = _setting(
        False,
        "Limit each light to the surface's own colour, and its highlight to 1.",
        """The limit applies before the light fades with distance: nothing is overexposed, and lights brighter
        than 1 look like lights of 1.""",
        limits=(_classic(False), _pyrender(False), _panda3d(False)),
    )
    shadow_taps: int = _setting(
        4,
        "How many texels of the shadow map are compared per pixel.",
        """1 takes the nearest texel, 4 two by two with weights, 16 four by four with weights, whose edges are
        as soft as three texels are wide. Measured against rays, 4 has the least error: 1 has steps, and a
        soft edge is further from a hard shadow.""",
        choices=(1, 4, 16),
    )
    shadow_resolution: int | None = _setting(
        None,
        "Texels along a side of every shadow map, in place of the lights' own.",
        """The error of a shadow's edge is as large as a texel. Twice as many texels along a side cost four
        times the memory and the fill.""",
        range=SHADOW_RESOLUTIONS,
        absent="each light's own",
    )
    shadow_atlas: int = _setting(
        8192,
        "The most texels along a side that the texture of all shadow maps may have.",
        """The texture is made only as large as the maps need.""",
        range=(256, LARGEST_ATLAS),
    )
    particle_shadows: ParticleShadows = _setting(
        "optical_depth",
        "How particles shadow each other and what lies behind them.",
        """The method "optical_depth" adds -ln(1 - alpha) in slices perpendicular to the light, sums the
        slices once, and takes the exponential: right for any alpha. "blend" adds alphas, slice upon slice in
        as many steps, and takes 1 - sum: darker, and black where the sum reaches 1. "loop" leaves the slices
        as they are, and each lookup adds those before it: the predecessor of the first two. "none" leaves
        shadows out.""",
    )
    particle_shadow_slices: int = _setting(
        64,
        "Slices of a cloud of particles along its light.",
        """Twice as many cost twice the memory and twice the sums, and reduce the error by a quarter or
        more.""",
        range=(8, 256),
    )
    particle_shadow_tile: int = _setting(
        128,
        "Texels across each slice.",
        """Half as many cost a quarter of the memory and the sums; the error at a shadow's edge is four times
        as large.""",
        range=(16, 1024),
    )
    particle_shadow_format: ParticleShadowFormat = _setting(
        "float32",
        "The format of a slice's texels.",
        """The format "float16" has an error of 5e-4 of the sum, more on a driver that truncates. "unorm8"
        holds 1/510 to 1, so that faint particles vanish.""",
        limits=(
            Limit("particle_shadows", ("optical_depth",), ("float32", "float16"), "adds up to more than 1"),
        ),
    )
    particle_shadow_reads: int | None = _setting(
        None,
        "With particle_shadows=loop: how many slices are added up, the nearest ones towards the light.",
        range=(1, 256),
        absent="all",
        limits=(Limit("particle_shadows", ("optical_depth", "blend", "none"), (None,), "has no such loop"),),
    )
    particle_shadow_interpolation: bool = _setting(
        True,
        "Interpolate shadows between slices by depth; without it they change in steps.",
        """Shadows are interpolated only where the cloud allows it, too.""",
    )
    particle_order: ParticleOrder = _setting(
        "view",
        "The axis along which particles are sorted from back to front, or no sorting.",
        """The order "view" sorts along the view axis, which is right; "half_angle" along the axis half-way
        between view and light, which suits both; "unsorted" saves the sorting.""",
    )
    particle_order_depths: int | None = _setting(
        None,
        "How many depths the order of particles distinguishes.",
        """They lie between the nearest and the farthest particle in view.""",
        range=(2, 65536),
        absent="all that float32 distinguishes",
    )
    transparency: Transparency = _setting(
        "sorted",
        "How blended surfaces are drawn over each other: sorted, layer by layer (exact), or by weights.",
        """The method "sorted" draws triangles, particles and dots from back to front. It is exact unless they
        intersect, or overlap in a circle; what moves is sorted again. "exact" draws one layer after the
        other, the nearest first, until no pixel has another: as many times the cost as there are layers, for
        measuring and for stills. "weighted" needs no order: it averages colours by weights that fall with the
        distance, and is wrong wherever a near surface should hide a far one; it pays where sorting costs more
        than drawing. docs/trade.md has figures.""",
    )
    transparency_layers: int = _setting(
        64,
        "With transparency=exact: how many blended layers a pixel may have.",
        """More are an error: no layer is left out.""",
        range=(1, 4096),
    )
    supersample: int = _setting(
        1,
        "2 averages four samples per pixel. firefly capture uses 2 for color and color_alpha alone, else 1.",
        """Their linear radiance is averaged: four times the cost, and smooth leaves. Keep 1 for
        measuring.""",
        choices=(1, 2),
    )
    exposure: float | Literal["auto"] = _setting(
        1.0,
        "The factor by which radiance is multiplied before the tone curve, beside the scene's own exposure; "
        "auto measures it on the scene's surfaces.",
        """With "auto", white paper in bright light comes out just below display white. Captures, windows and
        measurements measure it once, at their first time. docs/lighting.md explains how.""",
        above=True,
        limits=(
            _classic(1.0, because="has no exposure"),
            _flat(1.0),
            _panda3d(1.0, because="has no exposure"),
        ),
    )
    tone: Tone | None = _setting(
        None,
        "The curve from radiance to display.",
        """The curve "exponential" maps radiance L to 1 - exp(-L) in each channel: 0 stays 0 with slope 1, and
        nothing clips. "none" clips at 1.""",
        absent="exponential with look=correct, else none",
        limits=(
            _classic(None, "none", because="has no tone curve"),
            _pyrender(None, "none", because="encodes radiance by the power 1/2.2 alone"),
            _flat(None, "none"),
            _panda3d(None, "none", because="has no tone curve"),
        ),
    )

    def __post_init__(self) -> None:
        for name, setting in SETTINGS.items():
            object.__setattr__(self, name, setting.check(getattr(self, name)))
        for name, setting in SETTINGS.items():
            value = getattr(self, name)
            limit = setting.broken_limit(value, self.__dict__)
            if limit is not None:
                one_of = "one of " if len(limit.allowed) > 1 else ""
                allowed = ", ".join("absent" if value is None else str(value) for value in limit.allowed)
                other = f"{limit.other}={getattr(self, limit.other)}"
                raise SettingsError(
                    f"setting {name!r} must be {one_of}{allowed} with {other}, which {limit.because}; "
                    f"got {value!r}: change {name!r} or {limit.other!r}"
                )

    @property
    def tone_curve(self) -> Tone:
        """Return the tone curve in force: the look's own where `tone` is absent."""
        if self.tone is not None:
            return self.tone
        return "exponential" if self.look == "correct" else "none"

    @property
    def budget(self) -> float:
        """Return the `cutoff_budget` in force: half a code of the look where it is absent."""
        if self.cutoff_budget is not None:
            return self.cutoff_budget
        return {"pyrender": HALF_CODE_OF_POWER, "panda3d": HALF_CODE_OF_CODES}.get(self.look, HALF_CODE)

    def with_changes(self, **changes: Any) -> Settings:
        """Return a copy with some settings changed.

        Raises
        ------
        SettingsError
            If there is no such setting, it may not have that value, or two settings contradict each other.
        """
        return replace(self, **changes)

    def with_look(self, look: Look) -> Settings:
        """Return a copy with another look; what that does not allow is as by default.

        Raises
        ------
        SettingsError
            If there is no such look.
        """
        forbidden = {
            name: setting.default
            for name, setting in SETTINGS.items()
            if setting.broken_limit(getattr(self, name), {"look": look}) is not None
        }
        return self.with_changes(look=look, **forbidden)

    def as_dict(self) -> dict[str, Any]:
        """Return the settings as plain JSON values, with the tone curve and the budget in force."""
        return asdict(self) | {"tone": self.tone_curve, "cutoff_budget": self.budget}

    @classmethod
    def preset(cls, name: str, **changes: Any) -> Settings:
        """Return the settings of a preset of `PRESETS`, with some of them changed.

        Raises
        ------
        SettingsError
            If there is no such preset, or as `with_changes`.
        """
        if name not in PRESETS:
            raise SettingsError(
                f"there is no preset {name!r}{did_you_mean(name, PRESETS)}: there are {', '.join(PRESETS)}"
            )
        return cls(**preset_with(name, changes))


def _declared() -> dict[str, Setting]:
    """Return the settings by name; type, choices and default come from the fields of `Settings`."""
    hints = typing.get_type_hints(Settings)
    settings = {}
    for entry in fields(Settings):
        hint, words = hints[entry.name], ()
        if typing.get_origin(hint) in (typing.Union, types.UnionType):  # None, or words, beside another type
            hint, other = typing.get_args(hint)
            words = typing.get_args(other)
        choices = (True, False) if hint is bool else typing.get_args(hint)
        kind = type(choices[0]) if choices else hint
        declared: dict[str, Any] = {"choices": choices, "words": words, **entry.metadata}
        settings[entry.name] = Setting(entry.name, kind, entry.default, **declared)
    return settings


def _documentation() -> str:
    """Return the docstring of `Settings`, with an entry for each setting."""
    lines = [Settings.__doc__ or "", "", "Attributes", "----------"]
    for setting in SETTINGS.values():
        default = setting.absent if setting.default is None else setting.default
        lines.append(f"{setting.name} : {setting.expected}; default {default}")
        text = "\n".join(filter(None, (setting.help, inspect.cleandoc(setting.details))))
        lines += [f"    {line}" for line in text.splitlines()]
    lines += ["", "Raises", "------", "SettingsError"]
    lines.append(
        "    If there is no such setting, it may not have that value, or two settings contradict each other."
    )
    return "\n".join(lines)


def _checking_names(init: Any) -> Any:
    """Return `init` with a `SettingsError` for an unknown name, which also knows the old names."""

    @functools.wraps(init)
    def checked(self: Settings, *values: Any, **settings: Any) -> None:
        for name in settings:
            if name not in SETTINGS:
                close = did_you_mean(name, SETTINGS)
                raise SettingsError(f"there is no setting {name!r}{close}: there are {', '.join(SETTINGS)}")
        init(self, *values, **settings)

    return checked


SETTINGS = _declared()
"""Every setting by name, in the order in which they are listed to people."""
CHOICES: dict[str, tuple[Any, ...]] = {
    name: (None,) * (setting.default is None) + setting.choices
    for name, setting in SETTINGS.items()
    if setting.choices
}
"""All values of each setting that has no range; None where it may be absent."""
NOT_FORWARD: dict[str, Any] = {
    name: limit.allowed[0]
    for name, setting in SETTINGS.items()
    for limit in setting.limits
    if limit.other == "light_method"
}
"""The settings that need a G-buffer, each with the value that forward shading leaves it."""
Settings.__doc__ = _documentation()
Settings.__init__ = _checking_names(Settings.__init__)  # type: ignore[method-assign]

PRESETS: dict[str, dict[str, Any]] = {
    "fast": {
        "normal_format": "oct8",
        "albedo_format": "sqrt8",
        "cutoff_threshold": 1e-3,
        "volume_proxy": "icosphere0",
        "shadow_taps": 1,
        "particle_shadow_slices": 32,
        "particle_shadow_tile": 64,
    },
    "balanced": {},
    "accurate": {
        "normal_format": "rgba32f",
        "albedo_format": "rgba32f",
        "interpolation": "float64",
        "cutoff_budget": 1e-6,
        "particle_shadow_slices": 128,
        "particle_shadow_tile": 256,
    },
}
"""Changes to the defaults: the fastest settings that look right, none, and the most accurate."""


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
    """Return a value as an int, also one of NumPy's; None for floats, bools and everything else."""
    try:
        return None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        return None


def preset_with(name: str, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the changes of a preset of `PRESETS` with other changes on top.

    Where the preset contradicts the other changes it gives way: to a budget in place of its threshold, and to
    `Limit`s of other settings.
    """
    kept = {
        key: value
        for key, value in PRESETS[name].items()
        if SETTINGS[key].broken_limit(value, changes) is None
    }
    if changes.get("cutoff_budget") is not None:
        kept.pop("cutoff_threshold", None)
    return kept | dict(changes)

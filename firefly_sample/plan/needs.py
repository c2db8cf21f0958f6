"""What a frame needs: what is in view, what is asked of it, and what follows from both."""

from __future__ import annotations

from dataclasses import dataclass

from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.plan.lights.light_set import LightKind
from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.plan.targets import (
    ACCUMULATION_FORMATS,
    ALBEDO_FORMATS,
    COARSE_DEPTH,
    NORMAL_FORMATS,
    STORED_POSITIONS,
    UNSIGNED,
)
from firefly_sample.plan.visible import Looks
from firefly_sample.settings import Settings

PLACE_OUTPUTS = ("depth", "position", "position_world")
NORMAL_OUTPUTS = ("normal", "normal_world")
VOLUME_OUTPUTS = ("overdraw", "volumes", "wireframe")

_NOUNS: dict[LightKind, str] = {
    "directional": "directional light",
    "point": "point light",
    "spot": "spotlight",
}


@dataclass(frozen=True)
class Needs:
    """What is in view, and what is asked of it.

    Attributes
    ----------
    method : str
        How the passes of light find their pixels: the setting "lights", or what "auto" came to.
    geometry, sprites : int
        Counts in view.
    lights : dict of LightKind to int
        Lights in view; kinds of which there are none are left out.
    endless : dict of LightKind to int
        Those of them that are drawn over the full screen because they end nowhere.
    shadowed : dict of LightKind to int
        Those of them that have shadow maps.
    atlas : (int, int)
        Size of the texture of all shadow maps.
    maps : int
        Shadow maps that are looked up.
    particles : int
        In view.
    particle_shadow : ParticleShadowPlan or None
        The shadows of particles.
    clouded : dict of LightKind to int
        The light in view that particles take some of, if there is one.
    ambient, gradient : bool
        Whether there is ambient light that is not black, and whether the background is a gradient.
    looks : Looks
        Of the materials in view.
    orthographic : bool
    """

    settings: Settings
    method: str
    outputs: tuple[str, ...]
    capabilities: Capabilities
    geometry: int
    sprites: int
    lights: dict[LightKind, int]
    endless: dict[LightKind, int]
    shadowed: dict[LightKind, int]
    atlas: tuple[int, int]
    maps: int
    particles: int
    particle_shadow: ParticleShadowPlan | None
    clouded: dict[LightKind, int]
    ambient: bool
    gradient: bool
    looks: Looks
    orthographic: bool

    @property
    def own_ambient(self) -> str:
        """Names of materials in view that reflect ambient light in a colour of its own."""
        return self.looks.own_ambient

    @property
    def emissive(self) -> str:
        """Names of materials in view that shine."""
        return self.looks.emissive

    @property
    def shiny(self) -> str:
        """Names of materials in view that have highlights."""
        return self.looks.shiny

    @property
    def picture(self) -> bool:
        """Whether radiance is computed."""
        return "color" in self.outputs or "radiance" in self.outputs

    @property
    def shaded(self) -> bool:
        """Whether light that falls on surfaces is computed at all."""
        return self.geometry > 0 and (self.picture or "light" in self.outputs)

    @property
    def drawn(self) -> bool:
        """Whether geometry is drawn: a look at the shadow maps alone does without."""
        return self.geometry > 0 and not set(self.outputs) <= {"shadow_atlas", "particle_shadow_atlas"}

    @property
    def shadow_maps(self) -> bool:
        """Whether shadow maps are looked up, or looked at."""
        return self.maps > 0 and (self.lit or "shadow_atlas" in self.outputs)

    @property
    def lit(self) -> bool:
        """Whether lights, other than ambient ones, meet surfaces."""
        return self.shaded and bool(self.lights)

    @property
    def ambient_lit(self) -> bool:
        """Whether ambient light meets surfaces."""
        return self.shaded and self.ambient

    @property
    def own_ambient_lit(self) -> bool:
        """Whether ambient light meets surfaces that have a colour of its own for it."""
        return self.ambient_lit and self.picture and bool(self.own_ambient) and not self.classic

    @property
    def emits(self) -> bool:
        """Whether surfaces that shine are seen in the picture."""
        return self.picture and bool(self.emissive) and not self.classic

    @property
    def highlights(self) -> bool:
        """Whether there are highlights in the picture."""
        return self.lit and self.picture and bool(self.shiny) and not self.classic

    @property
    def placed(self) -> bool:
        """Whether light depends on where the surface is: only directional light without shadows does not."""
        shadows = bool(self.shadowed) or (bool(self.clouded) and self.particle_shadow is not None)
        return self.lit and (any(kind != "directional" for kind in self.lights) or shadows)

    @property
    def counts_cells(self) -> bool:
        """Whether the lights that a pixel's cell holds are counted: the output "overdraw" of clusters."""
        near = any(kind != "directional" for kind in self.lights)
        return self.method == "clustered" and "overdraw" in self.outputs and near and self.drawn

    @property
    def hazy(self) -> bool:
        """Whether particles are drawn."""
        return self.picture and self.particles > 0

    @property
    def dotted(self) -> bool:
        """Whether sprites are drawn by themselves: among particles they are drawn with these."""
        return self.picture and self.sprites > 0 and not self.hazy

    @property
    def particle_shadowed(self) -> bool:
        """Whether shadows of particles are looked up, or looked at."""
        if self.particle_shadow is None:
            return False
        seen = bool(self.clouded) and (self.lit or self.hazy)
        return seen or self.textured or "particle_shadow_atlas" in self.outputs

    @property
    def particle_shadow_reason(self) -> str:
        """What asks for the shadows of particles, in words."""
        assert self.particle_shadow is not None
        return f"shadows of {_particles(len(self.particle_shadow))} in light {self.particle_shadow.light!r}"

    @property
    def textured(self) -> bool:
        """Whether the slices' texture is shown in the picture."""
        return self.particle_shadow is not None and self.particle_shadow.show and "color" in self.outputs

    @property
    def classic(self) -> bool:
        """Whether this is the original's look."""
        return self.settings.look == "classic"

    @property
    def linear_distance(self) -> bool:
        """Whether positions come from a linear distance target."""
        return self.settings.position == "linear32f"

    @property
    def place_target(self) -> str:
        """The target that positions come from; "depth" is the depth buffer itself."""
        if self.linear_distance:
            return "distance"
        return "position" if self.settings.position in STORED_POSITIONS else "depth"

    @property
    def forward(self) -> bool:
        """Whether surfaces are shaded as they are drawn."""
        return self.method == "forward"

    @property
    def float64(self) -> bool:
        """Whether places and normals are interpolated in float64."""
        return self.settings.interpolation == "float64" and self.capabilities.float64

    @property
    def half(self) -> bool:
        """Whether light is computed for every second pixel across and down."""
        return self.settings.light_resolution == "half" and self.lit

    @property
    def normal_format(self) -> tuple[str, str]:
        """Format and packing of normals."""
        if self.classic:
            return "rgba8", "undecoded"
        if self.settings.normals == "oct16" and not self.capabilities.snorm_targets:
            return UNSIGNED
        return NORMAL_FORMATS[self.settings.normals]

    @property
    def albedo_format(self) -> tuple[str, str]:
        """Format and packing of colours."""
        return ("rgba8", "linear") if self.classic else ALBEDO_FORMATS[self.settings.albedo]

    @property
    def packed(self) -> bool:
        """Whether colours are stored as bits of whole numbers."""
        return self.albedo_format[1] == "root10"

    @property
    def accumulation_format(self) -> str:
        """Format of what light is added up in."""
        return "rgba8" if self.classic else ACCUMULATION_FORMATS[self.settings.accumulation]

    @property
    def distance_marks(self) -> bool:
        """Whether a distance target by itself tells what was drawn: in perspective it is never 0 there.

        A depth does not tell, since far geometry may round to the clear value, nor does a normal.
        """
        return bool(asked(self.outputs, PLACE_OUTPUTS)) and self.linear_distance and not self.orthographic

    @property
    def reverse(self) -> bool:
        """Whether depth is reversed in the [0, 1] clip range."""
        return reverses_depth(self.settings, self.capabilities)

    @property
    def volume_test(self) -> bool:
        """Whether light volumes are tested against the depth buffer."""
        return self.method == "volumes" and self.settings.volume_depth_test

    def lights_of(self, kind: LightKind) -> str:
        """How many lights of a kind there are, in words."""
        return _count(self.lights[kind], _NOUNS[kind])

    def in_view(self, kind: LightKind) -> str:
        """The lights of a kind in view, and a word on those that cost a full screen each."""
        endless = self.endless.get(kind, 0)
        if not endless:
            return f"{self.lights_of(kind)} in view"
        return (
            f"{self.lights_of(kind)} in view, {endless} of them without end: over the full screen "
            "(an attenuation or a max distance would bound it)"
        )

    def all_lights(self) -> list[str]:
        """The same for each kind."""
        return [self.lights_of(kind) for kind in self.lights]

    def placed_lights(self) -> list[str]:
        """The same for what depends on where the surface is."""
        reasons = [self.lights_of(kind) for kind in self.lights if kind != "directional"]
        if "directional" in self.shadowed:
            reasons.append(f"shadows of {_count(self.shadowed['directional'], _NOUNS['directional'])}")
        if "directional" in self.clouded and self.particle_shadow is not None:
            reasons.append(f"shadows of particles in light {self.particle_shadow.light!r}")
        return reasons

    @property
    def particles_in_view(self) -> str:
        """How many particles are drawn, in words."""
        return f"{_particles(self.particles)} in view"

    def shadows(self) -> list[str]:
        """How many lights of each kind cast shadows, in words."""
        return [f"shadows of {_count(count, _NOUNS[kind])}" for kind, count in self.shadowed.items()]


def reverses_depth(settings: Settings, capabilities: Capabilities) -> bool:
    """Whether depth is reversed in the [0, 1] clip range."""
    return capabilities.clip_control and settings.position not in COARSE_DEPTH


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _particles(number: int) -> str:
    return f"{number:,} particle{'' if number == 1 else 's'}"


def asked(outputs: tuple[str, ...], names: tuple[str, ...]) -> list[str]:
    """A reason for each output that is among `names`."""
    return [f"output {name}" for name in outputs if name in names]

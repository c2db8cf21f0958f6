"""The needs of a frame: counts of what is in view, the settings and outputs, and what follows from them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.plan.lights.light_set import LightKind
from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.plan.targets import STORED_POSITIONS
from firefly_sample.plan.variants import PositionSource, SpecularModel, Transparency
from firefly_sample.plan.visible import NO_LOOKS, Looks
from firefly_sample.settings import PositionMethod, Settings

PICTURES = frozenset(("color", "color_alpha", "radiance"))
"""Outputs that show radiance."""
POSITION_OUTPUTS = ("depth", "position", "position_world")
NORMAL_OUTPUTS = ("normal", "normal_world")

_NOUNS: dict[LightKind, str] = {
    "directional": "directional light",
    "point": "point light",
    "spot": "spotlight",
}


@dataclass(frozen=True)
class Needs:
    """Counts of what is in view, and what is asked of it; kinds of lights without any are left out."""

    settings: Settings
    method: str  # how lighting passes find their pixels: the setting "light_method", or the choice of "auto"
    outputs: tuple[str, ...]
    capabilities: Capabilities
    geometry: int
    sprites: int
    particles: int
    lights: dict[LightKind, int]
    endless: dict[LightKind, int]  # drawn over the full screen because they end nowhere
    shadowed: dict[LightKind, int]  # that have shadow maps
    particle_shadowed_kind: LightKind | None  # of the light in view that particles shadow, if there is one
    particle_shadow: ParticleShadowPlan | None
    maps: int  # shadow maps
    atlas: tuple[int, int]  # texels of the texture of all shadow maps
    ambient: bool  # True if there is ambient light that is not black
    gradient: bool  # True if the background is one
    looks: Looks  # of surfaces that are not blended
    orthographic: bool
    reverse: bool  # True if depth is reversed in the [0, 1] clip range
    blended: int = 0  # instances of blended surfaces; `geometry` does not count them
    blended_looks: Looks = NO_LOOKS
    depth_offsets: tuple[int, ...] = ()  # of surfaces that are not blended, but for 0

    # --- what is drawn ---

    @property
    def picture(self) -> bool:
        """True if radiance is computed."""
        return not PICTURES.isdisjoint(self.outputs)

    @property
    def shaded(self) -> bool:
        """True if light that falls on surfaces is computed."""
        return self.geometry > 0 and (self.picture or "light" in self.outputs)

    @property
    def drawn(self) -> bool:
        """True if geometry is drawn: the shadow atlases alone do without."""
        return self.geometry > 0 and not set(self.outputs) <= {"shadow_atlas", "particle_shadow_atlas"}

    @property
    def lit(self) -> bool:
        """True if lights, other than ambient ones, meet surfaces."""
        return self.shaded and bool(self.lights)

    @property
    def ambient_lit(self) -> bool:
        """True if ambient light meets surfaces."""
        return self.shaded and self.ambient

    @property
    def own_ambient_lit(self) -> bool:
        """True if ambient light meets surfaces that reflect it in a colour of its own."""
        return self.ambient_lit and self.picture and bool(self.own_ambient) and not self.classic

    @property
    def own_ambient(self) -> str:
        """The materials that reflect ambient light in a colour of their own, by name."""
        return self.own_ambient_of(self.looks)

    def own_ambient_of(self, looks: Looks) -> str:
        """Return the same of some surfaces: pyrender's formula reflects it in the base colour."""
        return looks.phong_ambient if self.pyrender else looks.own_ambient

    @property
    def metals(self) -> bool:
        """True if light meets metallic-roughness surfaces in the picture."""
        return self.lit and self.picture and bool(self.looks.metallic) and not self.classic

    @property
    def emits(self) -> bool:
        """True if the picture shows emission."""
        return self.picture and bool(self.looks.emissive) and not (self.classic or self.flat)

    @property
    def tints(self) -> bool:
        """True if surfaces multiply all light that they reflect by a colour: in pyrender's formula."""
        lit = self.lit or self.ambient_lit
        return self.pyrender and lit and self.picture and bool(self.looks.tinted)

    @property
    def modulates(self) -> bool:
        """True if textures or colour scales multiply what surfaces show, once all light is added up."""
        shown = self.picture or "albedo" in self.outputs
        return self.panda3d and self.geometry > 0 and shown and bool(self.looks.modulated)

    @property
    def gloss(self) -> bool:
        """True if highlights are added up by themselves: nothing multiplies them then."""
        return self.modulates and self.picture and self.highlights

    @property
    def local_viewers(self) -> bool:
        """True if some highlights, not all, see the eye where it is."""
        return self.panda3d and self.highlights and bool(self.looks.local_viewer)

    @property
    def specular_model(self) -> SpecularModel:
        """The formula of highlights, where there are some."""
        return "blinn_phong" if self.panda3d else self.settings.specular_model

    @property
    def eye_at_origin(self) -> bool:
        """True if highlights see the rays of an orthographic camera meet in its position."""
        return self.orthographic and ((self.pyrender and self.metals) or self.local_viewers)

    @property
    def highlights(self) -> bool:
        """True if the picture shows highlights."""
        return self.lit and self.picture and bool(self.looks.shiny) and not self.classic

    @property
    def draws_particles(self) -> bool:
        """True if particles are drawn."""
        return self.picture and self.particles > 0

    @property
    def draws_sprites(self) -> bool:
        """True if sprites are drawn by themselves: among particles they are drawn with these."""
        among_others = self.draws_particles or self.transparency in ("sorted", "exact")
        return self.picture and self.sprites > 0 and (not among_others or self.transparency == "weighted")

    @property
    def transparency(self) -> Transparency:
        """The method by which blended surfaces are drawn; "none" if none are."""
        return self.settings.transparency if self.blended and self.picture and not self.classic else "none"

    @property
    def blends(self) -> bool:
        """True if blended surfaces are drawn."""
        return self.transparency != "none"

    @property
    def squares_among_blended(self) -> bool:
        """True if particles, or dots, are drawn among blended surfaces."""
        dots = self.sprites > 0 and self.transparency in ("sorted", "exact")
        return self.blends and (self.particles > 0 or dots)

    @property
    def receives_light(self) -> bool:
        """True if lights, other than ambient ones, meet surfaces, blended or not."""
        return self.lit or (self.blends and bool(self.lights))

    @property
    def shadow_maps(self) -> bool:
        """True if shadow maps are looked up, or are an output."""
        return self.maps > 0 and (self.receives_light or "shadow_atlas" in self.outputs)

    @property
    def particle_shadowed(self) -> bool:
        """True if shadows of particles are looked up, or shown."""
        if self.particle_shadow is None:
            return False
        meets = self.receives_light or self.draws_particles
        seen = self.particle_shadowed_kind is not None and meets
        return seen or self.shows_slices or "particle_shadow_atlas" in self.outputs

    @property
    def shows_slices(self) -> bool:
        """True if the picture shows the texture of the particle shadows' slices."""
        shadow = self.particle_shadow
        return shadow is not None and shadow.show and "color" in self.outputs

    @property
    def counts_cells(self) -> bool:
        """True if the lights in each pixel's cell are counted: the output "overdraw" of clustered lights."""
        near = any(kind != "directional" for kind in self.lights)
        return self.method == "clustered" and "overdraw" in self.outputs and near and self.drawn

    def shadowed_by_particles(self, kind: LightKind) -> bool:
        """Return whether particles shadow light of a kind."""
        return kind == self.particle_shadowed_kind and self.particle_shadow is not None

    def needs_position(self, kind: LightKind) -> bool:
        """Return whether light of a kind depends on a surface's position, as all but shadowless sunlight."""
        placed = kind in self.shadowed or self.shadowed_by_particles(kind) or self.eye_at_origin
        return kind != "directional" or placed

    # --- how ---

    @property
    def classic(self) -> bool:
        """True for the original's look."""
        return self.settings.look == "classic"

    @property
    def pyrender(self) -> bool:
        """True if surfaces are shaded by pyrender's formula."""
        return self.settings.look == "pyrender"

    @property
    def panda3d(self) -> bool:
        """True if surfaces are shaded by the formula of Panda3D's shader generator."""
        return self.settings.look == "panda3d"

    @property
    def flat(self) -> bool:
        """True if base colours are shown as they are stored, without light."""
        return self.settings.look == "flat"

    @property
    def forward(self) -> bool:
        """True if surfaces are shaded as they are drawn."""
        return self.method == "forward"

    @property
    def half(self) -> bool:
        """True if light is computed at half the resolution."""
        return self.settings.light_resolution == "half" and self.lit

    @property
    def float64(self) -> bool:
        """True if positions and normals are interpolated in float64."""
        return self.settings.interpolation == "float64" and self.capabilities.float64

    @property
    def tests_volumes(self) -> bool:
        """True if light volumes are tested against the depth buffer."""
        behind = bool(self.depth_offsets) and self.depth_offsets[0] < 0  # perhaps behind their lights
        return self.method == "volumes" and self.settings.volume_depth_test and not behind

    @property
    def position_method(self) -> PositionMethod:
        """The method by which positions are found: a depth buffer that offsets move does not have them."""
        asked_for = self.settings.position_method
        return "linear32f" if self.depth_offsets and asked_for not in STORED_POSITIONS else asked_for

    @property
    def position_reason(self) -> str:
        """The reason for that method, in words."""
        chosen = f"position_method={self.position_method}"
        if self.position_method == self.settings.position_method:
            return chosen
        return f"{chosen}, since depth offsets move what a depth buffer holds"

    @property
    def position_target_name(self) -> str:
        """The target that positions come from; "depth" is the depth buffer itself."""
        if self.position_method == "linear32f":
            return "distance"
        return "position" if self.position_method in STORED_POSITIONS else "depth"

    @property
    def needs_positions(self) -> bool:
        """True if light depends on where the surface is."""
        return self.lit and any(map(self.needs_position, self.lights))

    @property
    def tested_source(self) -> str:
        """The same for passes that may test against the depth buffer, which must not be sampled then."""
        copied = self.tests_volumes and self.position_target_name == "depth" and not self.half
        return "depth_copy" if copied and self.needs_positions else self.position_target_name

    @property
    def particle_source(self) -> str:
        """The target in which particles find surfaces; blended ones are tested against the depth buffer."""
        source = "depth" if self.forward else self.position_target_name
        tested = self.transparency in ("sorted", "weighted")
        return "depth_copy" if source == "depth" and tested else source

    @property
    def position_source(self) -> PositionSource:
        """The way in which shaders get positions."""
        if self.position_method == "inverse_matrix":
            return "inverse_matrix"
        sources: dict[str, PositionSource] = {"distance": "distance", "position": "stored", "depth": "depth"}
        return sources[self.position_target_name]

    # --- in words ---

    def lights_of(self, kind: LightKind) -> str:
        """Return how many lights of a kind there are, in words."""
        return _count(self.lights[kind], _NOUNS[kind])

    def all_lights(self) -> list[str]:
        """Return the same for each kind."""
        return [self.lights_of(kind) for kind in self.lights]

    def in_view(self, kind: LightKind) -> str:
        """Return the lights of a kind in view, and how many of them cost a full screen each."""
        text = f"{self.lights_of(kind)} in view"
        endless = self.endless.get(kind, 0)
        if endless:
            text += f", {endless} of them without end: over the full screen "
            text += "(an attenuation or a max distance would bound it)"
        return text

    def shadows(self, kinds: Iterable[LightKind] | None = None) -> list[str]:
        """Return how many lights of each kind cast shadows, in words."""
        chosen = self.shadowed if kinds is None else [kind for kind in kinds if kind in self.shadowed]
        return [f"shadows of {_count(self.shadowed[kind], _NOUNS[kind])}" for kind in chosen]

    @property
    def particle_shadow_reason(self) -> str:
        """The reason for the shadows of particles, in words."""
        assert self.particle_shadow is not None
        count = _count(len(self.particle_shadow), "particle")
        return f"shadows of {count} in light {self.particle_shadow.light!r}"

    @property
    def blended_in_view(self) -> str:
        """The number of blended instances, in words."""
        return f"{_count(self.blended, 'blended instance')} in view (transparency={self.transparency})"

    @property
    def particles_in_view(self) -> str:
        """The number of particles that are drawn, in words."""
        return f"{_count(self.particles, 'particle')} in view"


def _count(number: int, noun: str) -> str:
    """Return a number and its noun, for example "2 point lights"."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def asked(outputs: tuple[str, ...], names: tuple[str, ...]) -> list[str]:
    """Return a reason for each output that is among `names`."""
    return [f"output {name}" for name in outputs if name in names]

"""Choose targets and passes: each exists because something asked for it, and says what."""

from __future__ import annotations

from dataclasses import dataclass

from firefly_sample.errors import PlanError
from firefly_sample.plan.frame_plan import Capabilities, PassPlan
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    LEGAL,
    AmbientVariant,
    GeometryVariant,
    PlainVariant,
    PointLightsVariant,
    ResolveVariant,
)
from firefly_sample.settings import Settings

__all__ = ["Needs", "check_passes", "choose_passes", "choose_targets"]

PLACE_OUTPUTS = ("depth", "position", "position_world")
NORMAL_OUTPUTS = ("normal", "normal_world")


@dataclass(frozen=True)
class Needs:
    """What is in view, and what is asked of it.

    Attributes
    ----------
    geometry, lights, sprites : int
        Counts in view.
    ambient, gradient : bool
        Whether there is ambient light that is not black, and whether the background is a gradient.
    orthographic : bool
    """

    settings: Settings
    outputs: tuple[str, ...]
    capabilities: Capabilities
    geometry: int
    lights: int
    sprites: int
    ambient: bool
    gradient: bool
    orthographic: bool

    @property
    def picture(self) -> bool:
        """Whether light is computed at all."""
        return "color" in self.outputs or "radiance" in self.outputs

    @property
    def lit(self) -> bool:
        """Whether point lights meet surfaces."""
        return self.picture and self.geometry > 0 and self.lights > 0

    @property
    def ambient_lit(self) -> bool:
        """Whether ambient light meets surfaces."""
        return self.picture and self.geometry > 0 and self.ambient

    @property
    def dotted(self) -> bool:
        """Whether sprites are drawn."""
        return self.picture and self.sprites > 0

    @property
    def classic(self) -> bool:
        """Whether this is the original's look."""
        return self.settings.look == "classic"

    @property
    def linear_distance(self) -> bool:
        """Whether positions come from a linear distance target."""
        return self.settings.position == "linear32f"

    @property
    def distance_marks(self) -> bool:
        """Whether a distance target by itself tells what was drawn: in perspective it is never 0 there.

        A depth does not tell, since far geometry may round to the clear value, nor does a normal.
        """
        asked = any(name in PLACE_OUTPUTS for name in self.outputs)
        return asked and self.linear_distance and not self.orthographic

    @property
    def reverse(self) -> bool:
        """Whether depth is reversed in the [0, 1] clip range."""
        return self.capabilities.clip_control and self.settings.position != "depth24"

    @property
    def volume_test(self) -> bool:
        """Whether light volumes are tested against the depth buffer."""
        return self.settings.lights == "volumes" and self.settings.volume_depth_test


def _asked(outputs: tuple[str, ...], names: tuple[str, ...]) -> list[str]:
    return [f"output {name}" for name in outputs if name in names]


def choose_targets(needs: Needs) -> tuple[Target, ...]:
    """The targets of a frame, each with its reasons."""
    outputs, targets = needs.outputs, []

    def add(name: str, form: str, reasons: list[str], clear: float = 0.0, per_sample: bool = True) -> None:
        if reasons:
            targets.append(Target(name, form, "; ".join(reasons), (clear, 0.0, 0.0, 0.0), per_sample))

    lights = f"{needs.lights} point lights"
    if needs.geometry:
        hides = ["geometry hides what is behind it"]
        add("depth", "depth32f" if needs.reverse else "depth24", hides, 0.0 if needs.reverse else 1.0)
        add("albedo", "rgba8", _albedo_reasons(needs))
        snorm = "rg16_snorm" if needs.capabilities.snorm_targets else "rg16"
        reasons = ([lights] if needs.lit else []) + _asked(outputs, NORMAL_OUTPUTS)
        add("normal", "rgba8" if needs.classic else snorm, reasons)
        reasons = ([f"{lights} (position=linear32f)"] if needs.lit else []) + _asked(outputs, PLACE_OUTPUTS)
        add("distance", "r32f", reasons if needs.linear_distance else [])
        add("id", "r32ui", _asked(outputs, ("id",)))
        if needs.lit and not needs.linear_distance:
            reason = (
                f"position={needs.settings.position} samples the depth that the volumes are tested against"
            )
            add("depth_copy", "depth32f" if needs.reverse else "depth24", [reason])
    reasons = [lights] if needs.lit else []
    reasons += ["ambient light"] if needs.ambient_lit else []
    reasons += [f"{needs.sprites} sprites"] if needs.dotted else []
    add("radiance", "rgba8" if needs.classic else "rgba32f", reasons)
    add("color", "rgba8", _asked(outputs, ("color",)), per_sample=False)
    add("final_radiance", "rgba32f", _asked(outputs, ("radiance",)), per_sample=False)
    return tuple(targets)


def _albedo_reasons(needs: Needs) -> list[str]:
    reasons = [f"{needs.lights} point lights"] if needs.lit else []
    reasons += ["ambient light"] if needs.ambient_lit else []
    reasons += ["the background shows where its alpha is 0"] if needs.picture else []
    reasons += _asked(needs.outputs, ("albedo",))
    if not needs.distance_marks:
        marked = _asked(needs.outputs, (*PLACE_OUTPUTS, *NORMAL_OUTPUTS))
        reasons += [f"{reason} (its alpha marks the background)" for reason in marked]
    return reasons


def geometry_variant(needs: Needs, targets: tuple[Target, ...]) -> GeometryVariant:
    """The geometry pass's variant as far as the frame decides it; batches fill in the rest."""
    names = {target.name for target in targets}
    return GeometryVariant(
        albedo="albedo" in names,
        normal="normal" in names,
        distance="distance" in names,
        id="id" in names,
        classic=needs.classic,
        snorm=needs.capabilities.snorm_targets,
        orthographic=needs.orthographic,
    )


def choose_passes(needs: Needs, targets: tuple[Target, ...]) -> tuple[PassPlan, ...]:
    """The passes of a frame in drawing order, each with its reason."""
    names = {target.name for target in targets}
    passes: list[PassPlan] = []
    lit_by: list[str] = []  # grows with the first pass that clears the radiance

    def light(
        name: str, reads: tuple[str, ...], tests: tuple[str, ...], because: str, variant: object
    ) -> None:
        writes, updates = ((), ("radiance",)) if lit_by else (("radiance",), ())
        lit_by.append(name)
        passes.append(PassPlan(name, reads, writes, (*updates, *tests), because, variant))  # type: ignore[arg-type]

    settings = needs.settings
    if needs.geometry:
        gbuffer = tuple(n for n in ("depth", "albedo", "normal", "distance", "id") if n in names)
        passes.append(
            PassPlan(
                "geometry",
                (),
                gbuffer,
                (),
                f"{needs.geometry} geometry instances in view",
                geometry_variant(needs, targets),
            )
        )
    if "depth_copy" in names:
        because = f"position={settings.position}: a depth buffer cannot be tested and sampled at once"
        passes.append(PassPlan("depth_copy", ("depth",), ("depth_copy",), (), because))
    if needs.ambient_lit:
        light("ambient", ("albedo",), (), "ambient light", AmbientVariant(needs.classic))
    if needs.lit:
        place = "distance" if needs.linear_distance else "depth_copy"
        variant = PointLightsVariant(
            settings.lights,
            not needs.linear_distance,
            needs.classic,
            needs.capabilities.snorm_targets,
            needs.orthographic,
        )
        tests = ("depth",) if needs.volume_test else ()
        light(
            "point_lights",
            ("albedo", "normal", place),
            tests,
            f"{needs.lights} point lights in view",
            variant,
        )
    if needs.dotted:
        tests = ("depth",) if needs.geometry else ()
        light("plain", (), tests, f"{needs.sprites} sprites in view", PlainVariant(needs.orthographic))
    if needs.picture:
        passes.append(_resolve(needs, names))
    return tuple(passes)


def _resolve(needs: Needs, names: set[str]) -> PassPlan:
    settings = needs.settings
    return PassPlan(
        "resolve",
        tuple(name for name in ("radiance", "albedo") if name in names),
        tuple(name for name in ("color", "final_radiance") if name in names),
        (),
        "; ".join(_asked(needs.outputs, ("color", "radiance"))),
        ResolveVariant(
            radiance="radiance" in names,
            masked="albedo" in names,
            color="color" in names,
            final_radiance="final_radiance" in names,
            gradient=needs.gradient,
            orthographic=needs.orthographic and needs.gradient,
            classic=needs.classic,
            tone=settings.tone_curve,
            supersample=settings.supersample,  # type: ignore[arg-type]
        ),
    )


def check_passes(passes: tuple[PassPlan, ...], targets: tuple[Target, ...]) -> None:
    """Hold the passes against the fixed order and against each other.

    Raises
    ------
    PlanError
        If a pass is out of order, touches a target that does not exist, reads or updates what nobody
        wrote, samples what it also draws into, or if a target is never used.
    """
    order = list(LEGAL)
    positions = [order.index(step.name) for step in passes]
    if positions != sorted(positions):
        raise PlanError(f"passes are out of order: {', '.join(step.name for step in passes)}")
    names = {target.name for target in targets}
    written: set[str] = set()
    for step in passes:
        for name in (*step.reads, *step.writes, *step.updates):
            if name not in names:
                raise PlanError(f"pass {step.name!r} uses target {name!r}, which this frame does not have")
        for name in (*step.reads, *step.updates):
            if name not in written:
                raise PlanError(f"pass {step.name!r} reads target {name!r}, which no pass wrote before it")
        for name in step.reads:
            if name in step.writes or name in step.updates:
                raise PlanError(f"pass {step.name!r} samples target {name!r} while it draws into it")
        written.update(step.writes)
    for name in sorted(names - written):
        raise PlanError(f"target {name!r} is never written by any pass")

"""The frozen description of one frame: everything that passes, the float64 reference or data sets need.

All numbers are float64, all positions are in view space (X right, Y forward, Z up).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import PlanError
from firefly_sample.frame import LightCounts
from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.factors import Factors
from firefly_sample.plan.lights.clusters import Clusters
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.shadows.maps import ShadowPlan
from firefly_sample.plan.surface_maps import NO_MAPS, Maps
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import SurfaceFeatures, Variant
from firefly_sample.plan.view import View
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.render_mode import PLAIN, RenderMode
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings


@dataclass(frozen=True)
class Capabilities:
    """A driver's abilities beyond OpenGL 3.3 core, as far as they change a plan.

    Attributes
    ----------
    clip_control : bool
        ARB_clip_control: the [0, 1] clip range, without which reversed depth gains nothing.
    snorm_targets : bool
        RG16_SNORM can be rendered to; otherwise normals are stored in RG16.
    float64 : bool
        ARB_gpu_shader_fp64: doubles in shaders, without which the rasterizer interpolates.
    """

    clip_control: bool = True
    snorm_targets: bool = True
    float64: bool = True


@dataclass(frozen=True)
class Background:
    """Linear colours where nothing is drawn: at and below the horizon, and straight up."""

    horizon: tuple[float, float, float]
    zenith: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Batch:
    """One instanced draw: a Geom, a texture, and where its instances are and what colours they have."""

    key: tuple[Any, ...]  # hashable; the same from frame to frame for instances that are drawn together
    geom: Geom
    texture: Texture | None
    alpha_cutoff: float  # the alpha below which a cut-out is not drawn
    mirrored: bool  # True if the instances' matrices turn triangles inside out
    model_to_view: Float64  # (n, 4, 4), front to back
    ids: NDArray[np.int32]  # (n,), index of each geometry instance
    factors: Factors  # colours of the instances' materials, times their nodes' flat colours
    surface: SurfaceFeatures
    maps: Maps = NO_MAPS
    render_mode: RenderMode = PLAIN
    depth_offset: int = 0  # steps by which depths are moved towards the eye


@dataclass(frozen=True)
class LightMethod:
    """The method by which lighting passes find their pixels.

    Attributes
    ----------
    name : {"volumes", "clustered", "fullscreen", "loop", "forward"}
    estimated_pairs : dict of str to float
        About how many pairs of a pixel and a light each method would shade; empty if nothing was estimated
        because the settings name the method.
    because : str
        The reason for the method.
    """

    name: str
    estimated_pairs: dict[str, float] = field(default_factory=dict)
    because: str = ""


@dataclass(frozen=True, eq=False)
class SpriteSet:
    """Soft dots in view space: positions (n, 3), linear colours (n, 3), radii (n,), float64."""

    positions: Float64
    colors: Float64
    radii: Float64

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True)
class Run:
    """Things that follow each other in the drawing order, and that one call can draw.

    `batch` is an index into `Blended.batches`, -1 for particles and dots; `first` and `count` are of
    triangles, or of squares.
    """

    batch: int
    first: int
    count: int


@dataclass(frozen=True, eq=False)
class DrawOrder:
    """All blended triangles, particles and dots from back to front.

    Attributes
    ----------
    runs : tuple of Run
    corners : ndarray of uint32, shape (n, 3)
        The vertices of triangles in drawing order; those of instance i of a batch begin at i times the number
        of its Geom's vertices.
    squares : ndarray of int, shape (m,)
        Particles, by their number, and dots, whose numbers follow theirs, in drawing order.
    warnings : tuple of str
        Where no order is right.
    """

    runs: tuple[Run, ...]
    corners: NDArray[np.uint32]
    squares: NDArray[np.intp]
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Blended:
    """The blended surfaces in view.

    Attributes
    ----------
    batches : tuple of Batch
        With all their instances.
    order : DrawOrder or None
        With transparency=sorted.
    clusters : tuple of Clusters
        The lights that have a position, by cell.
    nearest, farthest : float
        Bounds of the surfaces along the view axis.
    """

    batches: tuple[Batch, ...]
    order: DrawOrder | None
    clusters: tuple[Clusters, ...]
    nearest: float
    farthest: float


@dataclass(frozen=True)
class PassPlan:
    """One pass of a frame."""

    name: str  # also the stem of its shaders and the key of its time
    reads: tuple[str, ...]  # targets that it samples
    writes: tuple[str, ...]  # targets that it clears and fills
    updates: tuple[str, ...]  # targets that it blends into or tests against
    because: str  # the reason why the frame has it
    variant: Variant = field(default_factory=Variant)  # draws of surfaces and of lights add what is their own


@dataclass(frozen=True, eq=False)
class FramePlan:
    """One frame, complete. See the attributes' own classes.

    Attributes
    ----------
    size : (int, int)
        Of the picture in pixels.
    settings : Settings
        As they were given, but with the exposure as a number.
    ambient : ndarray of float64, shape (3,)
        The sum of all ambient lights.
    lights : tuple of LightSet
        In drawing order.
    light_method : LightMethod
        How the lighting passes find their pixels.
    clusters : tuple of Clusters
        With the clustered method: the lights again, joined to sets that one draw shades.
    exposure : tuple of 3 floats
        The scene's times the setting's; the looks "classic" and "flat" have none.
    sources : dict of str to tuple of str
        The targets that each output is decoded from; none where the frame has nothing for it.
    id_names : tuple of str
        Path of each geometry instance, by id.
    snapshot : Snapshot
        Everything that the camera's mask lets through, also outside the view: no pass needs it, but what
        data sets say of a frame is made from it.
    blended : Blended or None
        What is blended over the other surfaces; `batches` does not hold it.
    """

    size: tuple[int, int]
    settings: Settings
    outputs: tuple[str, ...]
    time: float
    view: View
    batches: tuple[Batch, ...]
    ambient: Float64
    lights: tuple[LightSet, ...]
    light_method: LightMethod
    clusters: tuple[Clusters, ...]
    shadows: ShadowPlan
    sprites: SpriteSet
    particles: ParticleSet
    particle_shadow: ParticleShadowPlan | None
    background: Background
    exposure: tuple[float, float, float]
    targets: tuple[Target, ...]
    passes: tuple[PassPlan, ...]
    sources: dict[str, tuple[str, ...]]
    counts: LightCounts
    id_names: tuple[str, ...]
    warnings: tuple[str, ...]
    snapshot: Snapshot
    blended: Blended | None = None

    def target(self, name: str) -> Target | None:
        """Return the target of that name, None if this frame has none."""
        return self._targets.get(name)

    @cached_property
    def _targets(self) -> dict[str, Target]:
        return {target.name: target for target in self.targets}

    def target_size(self, name: str) -> tuple[int, int]:
        """Return width and height of a target in texels."""
        target = self.target(name)
        if target is None:
            raise PlanError(f"this frame has no target {name!r}")
        if target.size is not None:
            return target.size
        width, height = self.view.size if target.per_sample else self.size
        return ((width + 1) // 2, (height + 1) // 2) if target.half else (width, height)

    @property
    def bytes_per_pixel(self) -> float:
        """Bytes per pixel of the picture in all targets but those with a size of their own."""
        total = sum(
            target.bytes_per_pixel * math.prod(self.target_size(target.name))
            for target in self.targets
            if target.size is None
        )
        return total / math.prod(self.size)

"""The frozen description of one frame: everything that passes or the float64 reference need, nothing else.

All numbers are float64, all places are in view space (X right, Y forward, Z up).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import LightCounts
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import GeometryVariant, Variant
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.lights import Falloff
from firefly_sample.scene.material import Material
from firefly_sample.settings import Settings

__all__ = ["Background", "Batch", "Capabilities", "FramePlan", "LightSet", "PassPlan", "SpriteSet", "View"]

Float64 = NDArray[np.float64]


@dataclass(frozen=True)
class Capabilities:
    """What a driver can do beyond OpenGL 3.3 core, as far as it changes a plan.

    Attributes
    ----------
    clip_control : bool
        ARB_clip_control: the [0, 1] clip range, without which reversed depth gains nothing.
    snorm_targets : bool
        RG16_SNORM can be rendered to; otherwise normals are stored in RG16.
    """

    clip_control: bool = True
    snorm_targets: bool = True


@dataclass(frozen=True)
class Background:
    """Linear colours where nothing is drawn: at and below the horizon, and straight up."""

    horizon: tuple[float, float, float]
    zenith: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class View:
    """The camera of one frame.

    Attributes
    ----------
    size : (int, int)
        Samples across and down: the picture's size times the supersampling.
    lens : LensConstants
        Of the clip range and direction that this frame draws with.
    reverse : bool
        True if near is depth 1, far 0, in the [0, 1] clip range; False for OpenGL's own.
    near, far : float
        Scene units; far may be infinite.
    world_to_view, view_to_world : ndarray of float64, shape (4, 4)
        For row vectors.
    """

    size: tuple[int, int]
    lens: LensConstants
    reverse: bool
    near: float
    far: float
    world_to_view: Float64
    view_to_world: Float64


@dataclass(frozen=True, eq=False)
class Batch:
    """One instanced draw: a Geom, a material, and where its instances are.

    Attributes
    ----------
    geom : Geom
    material : Material
    color : tuple of 4 floats or None
        A node's flat colour, which replaces vertex colours.
    base_color : tuple of 4 floats
        The material's linear base colour, times `color`.
    alpha_cutoff : float
    cutout : bool
        True if alpha below the material's cut-off is not drawn.
    mirrored : bool
        True if the instances' matrices turn triangles inside out.
    model_to_view : ndarray of float64, shape (n, 4, 4)
        Front to back.
    ids : ndarray of int32, shape (n,)
        Index of each geometry instance.
    variant : GeometryVariant
        Of the geometry pass.
    """

    geom: Geom
    material: Material
    color: tuple[float, float, float, float] | None
    base_color: tuple[float, float, float, float]
    alpha_cutoff: float
    cutout: bool
    mirrored: bool
    model_to_view: Float64
    ids: NDArray[np.int32]
    variant: GeometryVariant


@dataclass(frozen=True, eq=False)
class LightSet:
    """Point lights that share a falloff and a way to be drawn.

    Attributes
    ----------
    falloff : Falloff
    fullscreen : bool
        True if the volume would hold the whole view (or is too large for floats): drawn as full-screen quads.
    positions : ndarray of float64, shape (n, 3)
        View space.
    colors : ndarray of float64, shape (n, 3)
        Linear.
    radii : ndarray of float64, shape (n,)
        Scene units.
    """

    falloff: Falloff
    fullscreen: bool
    positions: Float64
    colors: Float64
    radii: Float64

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True, eq=False)
class SpriteSet:
    """Soft dots in view space: positions (n, 3), linear colours (n, 3), radii (n,), float64."""

    positions: Float64
    colors: Float64
    radii: Float64

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True)
class PassPlan:
    """One pass of a frame.

    Attributes
    ----------
    name : str
        Also the stem of its shaders and the key of its time.
    reads : tuple of str
        Targets that it samples.
    writes : tuple of str
        Targets that it clears and fills.
    updates : tuple of str
        Targets that it blends into or tests against.
    because : str
        What asked for it.
    variant : Variant
        Of its shader; the geometry pass has one for each batch instead.
    """

    name: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    updates: tuple[str, ...]
    because: str
    variant: Variant = field(default_factory=Variant)


@dataclass(frozen=True, eq=False)
class FramePlan:
    """One frame, complete. See the attributes' own classes.

    Attributes
    ----------
    size : (int, int)
        Of the picture in pixels.
    ambient : ndarray of float64, shape (3,)
        The sum of all ambient lights.
    background : Background
    exposure : tuple of 3 floats
        The scene's times the setting's; the classic look has none.
    counts : LightCounts
    id_names : tuple of str
        Path of each geometry instance, by id.
    """

    size: tuple[int, int]
    settings: Settings
    outputs: tuple[str, ...]
    time: float
    view: View
    batches: tuple[Batch, ...]
    ambient: Float64
    lights: tuple[LightSet, ...]
    sprites: SpriteSet
    background: Background
    exposure: tuple[float, float, float]
    targets: tuple[Target, ...]
    passes: tuple[PassPlan, ...]
    counts: LightCounts
    id_names: tuple[str, ...]
    warnings: tuple[str, ...]

    def target(self, name: str) -> Target | None:
        """The target of that name, None if this frame has none."""
        return next((target for target in self.targets if target.name == name), None)

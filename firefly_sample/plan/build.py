"""Turn a scene into a FramePlan: collect, cull, sort, choose targets and passes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LightError, NodeError, SceneError
from firefly_sample.frame import LightCounts, check_outputs, check_size
from firefly_sample.plan.collect import Group, Snapshot, collect
from firefly_sample.plan.cull import frustum_corners, holds_frustum, spheres_in_frustum
from firefly_sample.plan.frame_plan import (
    Background,
    Batch,
    Capabilities,
    FramePlan,
    LightSet,
    SpriteSet,
    View,
)
from firefly_sample.plan.steps import Needs, check_passes, choose_passes, choose_targets, geometry_variant
from firefly_sample.plan.variants import GeometryVariant
from firefly_sample.scene.lens import Lens, PerspectiveLens
from firefly_sample.scene.lights import Falloff
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings

__all__ = ["Planner", "build_plan"]

LARGEST = 1e30
"""Of exposures: what goes to the GPU as float32 keeps room for a product."""

Float64 = NDArray[np.float64]
PointRows = tuple[Float64, Float64, Float64]


def build_plan(
    scene: Scene,
    settings: Settings | None = None,
    size: tuple[int, int] = (800, 600),
    outputs: tuple[str, ...] = ("color",),
    time: float = 0.0,
    capabilities: Capabilities | None = None,
) -> FramePlan:
    """The plan of one frame; nothing is drawn and no driver is needed.

    Parameters
    ----------
    scene : Scene
        It is updated to `time` first.
    settings : Settings, optional
    size : (int, int)
        Width and height of the picture in pixels.
    outputs : tuple of str
        Names from `firefly_sample.frame.OUTPUTS`.
    time : float
        Seconds.
    capabilities : Capabilities, optional
        What the driver can do; everything when absent.

    Raises
    ------
    FireflyError
        If the size, an output, a light, the camera or the lens is wrong; the message names it.
    """
    return Planner().plan(scene, settings or Settings(), size, outputs, time, capabilities or Capabilities())


class Planner:
    """Builds plans and keeps what did not change between them (the walk of the scene graph)."""

    def __init__(self) -> None:
        self._snapshot = Snapshot()

    def plan(
        self,
        scene: Scene,
        settings: Settings,
        size: tuple[int, int],
        outputs: tuple[str, ...],
        time: float,
        capabilities: Capabilities,
    ) -> FramePlan:
        """See `build_plan`."""
        outputs, size = check_outputs(outputs, settings.supersample), check_size(size)
        if not np.isfinite(time):
            raise SceneError(f"time must be a finite number of seconds, got {time!r}")
        scene.update(time)
        camera_mask = scene.camera_node.camera_mask
        if not self._snapshot.is_current(scene.root, camera_mask):
            self._snapshot = collect(scene.root, camera_mask)
        snapshot = self._snapshot
        lens = _lens_for(scene.lens, size)
        world_to_view, view_to_world = _camera_matrices(scene)
        planes = lens.frustum_planes()
        groups = [_cull_group(group, world_to_view, planes) for group in snapshot.groups]
        geometry = sum(len(depths) for _, depths, _, _ in groups)
        in_scene, in_view, lights = _lights(snapshot, time, world_to_view, planes, lens)
        sprites = _sprites(snapshot, time, world_to_view, planes)
        ambient = np.sum([np.zeros(3), *(light.get_color() for light in snapshot.ambient)], axis=0)
        background = _background(scene)
        needs = Needs(
            settings=settings,
            outputs=outputs,
            capabilities=capabilities,
            geometry=geometry,
            lights=in_view,
            sprites=len(sprites),
            ambient=bool(ambient.any()),
            gradient=background.horizon != background.zenith,
            orthographic=not isinstance(lens, PerspectiveLens),
        )
        targets = choose_targets(needs)
        passes = choose_passes(needs, targets)
        check_passes(passes, targets)
        samples = (size[0] * settings.supersample, size[1] * settings.supersample)
        view = View(
            size=samples,
            lens=lens.constants("zero_to_one" if needs.reverse else "gl", needs.reverse),
            reverse=needs.reverse,
            near=lens.get_near(),
            far=lens.get_far(),
            world_to_view=world_to_view,
            view_to_world=view_to_world,
        )
        return FramePlan(
            size=size,
            settings=settings,
            outputs=outputs,
            time=float(time),
            view=view,
            batches=_batches(groups, geometry_variant(needs, targets)),
            ambient=ambient,
            lights=lights,
            sprites=sprites,
            background=background,
            exposure=_exposure(scene, settings),
            targets=targets,
            passes=passes,
            counts=LightCounts(in_scene, in_view, in_view - sum(map(len, lights))),
            id_names=snapshot.id_names,
            warnings=_warnings(snapshot, settings, capabilities),
        )


def _background(scene: Scene) -> Background:
    """The background's two colours, checked."""
    given = scene.background
    pair = (given.horizon, given.zenith) if isinstance(given, VerticalGradient) else (given, given)
    colors = []
    for color in pair:
        try:
            rgb = np.asarray(color, dtype=np.float64)
        except (TypeError, ValueError):
            rgb = np.full(3, np.nan)
        if rgb.shape != (3,) or not np.isfinite(rgb).all() or rgb.min() < 0:
            raise SceneError(f"background must be finite linear colours of 0 or more, got {color!r}")
        colors.append((float(rgb[0]), float(rgb[1]), float(rgb[2])))
    return Background(*colors)


def _exposure(scene: Scene, settings: Settings) -> tuple[float, float, float]:
    """The scene's exposure times the setting's, a channel each, checked."""
    try:
        rgb = np.broadcast_to(np.asarray(scene.exposure, dtype=np.float64), (3,)) * settings.exposure
    except (TypeError, ValueError):
        rgb = np.zeros(3)
    if not (rgb.min() > 0 and rgb.max() <= LARGEST):
        raise SceneError(
            f"a scene's exposure, times the setting's {settings.exposure:g}, must be one or three numbers "
            f"above 0 and up to {LARGEST:g}, got {scene.exposure!r}"
        )
    return float(rgb[0]), float(rgb[1]), float(rgb[2])


def _lens_for(lens: Lens, size: tuple[int, int]) -> Lens:
    """The lens with the picture's aspect ratio (its vertical field of view stays)."""
    aspect = size[0] / size[1]
    if abs(lens.get_aspect_ratio() / aspect - 1.0) < 1e-4:
        return lens
    return lens.with_aspect_ratio(aspect)


def _camera_matrices(scene: Scene) -> tuple[Float64, Float64]:
    """World to view and back, without the scale and the shear that a camera's parents may have.

    The way forward stays; right and up are made perpendicular to it.
    """
    net = np.array(scene.camera.get_net_transform().get_mat(), dtype=np.float64)
    if not np.isfinite(net).all() or not np.linalg.det(net[:3, :3]) > 0:
        raise NodeError(
            f"camera {scene.camera}: its net transform is singular, mirrored or not finite: "
            "give it and its parents scales above 0"
        )
    forward = net[1, :3] / np.linalg.norm(net[1, :3])
    right = net[0, :3] - (net[0, :3] @ forward) * forward
    right /= np.linalg.norm(right)
    view_to_world = np.eye(4)
    view_to_world[:3, :3] = right, forward, np.cross(right, forward)
    view_to_world[3, :3] = net[3, :3]
    return np.asarray(np.linalg.inv(view_to_world), dtype=np.float64), view_to_world


def _cull_group(
    group: Group, world_to_view: Float64, planes: Float64
) -> tuple[Group, Float64, Float64, NDArray[np.int32]]:
    """A group's instances in view, nearest first: (group, depths, model_to_view, ids)."""
    centers = group.centers @ world_to_view[:3, :3] + world_to_view[3, :3]
    seen = np.flatnonzero(spheres_in_frustum(planes, centers, group.radii))
    nearest = centers[seen, 1] - group.radii[seen]
    order = np.argsort(nearest, kind="stable")
    chosen = seen[order]
    return group, nearest[order], group.model_to_world[chosen] @ world_to_view, group.ids[chosen]


def _batches(
    groups: list[tuple[Group, Float64, Float64, NDArray[np.int32]]], frame: GeometryVariant
) -> tuple[Batch, ...]:
    """Draws, opaque ones first, then cut-outs, each front to back by their nearest instance."""
    keyed = []
    for index, (group, depths, model_to_view, ids) in enumerate(groups):
        if not len(depths):
            continue
        material = group.material
        cutout = material.alpha_mode != "opaque"
        variant = GeometryVariant(
            frame.albedo,
            frame.normal,
            frame.distance,
            frame.id,
            frame.classic,
            frame.snorm,
            frame.orthographic,
            textured=material.texture is not None,
            vertex_color=group.geom.colors is not None and group.color is None,
            cutout=cutout,
            double_sided=material.double_sided,
        )
        batch = Batch(
            geom=group.geom,
            material=material,
            color=group.color,
            base_color=_base_color(group),
            alpha_cutoff=material.alpha_cutoff,
            cutout=cutout,
            mirrored=group.mirrored,
            model_to_view=model_to_view,
            ids=ids,
            variant=variant,
        )
        keyed.append(((cutout, depths[0], index), batch))
    return tuple(batch for _, batch in sorted(keyed, key=lambda entry: entry[0]))


def _base_color(group: Group) -> tuple[float, float, float, float]:
    own = group.material.base_color
    r, g, b, a = own if group.color is None else own * group.color
    return float(r), float(g), float(b), float(a)


def _lights(
    snapshot: Snapshot, time: float, world_to_view: Float64, planes: Float64, lens: Lens
) -> tuple[int, int, tuple[LightSet, ...]]:
    """How many lights the scene has, how many can change this view, and these by falloff and way to draw."""
    in_scene, in_view, rows = 0, 0, []
    for node, net in snapshot.lights:
        arrays = node.evaluate(time)
        in_scene += len(arrays)
        positions = arrays.positions @ (net @ world_to_view)[:3, :3] + (net @ world_to_view)[3, :3]
        if not np.isfinite(positions).all():
            raise LightError(f"light {node.name!r}: its place in view space is not finite")
        useful = (arrays.radii > 0) & arrays.colors.any(axis=1)
        chosen = np.flatnonzero(useful & spheres_in_frustum(planes, positions, arrays.radii))
        in_view += len(chosen)
        rows.append((node.falloff, (positions[chosen], arrays.colors[chosen], arrays.radii[chosen])))
    corners = frustum_corners(lens.constants(), lens.get_near(), lens.get_far())
    sets = []
    for falloff in Falloff:
        parts = [row for kind, row in rows if kind is falloff]
        if not parts:
            continue
        positions, colors, radii = (np.concatenate(column) for column in zip(*parts, strict=True))
        full = holds_frustum(corners, positions, radii)
        for fullscreen, mask in ((False, ~full), (True, full)):
            if mask.any():
                sets.append(LightSet(falloff, fullscreen, positions[mask], colors[mask], radii[mask]))
    return in_scene, in_view, tuple(sets)


def _sprites(snapshot: Snapshot, time: float, world_to_view: Float64, planes: Float64) -> SpriteSet:
    """All dots in view, in view space."""
    parts: list[PointRows] = [(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))]
    for node, net in snapshot.sprites:
        arrays = node.evaluate(time)
        positions = arrays.positions @ (net @ world_to_view)[:3, :3] + (net @ world_to_view)[3, :3]
        useful = (arrays.radii > 0) & arrays.colors.any(axis=1)
        chosen = np.flatnonzero(useful & spheres_in_frustum(planes, positions, arrays.radii))
        parts.append((positions[chosen], arrays.colors[chosen], arrays.radii[chosen]))
    return SpriteSet(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _warnings(snapshot: Snapshot, settings: Settings, capabilities: Capabilities) -> tuple[str, ...]:
    blended = dict.fromkeys(
        group.material.name for group in snapshot.groups if group.material.alpha_mode == "blend"
    )
    warnings = []
    if blended:
        warnings.append(
            f"blended materials are drawn as cut-outs: {', '.join(blended)} "
            "(deferred shading keeps one surface a pixel)"
        )
    if settings.position == "depth32f" and not capabilities.clip_control:
        warnings.append(
            "position=depth32f: the driver lacks ARB_clip_control, so depth is a standard 24-bit buffer, "
            "as accurate as depth24; position=linear32f is accurate here"
        )
    return tuple(warnings)

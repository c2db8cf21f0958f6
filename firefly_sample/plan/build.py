"""Turn a scene into a FramePlan: collect, cull, sort, choose targets and passes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from firefly_sample.errors import OutputError, PlanError, SceneError
from firefly_sample.frame import LightCounts, check_outputs, check_size
from firefly_sample.memo import Memo
from firefly_sample.plan.blending.planner import BlendingPlanner
from firefly_sample.plan.collect import Snapshot, collect
from firefly_sample.plan.exposure import ExposureMeter
from firefly_sample.plan.frame_graph import Declares, FrameGraph, choose_passes
from firefly_sample.plan.frame_plan import Background, Batch, Capabilities, FramePlan, SpriteSet
from firefly_sample.plan.frustum import spheres_in_frustum
from firefly_sample.plan.lights.clusters import Clusters, plan_clusters
from firefly_sample.plan.lights.light_set import any_channel
from firefly_sample.plan.lights.lighting import choose_method, light_scene
from firefly_sample.plan.needs import PICTURES, Needs
from firefly_sample.plan.particles.cloud import gather_particles
from firefly_sample.plan.particles.shadow import plan_particle_shadow
from firefly_sample.plan.particles.visible import see_particles
from firefly_sample.plan.plan_warnings import PlanWarnings
from firefly_sample.plan.shadows.planner import ShadowPlanner
from firefly_sample.plan.targets import COARSE_DEPTH
from firefly_sample.plan.view import Eye, View, eye_state
from firefly_sample.plan.visible import Visible, make_batches
from firefly_sample.scene.arrays import LARGEST, Float64, as_color, as_numbers
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings, to_number

_MATERIAL = ("specular", "shininess", "emission", "metallic", "roughness")
_LIGHT = ("radiance", "light", "overdraw", "volumes", "wireframe", "shadow_atlas", "particle_shadow_atlas")
MISSING = {"classic": (*_MATERIAL, "color_alpha"), "flat": (*_MATERIAL, *_LIGHT)}
"""Outputs that a look does not have."""

PointRows = tuple[Float64, Float64, Float64]


class Planner:
    """Builds plans, and keeps from one to the next the parts that did not change.

    Those are walks of the graph, shadow maps and draws. The passes are in drawing order; for `window`, see
    `firefly_sample.plan.view.Eye`.
    """

    def __init__(self, passes: Sequence[Declares], window: bool = False) -> None:
        names = [step.name for step in passes]
        if len(set(names)) < len(names):
            raise PlanError(f"passes need names of their own, got {', '.join(names)}")
        self._passes = passes
        self._window = window
        self._root: NodePath | None = None
        self._snapshots: dict[int, Snapshot] = {}
        self._shadows = ShadowPlanner()
        self._warnings = PlanWarnings()
        self._meter = ExposureMeter()
        self._eye: Memo[Eye] = Memo()
        self._seen: Memo[Visible] = Memo()
        self._graph: Memo[FrameGraph] = Memo(2)  # pictures and masks may be drawn in turn
        self._batches: Memo[tuple[Batch, ...]] = Memo()
        self._blending = BlendingPlanner()

    def plan(
        self,
        scene: Scene,
        settings: Settings,
        size: tuple[int, int],
        outputs: tuple[str, ...],
        time: float,
        capabilities: Capabilities,
    ) -> FramePlan:
        """Return the plan of one frame: see `firefly_sample.pipeline.build_plan`."""
        outputs, size = check_outputs(outputs, settings.supersample), check_size(size)
        seconds = to_number(time)
        if not np.isfinite(seconds):
            raise SceneError(f"time must be a finite number of seconds, got {time!r}")
        scene.update(seconds)
        if self._root != scene.root:  # the kept values are another scene's
            self._root, self._snapshots, self._shadows = scene.root, {}, ShadowPlanner()
        snapshot = self._snapshot(scene, scene.camera_node.camera_mask)
        settings = self._meter.with_number(snapshot, settings, seconds)  # plans have no "auto"
        eye = self._eye.get(eye_state(scene, size), lambda: Eye(scene, size, self._window))
        lens, camera, planes = eye.lens, eye.camera, eye.planes
        instances = snapshot.instances
        seen = self._seen.get(
            (instances, instances.revisions(), eye, settings.look == "panda3d"),
            lambda: Visible(instances, camera.world_to_view, planes, settings.look == "panda3d"),
        )
        exposure = _exposure(scene, to_number(settings.exposure))
        blended = seen.blended if settings.look != "classic" else (False,) * len(seen.parts)
        blended_count = seen.count(blended)
        reverse = capabilities.clip_control and settings.position_method not in COARSE_DEPTH
        view = View(
            size=(size[0] * settings.supersample, size[1] * settings.supersample),
            lens=lens.constants("zero_to_one" if reverse else "gl", reverse),
            reverse=reverse,
            near=lens.get_near(),
            far=lens.get_far(),
            world_to_view=camera.world_to_view,
            view_to_world=camera.view_to_world,
        )
        cloud = gather_particles(snapshot, seconds) if settings.look == "correct" else None
        lighting = light_scene(
            snapshot,
            lambda mask: self._snapshot(scene, mask),
            self._shadows,
            settings,
            seconds,
            eye,
            seen,
            exposure,
            view,
            None if cloud is None else cloud.light,
        )
        dots = snapshot.sprites if settings.look in ("correct", "classic") else []
        sprites = _sprites(dots, seconds, camera.world_to_view, planes)
        particle_shadow = None
        if cloud is not None and lighting.particle_shadowed_kind is not None:
            particle_shadow = plan_particle_shadow(cloud, settings)
        particles = see_particles(
            cloud, camera.world_to_view, lens, sprites.positions, settings, particle_shadow
        )
        ambient = snapshot.ambient_color() if settings.look != "flat" else np.zeros(3)
        background = _background(scene)
        surfaces = seen.nearest, seen.farthest
        light_method = choose_method(settings, lighting.sets, view, *surfaces)
        needs = Needs(
            settings=settings,
            method=light_method.name,
            outputs=outputs,
            capabilities=capabilities,
            geometry=len(seen) - blended_count,
            blended=blended_count,
            sprites=len(sprites),
            particles=len(particles),
            lights=lighting.counts(),
            endless=lighting.endless(),
            shadowed=lighting.counts(shadowed=True),
            particle_shadowed_kind=lighting.particle_shadowed_kind,
            particle_shadow=particle_shadow,
            maps=len(lighting.shadows.maps),
            atlas=lighting.shadows.size,
            ambient=bool(ambient.any()),
            gradient=background.horizon != background.zenith,
            looks=seen.looks(not each for each in blended),
            blended_looks=seen.looks(blended),
            depth_offsets=seen.depth_offsets(not each for each in blended),
            orthographic=not view.lens.perspective,
            reverse=reverse,
        )
        for name in outputs:
            if name in MISSING.get(settings.look, ()):
                raise OutputError(f"look {settings.look!r} has no output {name!r}: choose look 'correct'")
            if needs.forward and name not in PICTURES:
                raise OutputError(
                    f"light_method=forward keeps no G-buffer to make {name!r} from: ask for color, "
                    "color_alpha or radiance, or choose another light_method"
                )
            if name == "light" and needs.half and needs.metals:
                raise OutputError(
                    "light_resolution=half keeps the light of metallic materials without what their "
                    f"highlights reflect, and cannot make 'light' of it ({needs.looks.metallic}): choose "
                    "light_resolution=full, or leave color, color_alpha and radiance out"
                )
        graph = self._graph.get(needs, lambda: choose_passes(self._passes, needs))
        clusters: tuple[Clusters, ...] = ()
        if light_method.name == "clustered" and (needs.lit or needs.counts_cells):
            if settings.position_method not in ("linear32f", "stored32f") and surfaces[0] <= surfaces[1]:
                surfaces = view.near, view.far  # shaders may find them anywhere by a coarse depth
            clusters = plan_clusters(lighting.sets, view, *surfaces)
        mixed = self._blending.plan(needs, seen, blended, view, lighting.sets, particles, sprites)
        warnings = self._warnings.find(needs, snapshot, eye, view, seen, lighting, cloud, exposure)
        if mixed is not None and mixed.order is not None:
            warnings += mixed.order.warnings
        return FramePlan(
            size=size,
            settings=settings,
            outputs=outputs,
            time=seconds,
            view=view,
            batches=self._batches.get(
                (seen, view.near, blended), lambda: make_batches(seen, view.near, blended)
            ),
            ambient=ambient,
            lights=lighting.sets,
            light_method=light_method,
            clusters=clusters,
            shadows=lighting.shadows,
            sprites=sprites,
            particles=particles,
            particle_shadow=particle_shadow,
            background=background,
            exposure=exposure,
            targets=graph.targets,
            passes=graph.passes,
            sources=graph.sources,
            counts=LightCounts(lighting.in_scene, sum(map(len, lighting.sets)), 0),
            id_names=snapshot.id_names,
            warnings=warnings,
            snapshot=snapshot,
            blended=mixed,
        )

    def _snapshot(self, scene: Scene, mask: int) -> Snapshot:
        """Return the nodes that a camera with a mask sees; the graph is walked again only after a change."""
        kept = self._snapshots.get(mask)
        if kept is not None and kept.is_current(scene.root, mask):
            return kept
        found = self._snapshots[mask] = collect(scene.root, mask)
        if kept is not None and found.instances.draws_as(kept.instances):
            found.instances = kept.instances  # a light has moved, the geometry has not
        return found


def _background(scene: Scene) -> Background:
    """Return the background's two colours, checked."""
    given = scene.background
    pair = (given.horizon, given.zenith) if isinstance(given, VerticalGradient) else (given, given)
    colors = []
    for color in pair:
        rgb = as_color("background", color, 3, LARGEST)
        colors.append((float(rgb[0]), float(rgb[1]), float(rgb[2])))
    return Background(*colors)


def _exposure(scene: Scene, factor: float) -> tuple[float, float, float]:
    """Return the scene's exposure times the setting's, for each channel, checked."""
    given = as_numbers("a scene's exposure", scene.exposure, SceneError, "one or three numbers")
    rgb = np.broadcast_to(given, (3,)) * factor if given.shape in ((), (3,)) else np.zeros(3)
    if not (rgb.min() > 0 and rgb.max() <= LARGEST):
        raise SceneError(
            f"a scene's exposure, times the setting's {factor:g}, must be one or three numbers "
            f"above 0 and up to {LARGEST:g}, got {scene.exposure!r}"
        )
    return float(rgb[0]), float(rgb[1]), float(rgb[2])


def _sprites(
    dots: Sequence[tuple[Sprites, Float64]], time: float, world_to_view: Float64, planes: Float64
) -> SpriteSet:
    """Return all dots in view, in view space."""
    parts: list[PointRows] = [(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))]
    for node, net in dots:
        arrays = node.evaluate(time)
        to_view = net @ world_to_view
        positions = arrays.positions @ to_view[:3, :3] + to_view[3, :3]
        useful = (arrays.radii > 0) & any_channel(arrays.colors)
        chosen = np.flatnonzero(useful & spheres_in_frustum(planes, positions, arrays.radii))
        colors, radii = arrays.colors.take(chosen, axis=0), arrays.radii.take(chosen)
        parts.append((positions.take(chosen, axis=0), colors, radii))
    return SpriteSet(*(np.concatenate(column) for column in zip(*parts, strict=True)))

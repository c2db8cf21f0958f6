"""The textures behind a plan's targets, and the framebuffers of its passes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Set

import moderngl

from firefly_sample.errors import GpuError, PlanError
from firefly_sample.gpu.device import Device
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.targets import FORMATS, Target


def make_texture(
    device: Device, format_name: str, size: tuple[int, int], compare: str = ""
) -> moderngl.Texture:
    """Return an image to draw into, of a format of `FORMATS`; it is read texel by texel."""
    form = FORMATS[format_name]
    if form.depth:
        texture = device.ctx.depth_texture(size)
        texture.compare_func = compare
        texture.use(0)
        if form.gl_format is not None:
            device.raw.allocate_depth(size, form.gl_format)
    else:
        texture = device.ctx.texture(size, form.components, dtype=form.dtype, internal_format=form.gl_format)
        if form.components == 1 and form.dtype != "u4":
            texture.swizzle = "RRR1"  # one number stands for three colours
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    texture.repeat_x = texture.repeat_y = False
    return texture


Key = tuple[str, str, tuple[int, int]]
"""A target's name, format and size."""


class Images:
    """Textures by target, kept from frame to frame while size and format stay.

    Those of the frame before are kept, too, while the picture's size stays: frames of two kinds that are
    drawn in turn, such as pictures and masks, do not make their textures again and again.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures: dict[Key, moderngl.Texture] = {}
        self._framebuffers: dict[tuple[str, tuple[Key, ...]], moderngl.Framebuffer] = {}
        self._writers: dict[Key, str] = {}
        self._before: tuple[tuple[int, int], frozenset[Key]] = (0, 0), frozenset()

    def check_limits(self, plan: FramePlan) -> None:
        """Raise `GpuError` if picture, shadow maps or particle shadow slices are too large."""
        limit = self._device.max_size
        self._device.check_size(plan.size, plan.settings.supersample)
        width, height = plan.shadows.size
        if max(width, height) > limit:
            raise GpuError(
                f"the shadow maps need {width}x{height} texels, above this driver's limit of {limit} a side: "
                "set shadow_atlas to that"
            )
        width, height = (0, 0) if plan.particle_shadow is None else plan.particle_shadow.size
        if max(width, height) > limit:
            raise GpuError(
                f"the particle shadow slices need {width}x{height} texels, above this driver's limit of "
                f"{limit} a side: choose a smaller particle_shadow_tile, or fewer particle_shadow_slices"
            )

    def prepare(self, plan: FramePlan) -> None:
        """Make the textures of a plan, and free those that it and the plan before do not use."""
        wanted = frozenset(self._key(plan, target) for target in plan.targets)
        (size, kept), self._before = self._before, (plan.view.size, wanted)
        unused = self._textures.keys() - wanted
        if size == plan.view.size:
            unused -= kept
        if unused:
            self._release_framebuffers(unused)
            for key in unused:
                self._textures.pop(key).release()
                self._writers.pop(key, None)
        missing = [target for target in plan.targets if self._key(plan, target) not in self._textures]
        if not missing:
            return
        try:
            for target in missing:
                key = self._key(plan, target)
                self._textures[key] = make_texture(self._device, target.format, key[2], target.compare)
        except moderngl.Error as error:
            raise self._no_memory(plan) from error
        if self._device.ctx.error != "GL_NO_ERROR":
            raise self._no_memory(plan)

    def _no_memory(self, plan: FramePlan) -> GpuError:
        """Free everything, and return an error that says how much memory was needed."""
        self.release()
        while self._device.ctx.error != "GL_NO_ERROR":
            pass
        size = sum(target.bytes_per_pixel * math.prod(self._key(plan, target)[2]) for target in plan.targets)
        width, height = plan.view.size
        return GpuError(
            f"the driver has no room for {width}x{height} samples of {len(plan.targets)} targets, "
            f"{size / 2**20:,.0f} MiB: choose a smaller size, or supersample 1"
        )

    def _key(self, plan: FramePlan, target: Target) -> Key:
        return target.name, target.format, plan.target_size(target.name)

    def texture(self, plan: FramePlan, name: str) -> moderngl.Texture:
        """Return the texture of a target of this plan."""
        return self._textures[self._key(plan, _target(plan, name))]

    def framebuffer(self, plan: FramePlan, step: PassPlan, names: tuple[str, ...]) -> moderngl.Framebuffer:
        """Return a pass's own framebuffer: timer queries read wrong on a shared one."""
        key = step.name, tuple(self._key(plan, _target(plan, name)) for name in names)
        if key not in self._framebuffers:
            textures = {name: self.texture(plan, name) for name in names}
            depth = next((name for name in names if FORMATS[_target(plan, name).format].depth), None)
            buffer = None if depth is None else textures.pop(depth)
            try:
                self._framebuffers[key] = self._device.ctx.framebuffer(list(textures.values()), buffer)
            except moderngl.Error as error:
                raise self._no_memory(plan) from error
        return self._framebuffers[key]

    def note_writer(self, plan: FramePlan, step: PassPlan, names: Iterable[str]) -> None:
        """Remember which pass wrote some targets last."""
        self._writers |= {self._key(plan, _target(plan, name)): step.name for name in names}

    def writer(self, plan: FramePlan, name: str) -> str | None:
        """Return the pass that wrote a target last, in this frame or one before; None if none did."""
        target = plan.target(name)
        return None if target is None else self._writers.get(self._key(plan, target))

    def _release_framebuffers(self, textures: Set[Key]) -> None:
        """Free the framebuffers that draw into one of these textures."""
        self._device.unbind()
        for key in [key for key in self._framebuffers if not textures.isdisjoint(key[1])]:
            self._framebuffers.pop(key).release()

    def release(self) -> None:
        """Free all textures and framebuffers."""
        self._release_framebuffers(self._textures.keys())
        for texture in self._textures.values():
            texture.release()
        self._textures.clear()
        self._writers.clear()


def _target(plan: FramePlan, name: str) -> Target:
    target = plan.target(name)
    if target is None:
        raise PlanError(f"this frame has no target {name!r}")
    return target


class BoundImages:
    """The targets of one pass; those that it did not declare are refused with a `PlanError`."""

    def __init__(self, images: Images, plan: FramePlan, step: PassPlan) -> None:
        self._images = images
        self._plan = plan
        self._step = step
        self._drawn = (*step.writes, *step.updates)

    def read(self, name: str) -> moderngl.Texture:
        """Return the texture of a target that the pass reads."""
        if name not in self._step.reads:
            raise PlanError(f"pass {self._step.name!r} does not declare that it reads {name!r}")
        return self._images.texture(self._plan, name)

    def samplers(self, names: Iterable[str] | None = None) -> dict[str, moderngl.Texture]:
        """Return targets that the pass reads, all or these, by the names of their samplers: ``u_<name>``.

        A copied depth buffer is ``u_depth``.
        """
        names = self._step.reads if names is None else names
        return {f"u_{'depth' if name == 'depth_copy' else name}": self.read(name) for name in names}

    def reads(self) -> tuple[str, ...]:
        """Return the targets that the pass reads."""
        return self._step.reads

    def own(self, name: str) -> moderngl.Texture:
        """Return the texture of a target that the pass writes or updates, to copy into."""
        if name not in self._drawn:
            raise PlanError(f"pass {self._step.name!r} does not declare that it writes {name!r}")
        return self._images.texture(self._plan, name)

    def writer(self, name: str) -> str | None:
        """Return the pass that wrote a target last, in this frame or one before; None if none did."""
        return self._images.writer(self._plan, name)

    def color_names(self) -> tuple[str, ...]:
        """Return the colour targets that the pass draws into, in attachment order."""
        return tuple(name for name in self._drawn if not FORMATS[_target(self._plan, name).format].depth)

    def draw_into(self) -> moderngl.Framebuffer:
        """Return the pass's framebuffer, bound, with its viewport set and what the pass writes cleared.

        All colour targets clear to zero (integers too), so that one clear serves them.
        """
        framebuffer = self._images.framebuffer(self._plan, self._step, self._drawn)
        framebuffer.use()
        framebuffer.viewport = (0, 0, *framebuffer.size)
        written = [_target(self._plan, name) for name in self._step.writes]
        depth = next((target for target in written if FORMATS[target.format].depth), None)
        framebuffer.depth_mask = depth is not None
        self._images.note_writer(self._plan, self._step, (*self._step.writes, *self.color_names()))
        if written:
            kept = [name for name in self.color_names() if name not in self._step.writes]
            cleared = self.framebuffer_of(*self._step.writes) if kept else framebuffer
            cleared.clear(0.0, 0.0, 0.0, 0.0, depth=depth.clear[0] if depth else 1.0)
            framebuffer.use()
        return framebuffer

    def encodes_srgb(self) -> bool:
        """Return whether the pass draws into a target whose values the driver encodes."""
        return any(FORMATS[_target(self._plan, name).format].srgb for name in self.color_names())

    def keep_into(self) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        """Return the texture and the bound framebuffer of a depth target, which is not cleared."""
        (name,) = self._step.writes
        framebuffer = self.framebuffer_of(name)
        framebuffer.use()
        framebuffer.depth_mask = True
        self._images.note_writer(self._plan, self._step, (name,))
        return self._images.texture(self._plan, name), framebuffer

    def framebuffer_of(self, *names: str) -> moderngl.Framebuffer:
        """Return a framebuffer of some targets alone, or of one to copy from or to."""
        return self._images.framebuffer(self._plan, self._step, names)

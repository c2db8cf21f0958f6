"""The textures behind a plan's targets, and the framebuffers of its passes."""

from __future__ import annotations

import math
from collections.abc import Iterable

import moderngl

from firefly_sample.errors import GpuError, PlanError
from firefly_sample.gpu.device import Device
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.targets import FORMATS, Target


def make_texture(
    device: Device, format_name: str, size: tuple[int, int], compare: str = ""
) -> moderngl.Texture:
    """An image to draw into, of a format of `FORMATS`; read texel by texel."""
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


class Images:
    """Textures by target, kept from frame to frame while size and format stay."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures: dict[tuple[str, str, tuple[int, int]], moderngl.Texture] = {}
        self._framebuffers: dict[tuple[str, tuple[str, ...]], moderngl.Framebuffer] = {}
        self._writers: dict[tuple[str, str, tuple[int, int]], str] = {}

    def prepare(self, plan: FramePlan) -> None:
        """Forget everything of another size or format, so that memory follows what is drawn."""
        wanted = {self._key(plan, target) for target in plan.targets}
        if all(key in self._textures for key in wanted):
            return
        self._release_framebuffers()
        for key in self._textures.keys() - wanted:
            self._textures.pop(key).release()
            self._writers.pop(key, None)
        try:
            for target in plan.targets:
                key = self._key(plan, target)
                if key not in self._textures:
                    self._textures[key] = make_texture(self._device, target.format, key[2], target.compare)
        except moderngl.Error as error:
            raise self._no_memory(plan) from error
        if self._device.ctx.error != "GL_NO_ERROR":
            raise self._no_memory(plan)

    def _no_memory(self, plan: FramePlan) -> GpuError:
        """Give everything back, and say what could not be had."""
        self.release()
        while self._device.ctx.error != "GL_NO_ERROR":
            pass
        size = sum(target.bytes_per_pixel * math.prod(self._key(plan, target)[2]) for target in plan.targets)
        width, height = plan.view.size
        return GpuError(
            f"the driver has no room for {width}x{height} samples of {len(plan.targets)} targets, "
            f"{size / 2**20:,.0f} MiB: choose a smaller size, or supersample 1"
        )

    def _key(self, plan: FramePlan, target: Target) -> tuple[str, str, tuple[int, int]]:
        return target.name, target.format, plan.target_size(target.name)

    def texture(self, plan: FramePlan, name: str) -> moderngl.Texture:
        """The texture of a target of this plan."""
        target = plan.target(name)
        if target is None:
            raise PlanError(f"this frame has no target {name!r}")
        return self._textures[self._key(plan, target)]

    def framebuffer(self, plan: FramePlan, step: PassPlan, names: tuple[str, ...]) -> moderngl.Framebuffer:
        """A pass's own framebuffer (timer queries read wrong on a shared one) over the shared textures."""
        key = (step.name, names)
        if key not in self._framebuffers:
            textures = {name: self.texture(plan, name) for name in names}
            depth = [name for name in names if FORMATS[_format(plan, name)].depth]
            colors = [texture for name, texture in textures.items() if name not in depth]
            try:
                self._framebuffers[key] = self._device.ctx.framebuffer(
                    colors, textures[depth[0]] if depth else None
                )
            except moderngl.Error as error:
                raise self._no_memory(plan) from error
        return self._framebuffers[key]

    def note_writer(self, plan: FramePlan, step: PassPlan, names: Iterable[str]) -> None:
        """Remember which pass wrote some targets last."""
        for name in names:
            target = plan.target(name)
            assert target is not None
            self._writers[self._key(plan, target)] = step.name

    def writer(self, plan: FramePlan, name: str) -> str | None:
        """The pass that wrote a target last, in this frame or one before; None where none did."""
        target = plan.target(name)
        return None if target is None else self._writers.get(self._key(plan, target))

    def _release_framebuffers(self) -> None:
        self._device.unbind()
        for framebuffer in self._framebuffers.values():
            framebuffer.release()
        self._framebuffers.clear()

    def release(self) -> None:
        """Free all textures and framebuffers."""
        self._release_framebuffers()
        for texture in self._textures.values():
            texture.release()
        self._textures.clear()
        self._writers.clear()


def _format(plan: FramePlan, name: str) -> str:
    target = plan.target(name)
    assert target is not None
    return target.format


class BoundImages:
    """What one pass may touch: only what it declared."""

    def __init__(self, images: Images, plan: FramePlan, step: PassPlan) -> None:
        self._images = images
        self._plan = plan
        self._step = step

    def read(self, name: str) -> moderngl.Texture:
        """The texture of a target that the pass reads.

        Raises
        ------
        PlanError
            If the pass does not declare that it reads it.
        """
        if name not in self._step.reads:
            raise PlanError(f"pass {self._step.name!r} does not declare that it reads {name!r}")
        return self._images.texture(self._plan, name)

    def own(self, name: str) -> moderngl.Texture:
        """The texture of a target that the pass writes or updates, to copy into.

        Raises
        ------
        PlanError
            If the pass does not declare it.
        """
        if name not in (*self._step.writes, *self._step.updates):
            raise PlanError(f"pass {self._step.name!r} does not declare that it writes {name!r}")
        return self._images.texture(self._plan, name)

    def writer(self, name: str) -> str | None:
        """The pass that wrote a target last, in this frame or one before; None where none did."""
        return self._images.writer(self._plan, name)

    def color_names(self) -> tuple[str, ...]:
        """The colour targets that the pass draws into, in attachment order."""
        names = (*self._step.writes, *self._step.updates)
        return tuple(name for name in names if not FORMATS[_format(self._plan, name)].depth)

    def draw_into(self) -> moderngl.Framebuffer:
        """The pass's framebuffer, bound, with its viewport set and what the pass writes cleared.

        All colour targets clear to zero (integers too), so that one clear serves them.
        """
        names = (*self._step.writes, *self._step.updates)
        framebuffer = self._images.framebuffer(self._plan, self._step, names)
        framebuffer.use()
        framebuffer.viewport = (0, 0, *framebuffer.size)
        written = [self._plan.target(name) for name in self._step.writes]
        depth = next((made for made in written if made and FORMATS[made.format].depth), None)
        framebuffer.depth_mask = depth is not None
        self._images.note_writer(self._plan, self._step, (*self._step.writes, *self.color_names()))
        if written:
            framebuffer.clear(0.0, 0.0, 0.0, 0.0, depth=depth.clear[0] if depth else 1.0)
        return framebuffer

    def encodes_srgb(self) -> bool:
        """Whether the driver encodes something that the pass draws."""
        return any(FORMATS[_format(self._plan, name)].srgb for name in self.color_names())

    def keep_into(self) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
        """The texture and the framebuffer of a depth target that keeps what it has; bound, to be written."""
        (name,) = self._step.writes
        framebuffer = self.framebuffer_of(name)
        framebuffer.use()
        framebuffer.depth_mask = True
        self._images.note_writer(self._plan, self._step, (name,))
        return self._images.texture(self._plan, name), framebuffer

    def framebuffer_of(self, name: str) -> moderngl.Framebuffer:
        """A framebuffer of one target alone, to copy from or to."""
        return self._images.framebuffer(self._plan, self._step, (name,))

"""The renderer: a plan's passes in their fixed order, and the images that they leave."""

from __future__ import annotations

import sys
import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NoReturn, SupportsIndex

from firefly_sample.errors import GpuError, SoftwareDriverWarning
from firefly_sample.frame import Frame, check_size
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.driver_checks import silent_changes, software_warning
from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.presenter import Layer, Presenter
from firefly_sample.passes.base import Pass
from firefly_sample.passes.lights import LIGHT_PASSES
from firefly_sample.pending import PendingFrame, count_walked
from firefly_sample.pipeline import PASSES
from firefly_sample.plan.build import Planner
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.readback import Surface
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

_AHEAD = 1
"""The number of frames drawn before `Renderer.render_many` reads one: enough to keep CPU and GPU busy."""


class Renderer:
    """Draws scenes into Frames. A context manager: it frees its GL objects when left.

    Its OpenGL context is current only during a call; afterwards the one that was current before is so again.
    Threads that share a renderer wait for each other. One that is dropped without `close` is freed with a
    `ResourceWarning`.

    Parameters
    ----------
    size : (int, int)
        Width and height in pixels; `resize` changes it.
    settings : Settings, optional
    device : int, optional
        EGL device index.
    require_gpu : bool
        Refuse a software driver instead of warning about it.
    count_fragments : bool
        Count what the lighting passes shade, in `Frame.shaded`: fragments, and for clustered light, whose
        fragments walk lists, the lights in these lists. This reads the G-buffer back.
    reuse : bool
        Keep the G-buffer while neither camera nor geometry changes; the attribute can be changed. False draws
        all of it in every frame, for measuring.
    window : bool
        Draw with the context of the window that is current in this thread.
    passes : tuple of Pass classes
        In drawing order: `firefly_sample.pipeline.PASSES`, or these and others.

    Raises
    ------
    NoGpuError
        If there is no OpenGL 3.3, with `require_gpu` only a software driver, or if this process was forked
        from one that had drawn already.
    OutputError, GpuError
        If the size is below 1, or above what the driver can draw; or if the environment makes it crash.

    Examples
    --------
    >>> from firefly_sample import Renderer, Scene
    >>> with Renderer((64, 48)) as renderer:  # doctest: +SKIP
    ...     frame = renderer.render(Scene(), time=0.0, outputs=("color", "depth"))
    """

    def __init__(
        self,
        size: tuple[int, int] = (800, 600),
        settings: Settings | None = None,
        *,
        device: int | None = None,
        require_gpu: bool = False,
        count_fragments: bool = False,
        reuse: bool = True,
        window: bool = False,
        passes: tuple[type[Pass], ...] = PASSES,
    ) -> None:
        self.settings = settings or Settings()
        self.size = check_size(size)
        self.count_fragments = count_fragments
        self.reuse = reuse
        made = [kind() for kind in passes]
        self._planner = Planner(made, window)
        self._passes = {step.name: step for step in made}
        self._drawn: FramePlan | None = None
        self._device = Device(device, window=window)
        try:
            self.resize(size)
            if require_gpu:
                self._device.require_gpu()
            if self.software and not window:
                warnings.warn(software_warning(self.driver), SoftwareDriverWarning, stacklevel=2)
            for change in silent_changes(self.driver):
                warnings.warn(change, stacklevel=2)
            with self._device:
                self._gpu = Gpu(self._device)
                self._presenter = Presenter(self._gpu) if window else None
        except BaseException:
            self._device.release()
            raise
        self._open = True

    def __reduce_ex__(self, _: SupportsIndex) -> NoReturn:
        raise GpuError(
            "a Renderer cannot be copied or pickled, because it holds an OpenGL context: hand on its size "
            "and settings, and make Renderer(size, settings) where it is needed, in each process its own"
        )

    @property
    def driver(self) -> str:
        """The GL renderer string."""
        return self._device.renderer

    @property
    def driver_version(self) -> str:
        """The GL version string, for example "4.5 (Core Profile) Mesa 22.3.6"."""
        return self._device.version

    @property
    def software(self) -> bool:
        """True if the driver is a software rasteriser."""
        return self._device.software

    def resize(self, size: tuple[int, int]) -> None:
        """Draw the next frames at another size.

        Raises
        ------
        OutputError, GpuError
            If it is below 1, or above the driver's limit.
        """
        size = check_size(size)
        self._device.check_size(size, self.settings.supersample)
        self.size = size

    def _check_open(self) -> None:
        if not self._open:
            raise GpuError("this renderer is closed: make a new one")

    def plan(self, scene: Scene, time: float = 0.0, outputs: Iterable[str] = ("color",)) -> FramePlan:
        """Return what `render` would draw."""
        names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
        with self._device.exclusively():
            return self._planner.plan(scene, self.settings, self.size, names, time, self._device.capabilities)

    def render(self, scene: Scene, time: float = 0.0, outputs: Iterable[str] = ("color",)) -> Frame:
        """Draw `scene` at `time` (seconds) and read back `outputs` (names from `frame.OUTPUTS`).

        Raises
        ------
        FireflyError
            If the scene, an output or a shader is wrong; the message names it.
        """
        with self._device.exclusively():
            return self.draw(self.plan(scene, time, outputs))

    def draw(self, plan: FramePlan, read: bool = True) -> Frame:
        """Draw a plan that `plan` made and read back its outputs; without `read`, the Frame has no images."""
        self._check_open()
        with self._device:
            return self._draw_passes(plan).read(self._gpu, images=read)

    def render_many(
        self, scene: Scene, times: Iterable[float], outputs: Iterable[str] = ("color",)
    ) -> Iterator[Frame]:
        """Draw `scene` at each of `times` (seconds), and read each frame back while the next one is drawn.

        Gives what `render` would give, one Frame after the other. Each comes when the next one is drawn, so
        that a change of the scene or the settings between two of them shows one frame later.

        Raises
        ------
        FireflyError
            As `render`, when the frames before have come.
        """
        names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
        waiting: deque[PendingFrame] = deque()
        drawing = (self._draw_ahead(self.plan(scene, time, names)) for time in times)
        try:
            while True:
                try:
                    drawn = next(drawing, None)
                except (Exception, SystemExit, GeneratorExit):  # a scene may raise any of these
                    while waiting:
                        yield self._read_behind(waiting.popleft())
                    raise
                if drawn is None:
                    break
                waiting.append(drawn)
                if len(waiting) > _AHEAD:
                    yield self._read_behind(waiting.popleft())
            while waiting:
                yield self._read_behind(waiting.popleft())
        finally:
            for drawn in waiting:
                drawn.give_back(self._gpu)

    def _draw_ahead(self, plan: FramePlan) -> PendingFrame:
        self._check_open()
        with self._device:
            drawn = self._draw_passes(plan)
            try:
                drawn.copy(self._gpu)
            except Exception:
                drawn.give_back(self._gpu)
                raise
            self._device.flush()
            return drawn

    def _read_behind(self, drawn: PendingFrame) -> Frame:
        try:
            self._check_open()
            with self._device:
                return drawn.read(self._gpu)
        finally:
            drawn.give_back(self._gpu)

    def present(self, plan: FramePlan, layers: Iterable[Layer] = ()) -> None:
        """Put the output "color" of the plan that was drawn last on the window, and `layers` over it.

        A plan without that output gives a black window. The caller swaps the window's buffers.

        Raises
        ------
        GpuError
            If this renderer was not made with ``window=True``.
        """
        if self._presenter is None:
            raise GpuError("this renderer draws without a window: make it with window=True to present frames")
        with self._device:
            color = self._gpu.images.texture(plan, "color") if plan.target("color") else None
            self._presenter.show(plan.size, color, layers)
            self._device.check("the window")

    def _draw_passes(self, plan: FramePlan) -> PendingFrame:
        gpu = self._gpu
        gpu.images.check_limits(plan)
        self._drawn = None
        gpu.reuse = self.reuse
        gpu.begin(plan)
        depth_func = ">=" if plan.view.reverse else "<="
        try:
            for step in plan.passes:
                made, images = self._passes[step.name], BoundImages(gpu.images, plan, step)
                made.prepare(gpu, plan, step, images)
                gpu.reset_state(depth_func)
                walked = getattr(step.variant, "light_method", None) == "clustered"
                counted = self.count_fragments and step.name in LIGHT_PASSES and not walked
                with gpu.timers.measure(step.name, count=counted):
                    made.draw(gpu, plan, step, images)
        finally:
            gpu.end()
        self._device.check(f"the frame at time {plan.time:g}")
        self._drawn = plan
        walked = count_walked(plan, gpu) if self.count_fragments and plan.clusters else None
        return PendingFrame(plan, gpu.lights_drawn, gpu.draw_calls, gpu.timers.end(), walked)

    def surface(self, plan: FramePlan) -> Surface:
        """Return the G-buffer of the plan that was drawn last, decoded in float64 from its stored bits.

        `Frame` holds the same as float32. A Surface reads a target when one of its methods first needs it.

        Raises
        ------
        GpuError
            If another plan was drawn since, or the renderer is closed; the Surface's methods raise it too.
        """

        def read(name: str) -> bytes:
            with self._reading(plan):
                return bytes(self._gpu.images.texture(plan, name).read())

        with self._reading(plan):
            return Surface(plan, read)

    @contextmanager
    def _reading(self, plan: FramePlan) -> Iterator[None]:
        """Enter the device if `plan` is what was drawn last, and keep other threads from drawing over it."""
        self._check_open()
        with self._device:
            if plan is not self._drawn:
                raise GpuError(
                    "this plan is not the one that was drawn last: draw it again before reading it"
                )
            yield

    def close(self) -> None:
        """Free every GL object and the context; in a forked process, which cannot, do nothing."""
        if self._device.inherited:
            self._open = False
            return
        with self._device.exclusively():
            if not self._open:
                return
            self._open = False
            if self._device.is_gone():
                self._device.abandon()
                return
            with self._device:
                if self._presenter is not None:
                    self._presenter.release()
                self._gpu.release()
            self._device.release()

    def abandon(self) -> None:
        """Free the context without making it current, and without a warning.

        It is for the ``__del__`` of an object that owns the renderer; `close` is for everything else.
        """
        if not getattr(self, "_open", False) or self._device.inherited or sys.is_finalizing():
            return
        self._open = False
        self._device.abandon()

    def __del__(self) -> None:
        if not getattr(self, "_open", False) or self._device.inherited or sys.is_finalizing():
            return
        self._open = False
        width, height = self.size
        kept = "" if self._presenter is None else "; its images stay in the window's context until that ends"
        text = (
            f"a Renderer of {width}x{height} was dropped without close(){kept}: "
            "use 'with Renderer(...) as renderer:' or call renderer.close()"
        )
        try:
            warnings.warn(text, ResourceWarning, stacklevel=2, source=self)
        finally:
            self._device.abandon()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

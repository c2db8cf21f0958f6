"""The bench for experiments: a renderer, a GL context for probes, and notes on the drawn frames."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import Frame
from firefly_sample.gpu.device import Device
from firefly_sample.lab.reference.shade import shade_lights
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.frame_plan import Capabilities, FramePlan
from firefly_sample.readback import GBuffer
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

SIZE = (96, 72)
"""Width and height in pixels of most cases' pictures."""

_PICTURES = ("radiance", "light", "color", "albedo", "normal", "specular", "shininess", "emission")
"""Outputs whose every value must be finite; positions are not where nothing was drawn."""


@dataclass(frozen=True)
class DrawnFrame:
    """A frame and the plan that it was drawn from; its images are float64."""

    frame: Frame
    plan: FramePlan
    stored: GBuffer | None

    def __getitem__(self, output: str) -> Float64:
        return np.asarray(self.frame[output], dtype=np.float64)

    @property
    def gbuffer(self) -> GBuffer:
        """Return the stored values, decoded in float64; the frame must have been drawn with them."""
        assert self.stored is not None
        return self.stored

    def visibility(self) -> NDArray[np.int32]:
        """Return the instance and triangle of each pixel, as the float64 reference takes them."""
        return np.asarray(self.frame["visibility"], dtype=np.int32)

    def expected_light(self) -> tuple[Float64, Float64]:
        """Return radiance and light of all lights but ambient ones, in float64 from the stored G-buffer."""
        return shade_lights(self.gbuffer, self.plan.lights, self.plan.settings, threads=None)


class ExperimentBench(ExitStack):
    """A renderer and a GL context, made when first used. A context manager.

    Parameters
    ----------
    device, require_gpu : see `firefly_sample.Renderer`

    Attributes
    ----------
    warnings : list of str
        Of the plans that were drawn since `begin`, each once.
    not_finite : int
        The number of values that are not finite in the pictures that were drawn since `begin`.
    """

    def __init__(self, device: int | None = None, require_gpu: bool = False) -> None:
        super().__init__()
        self._index, self._require_gpu = device, require_gpu
        self._kept: dict[Hashable, Any] = {}
        self.warnings: list[str] = []
        self.not_finite = 0

    @cached_property
    def device(self) -> Device:
        """Return a context for probes, beside that of the renderer."""
        made = Device(self._index)
        self.callback(made.release)
        if self._require_gpu:
            made.require_gpu()
        return made

    @cached_property
    def renderer(self) -> Renderer:
        """Return the renderer of all frames."""
        return self.enter_context(Renderer(SIZE, device=self._index, require_gpu=self._require_gpu))

    @property
    def capabilities(self) -> Capabilities:
        """Return the driver's capabilities."""
        return self.device.capabilities

    def law_of(self, method: str) -> str:
        """Return the method whose error law holds on this driver: reversed depth needs clip control."""
        return "depth24" if method == "depth32f" and not self.capabilities.clip_control else method

    def can_draw(self, needs: str) -> bool:
        """Return whether the driver has one of `Capabilities`; "" needs none."""
        return not needs or bool(getattr(self.capabilities, needs))

    def begin(self) -> None:
        """Forget the warnings and the values that are not finite."""
        self.warnings, self.not_finite = [], 0

    def once(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """Return the value that `make` returned when it was first called for this key."""
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def draw(
        self,
        scene: Scene,
        settings: Settings,
        size: tuple[int, int] = SIZE,
        outputs: Iterable[str] = ("radiance",),
        time: float = 0.0,
        gbuffer: bool = False,
        capabilities: Capabilities | None = None,
    ) -> DrawnFrame:
        """Draw a frame, and note its warnings and values that are not finite.

        Parameters
        ----------
        gbuffer : bool
            Read back the values that the lighting was computed from.
        capabilities : Capabilities, optional
            Draw as a driver that only has these; they must be among those of this driver.
        """
        self.renderer.settings = settings
        self.renderer.resize(size)
        more = ("position", "normal", "albedo", "specular") if gbuffer else ()
        names = tuple(dict.fromkeys((*outputs, *more)))
        if capabilities is None:
            plan = self.renderer.plan(scene, time, names)
            self.warnings.extend(line for line in plan.warnings if line not in self.warnings)
        else:  # warnings for a different driver do not belong in this driver's row
            plan = build_plan(scene, settings, size, names, time, capabilities)
        frame = self.renderer.draw(plan)
        for name in set(names).intersection(_PICTURES):
            self.not_finite += int(np.count_nonzero(~np.isfinite(frame[name])))
        return DrawnFrame(frame, plan, self.renderer.surface(plan).gbuffer() if gbuffer else None)

    def scene(self, name: str, **options: Any) -> Scene:
        """Return a scene of `firefly_sample.scenes`, made once for the same options."""
        made: Scene = self.once((name, *options.items()), lambda: build_scene(find_scene(name), **options))
        return made

    @contextmanager
    def measured_frames(self) -> Iterator[Renderer]:
        """Let the renderer count fragments and draw every pass of every frame anew."""
        renderer = self.renderer
        before = renderer.count_fragments, renderer.reuse
        renderer.count_fragments, renderer.reuse = True, False
        try:
            yield renderer
        finally:
            renderer.count_fragments, renderer.reuse = before

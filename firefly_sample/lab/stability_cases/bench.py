"""What cases draw with: one renderer for all of them, which notes what is wrong with any picture."""

from __future__ import annotations

from collections.abc import Iterable
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import Frame
from firefly_sample.gpu.device import Device
from firefly_sample.lab.reference.shade import shade_lights
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.frame_plan import Capabilities, FramePlan
from firefly_sample.readback import GBuffer, Surface
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

SIZE = (96, 72)
"""Pixels of most cases' pictures."""

_PICTURES = ("radiance", "light", "color", "albedo", "normal", "specular", "shininess", "emission")
"""Outputs whose every value must be a number; places have none where nothing was drawn."""


class Drawn:
    """A frame and the plan that it was drawn from; its images are float64.

    Attributes
    ----------
    frame : Frame
    plan : FramePlan
    gbuffer : GBuffer or None
        As stored, decoded in float64; None where it was not asked for.
    """

    def __init__(self, frame: Frame, plan: FramePlan, surface: Surface | None) -> None:
        self.frame = frame
        self.plan = plan
        self.gbuffer: GBuffer | None = surface.gbuffer() if surface is not None else None

    def __getitem__(self, output: str) -> Float64:
        return np.asarray(self.frame[output], dtype=np.float64)

    def expected_light(self) -> tuple[Float64, Float64]:
        """Radiance and light of all lights but ambient ones, in float64 from the stored G-buffer."""
        assert self.gbuffer is not None
        return shade_lights(self.gbuffer, self.plan.lights, self.plan.settings, threads=None)


class Bench:
    """One renderer, and what it has shown since `begin`. A context manager.

    Attributes
    ----------
    warnings : list of str
        Of the plans that were drawn, each once.
    not_finite : int
        Values in pictures that are no finite number.
    """

    def __init__(self, device: int | None = None, require_gpu: bool = False) -> None:
        self.renderer = Renderer(SIZE, device=device, require_gpu=require_gpu)
        self._index = device
        self._device: Device | None = None
        self.warnings: list[str] = []
        self.not_finite = 0
        self.kept: dict[str, Any] = {}

    def law_of(self, method: str) -> str:
        """The method by whose law one errs on this driver: reversed depth needs clip control."""
        return "depth24" if method == "depth32f" and not self.capabilities.clip_control else method

    @property
    def capabilities(self) -> Capabilities:
        """What the driver can do."""
        return self.device.capabilities

    def can_draw(self, needs: str) -> bool:
        """Whether the driver has one of `Capabilities`; "" needs none."""
        return not needs or bool(getattr(self.capabilities, needs))

    def begin(self) -> None:
        """Forget what was noted."""
        self.warnings, self.not_finite = [], 0

    def begin_warnings(self) -> None:
        """Forget the warnings of what a case is only compared with."""
        self.warnings = []

    @property
    def device(self) -> Device:
        """A context of its own, for what is no frame."""
        if self._device is None:
            self._device = Device(self._index)
        return self._device

    def plan(self, scene: Scene, settings: Settings, size: tuple[int, int]) -> FramePlan:
        """The plan of a frame that is not drawn."""
        self.renderer.settings = settings
        self.renderer.resize(size)
        return self.renderer.plan(scene)

    def draw(
        self,
        scene: Scene,
        settings: Settings,
        size: tuple[int, int] = SIZE,
        outputs: Iterable[str] = ("radiance",),
        time: float = 0.0,
        gbuffer: bool = False,
        capabilities: Capabilities | None = None,
    ) -> Drawn:
        """Draw a frame; with `gbuffer`, read back what lights were computed from as well.

        With `capabilities`, it is drawn as on a driver that has these, which must be among the driver's own.
        """
        self.renderer.settings = settings
        self.renderer.resize(size)
        names = tuple(outputs)
        if gbuffer:
            names = tuple(dict.fromkeys([*names, "position", "normal", "albedo", "specular"]))
        if capabilities is None:
            plan = self.renderer.plan(scene, time, names)
        else:
            plan = build_plan(scene, settings, size, names, time, capabilities)
        frame = self.renderer.draw(plan)
        for name in names:
            if name in _PICTURES:
                self.not_finite += int(np.count_nonzero(~np.isfinite(frame[name])))
        if capabilities is None:  # what another driver would say is not this one's row
            self.warnings.extend(line for line in plan.warnings if line not in self.warnings)
        return Drawn(frame, plan, self.renderer.surface(plan) if gbuffer else None)

    def close(self) -> None:
        """Free the renderer."""
        self.kept.clear()
        self.renderer.close()
        if self._device is not None:
            self._device.release()

    def __enter__(self) -> Bench:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

"""A scene that is cheap to draw, and different in every frame."""

from __future__ import annotations

from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene
from tests.scenes import ball


class Rolling:
    """A ball that rolls past; without lights there are few shaders to compile."""

    name = "rolling"
    summary = "A ball that rolls past."
    parameters = (Parameter("bright", float, 1.0, "How bright it is.", 0.0, 10.0),)

    def build(self, *, bright: float) -> Scene:
        return _RollingScene(bright)


class _RollingScene(Scene):
    def __init__(self, bright: float) -> None:
        super().__init__()
        self.root.attach_new_node(AmbientLight("dusk", (bright, bright, bright)))
        node = GeomNode("ball")
        node.add_geom(ball(subdivisions=1))
        self._ball = self.root.attach_new_node(node)

    def update(self, time: float) -> None:
        self._ball.set_pos(6.0 * (time - 5.0) - 1.0, 6.0, 0.0)


rolling = Rolling()

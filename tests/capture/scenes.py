"""Scenes that are cheap to draw, and different in every frame."""

from __future__ import annotations

from firefly_sample.errors import SceneError
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene
from tests.scenes import ball

CROWD_SIZE, CROWD_COUNT = (64, 48), 9
"""The size of the pictures that `crowded` is for, and the number of its objects."""


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


class Parade:
    """Tagged animals that pass one by one behind a post: a cow at time 0, an ant at 1, a bee at 2."""

    name = "parade"
    summary = "Animals that pass."
    parameters = (
        Parameter("more", int, 0, "How many categories stand before the others and are never seen.", 0, 9),
        Parameter("flat", bool, False, "Whether the lens is orthographic."),
        Parameter("fails", float, -1.0, "The time that cannot be drawn."),
    )

    def build(self, *, more: int, flat: bool, fails: float) -> Scene:
        return _ParadeScene(more, flat, fails)


class _ParadeScene(Scene):
    def __init__(self, more: int, flat: bool, fails: float) -> None:
        super().__init__()
        self._fails = fails
        lens = OrthographicLens((4.0, 3.0), near=1, far=100) if flat else PerspectiveLens(fov=40, near=1)
        self.camera.node().lens = lens
        self.root.attach_new_node(AmbientLight("dusk", (1.0, 1.0, 1.0)))
        post = GeomNode("post")
        post.add_geom(ball(radius=0.3, subdivisions=1))
        self.root.attach_new_node(post).set_pos(0.4, 4.0, 0.0)
        self._row = self.root.attach_new_node("row")
        for number, name in enumerate(("cow", "ant", "bee")):
            self._attach(name).set_pos(20.0 * number, 0.0, 0.2 * number)
        self._attach("dodo").hide()
        for number in range(more):
            self._attach(f"a{number}").set_y(-50.0)

    def _attach(self, name: str) -> NodePath:
        node = GeomNode(f"body of {name}")
        node.add_geom(ball(subdivisions=1))
        path = self._row.attach_new_node(node)
        path.set_tag("category", name)
        return path

    def update(self, time: float) -> None:
        if time == self._fails:
            raise SceneError("the parade has stopped")
        self._row.set_pos(-20.0 * time, 6.0 + 0.1 * time, 0.0)


parade = Parade()


class Crowded:
    """The objects of `tests.capture.objects.crowd`, of which rays know the masks."""

    name = "crowded"
    summary = "Objects in front of each other."
    parameters = (Parameter("seed", int, 0, "Which objects.", 0, 99),)

    def build(self, *, seed: int) -> Scene:
        from tests.capture.objects import crowd

        scene, _, _ = crowd(seed, CROWD_SIZE, CROWD_COUNT)
        scene.root.attach_new_node(AmbientLight("dusk", (1.0, 1.0, 1.0)))
        return scene


crowded = Crowded()

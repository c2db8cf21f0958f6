"""A pass is one module and its shader: one from outside the package is added and taken away again."""

import numpy as np
import pytest

from firefly_sample import Renderer, Settings, build_plan
from firefly_sample.errors import PlanError
from firefly_sample.passes.base import FullscreenPass
from firefly_sample.pipeline import PASSES
from firefly_sample.plan.frame_graph import Declaration
from tests.passes.vignette import Vignette
from tests.scenes import ball_scene

SIZE = 32, 24


@pytest.mark.parametrize("supersample", [1, 2])
def test_a_pass_from_outside_is_drawn_and_is_gone_without_it(supersample):
    scene = ball_scene(5)
    scene.background = (0.5, 0.7, 0.9)
    pictures = []
    for passes in (PASSES, (*PASSES, Vignette), PASSES):
        with Renderer(SIZE, Settings(supersample=supersample), passes=passes) as renderer:
            pictures.append(renderer.render(scene).color)
    plain, dark, again = pictures
    x = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2.0 - 1.0
    y = (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2.0 - 1.0
    factor = 1.0 - 0.25 * (x[None, :] ** 2 + y[:, None] ** 2)
    assert np.abs(dark - plain * factor[..., None]).max() <= 1.0  # codes: both are rounded
    assert factor.min() < 0.6 < 0.99 < factor.max()
    assert again.tobytes() == plain.tobytes()


def test_its_plan_says_what_it_does_and_why():
    plan = build_plan(ball_scene(5), size=SIZE, passes=(*PASSES, Vignette))
    assert plan.passes[:-1] == build_plan(ball_scene(5), size=SIZE).passes
    vignette = plan.passes[-1]
    assert (vignette.name, vignette.reads, vignette.writes) == ("vignette", (), ())
    assert (vignette.updates, vignette.because) == (
        ("color",),
        "the picture is darkened towards its corners",
    )
    depth = build_plan(ball_scene(5), size=SIZE, outputs=("depth",), passes=(*PASSES, Vignette))
    assert [step.name for step in depth.passes] == ["geometry"]


class Blurred(FullscreenPass):
    """Makes a target of its own, which another pass reads."""

    name = "blurred"

    def declare(self, needs):
        shape = {"blurred": lambda _: {"format": "rgba8", "half": True}}
        return Declaration("a blur", reads={"radiance": ["a blur"]}, writes=["blurred"], targets=shape)


class Reader(Vignette):
    """Reads that target."""

    def declare(self, needs):
        return Declaration("a glow", reads={"blurred": ["a glow"]}, updates=["color"])


def test_a_target_of_its_own_is_there_if_a_pass_reads_it():
    scene = ball_scene(5)
    alone = build_plan(scene, size=SIZE, passes=(*PASSES, Blurred))
    assert alone.target("blurred") is None
    assert "blurred" not in [step.name for step in alone.passes]
    plan = build_plan(scene, size=SIZE, passes=(*PASSES, Blurred, Reader))
    assert [step.name for step in plan.passes][-2:] == ["blurred", "vignette"]
    made = plan.target("blurred")
    assert (made.format, made.because, plan.target_size("blurred")) == ("rgba8", "a glow", (16, 12))


def test_a_pass_that_reads_what_nobody_makes_and_one_that_is_there_twice_are_refused():
    with pytest.raises(PlanError, match="pass 'vignette' uses target 'blurred', which this frame does not"):
        build_plan(ball_scene(5), size=SIZE, passes=(*PASSES, Reader))
    with pytest.raises(PlanError, match="passes need names of their own"):
        build_plan(ball_scene(5), size=SIZE, passes=(*PASSES, Vignette, Vignette))


@pytest.mark.parametrize("makes", ["writes", "fills", "keeps"])
def test_a_target_without_a_format_is_refused(makes):
    class Shapeless(Vignette):
        def declare(self, needs):
            made = {"glow": ["a glow"]} if makes == "keeps" else ["glow"]
            return Declaration("a glow", updates=["color"], **{makes: made})

    with pytest.raises(PlanError, match="pass 'vignette' makes target 'glow', which has no format"):
        build_plan(ball_scene(5), size=SIZE, passes=(*PASSES, Shapeless))

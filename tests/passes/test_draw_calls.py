"""A frame says how often OpenGL was told to draw, whatever its lights are."""

import re
from pathlib import Path

import pytest

import firefly_sample
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer, make_renderer
from tests.scenes import ball_scene


@pytest.mark.parametrize("method", ["volumes", "clustered", "fullscreen", "loop"])
@pytest.mark.parametrize("count", [1, 40])
def test_lights_of_a_kind_are_one_call_by_every_method(method, count):
    scene = ball_scene(count, ambient=(0.1, 0.1, 0.1))
    with borrow_renderer((64, 48), Settings(light_method=method)) as renderer:
        for _ in range(2):
            plan = renderer.plan(scene)
            assert [step.name for step in plan.passes] == ["geometry", "ambient", "point_lights", "resolve"]
            assert len(plan.lights) == 1
            assert renderer.draw(plan).draw_calls == len(plan.batches) + 3


def test_a_kept_gbuffer_is_not_drawn_again():
    scene = ball_scene(5)
    with make_renderer((64, 48), Settings(light_method="volumes")) as renderer:
        first, second = (renderer.render(scene, time) for time in (0.0, 1.0))
        assert first.draw_calls - second.draw_calls == len(renderer.plan(scene).batches) > 0


def test_every_pass_draws_where_calls_are_counted():
    folder = Path(firefly_sample.__file__).parent
    calls = [
        (path.name, call)
        for path in (*folder.glob("passes/*.py"), *folder.glob("gpu/*.py"))
        for call in re.findall(r"(\S+)\.(?:render|render_indirect|transform)\(", path.read_text())
    ]
    assert len(calls) > 5
    assert [name for name, call in calls if call not in {"gpu", "self", "self.gpu"}] == [
        "gpu.py"
    ]  # it counts there

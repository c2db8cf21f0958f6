"""Frames one after the other, each read back while the next one is drawn: they are those of `render`."""

import itertools

import pytest

from firefly_sample.capture.files import pixel_hash
from firefly_sample.errors import GpuError, SceneError
from firefly_sample.frame import OUTPUTS
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.clouds import cloud_scene, puff
from tests.conftest import borrow_renderer, make_renderer
from tests.gl_objects import count_objects, device_of
from tests.scenes import ball_scene
from tests.shadows import shadowed_scene

TIMES = (0.0, 1.0, 2.5, 3.0, 4.0, 5.0)


class Moving(Scene):
    """Another scene whose camera moves; `change` is called with each time."""

    def __init__(self, of, change=lambda time: None):
        super().__init__(of.root, of.camera, of.background)
        self._change = change
        self._x = of.camera.get_x()
        self.drawn = []

    def update(self, time):
        self._change(time)
        self.camera.set_x(self._x + 0.1 * time)
        self.drawn.append(time)


def facts(frame):
    """Everything of a frame that does not depend on the clock."""
    images = {name: pixel_hash(image) for name, image in frame.images.items()}
    said = frame.id_names, frame.warnings, frame.lights, frame.shaded, list(frame.milliseconds)
    return frame.time, frame.size, images, *said


def clouds():
    """The shadow of the particles needs a target of another size and format from one time to the next."""
    node = puff(60)
    scene = cloud_scene(node, blur=1.0, tint=0.5, show_texture=True)

    def change(time):
        node.set_arrays(node.arrays.positions[: 50 - int(time)], 0.1, 0.2, (1, 1, 1))
        node.change_shadow(tint=0.5 * (time % 2), enabled=time < 5.0)

    return Moving(scene, change)


def shadows():
    """A light that casts no shadow at some times."""
    scene = shadowed_scene("spot", (-3.0, -4.0, 5.5), resolution=64)
    light = scene.root.find("**/light").node()
    return Moving(scene, lambda time: light.set_shadow_caster(time % 2 == 0, 64 + int(time)))


SCENES = {"balls": lambda: Moving(ball_scene(20)), "clouds": clouds, "shadows": shadows}


@pytest.mark.parametrize(
    ("settings", "outputs"),
    [
        (Settings(), tuple(OUTPUTS)),
        (Settings(position_method="depth24", normal_format="oct8", albedo_format="srgb8"), tuple(OUTPUTS)),
        (
            Settings(position_method="stored16f", accumulation_format="r11g11b10f", normal_format="rgb10a2"),
            tuple(OUTPUTS),
        ),
        (Settings(look="classic"), ("color", "normal", "depth")),
        (Settings(supersample=2), ("color", "radiance")),
        (Settings(light_method="clustered", albedo_format="sqrt8"), ("color", "albedo", "light")),
    ],
    ids=["default", "narrow", "stored", "classic", "averaged", "clustered"],
)
@pytest.mark.parametrize("name", SCENES)
def test_frames_are_those_of_one_by_one(name, settings, outputs):
    with borrow_renderer((37, 23), settings, reuse=True, count_fragments=True) as renderer:
        scene = SCENES[name]()
        alone = [facts(renderer.render(scene, time, outputs)) for time in TIMES]
        many = [facts(frame) for frame in renderer.render_many(SCENES[name](), TIMES, outputs)]
    assert many == alone
    assert len({tuple(frame[2].values()) for frame in many}) == len(TIMES)


def test_what_is_kept_between_frames_is_in_each_of_them():
    """A still camera's G-buffer is drawn once and read back every time."""
    with make_renderer((37, 23)) as renderer:
        scene, outputs = ball_scene(20), ("color", "depth", "normal", "id")
        alone = facts(renderer.render(scene, 0.0, outputs))[2:]
        assert [facts(frame)[2:] for frame in renderer.render_many(scene, TIMES, outputs)] == [alone] * 6


def test_a_frame_comes_when_the_next_one_is_drawn_and_no_later_one_is():
    scene = Moving(ball_scene(5))
    with make_renderer((16, 12)) as renderer:
        frames = renderer.render_many(scene, itertools.count())
        assert scene.drawn == []
        for index in range(4):
            assert next(frames).time == index
            assert scene.drawn == list(range(index + 2))
        frames.close()


def test_no_times_give_no_frames():
    with make_renderer((16, 12)) as renderer:
        assert list(renderer.render_many(ball_scene(5), ())) == []


def test_size_and_settings_may_change_between_frames():
    """The frame that is already drawn stays as it is."""
    looks = [
        ((37, 23), Settings()),
        ((64, 48), Settings(position_method="depth24")),
        ((8, 6), Settings(normal_format="rgba32f")),
        ((64, 48), Settings(position_method="stored32f")),
    ]
    outputs = ("color", "depth", "normal")
    with make_renderer(looks[0][0], looks[0][1]) as renderer:
        frames, many = renderer.render_many(Moving(ball_scene(9)), range(8), outputs), []
        for index in range(8):
            many.append(facts(next(frames)))
            renderer.settings = looks[index // 2][1]
            renderer.resize(looks[index // 2][0])
        assert next(frames, None) is None
        alone, scene = [], Moving(ball_scene(9))
        for time in range(8):
            size, renderer.settings = looks[max(time - 2, 0) // 2]
            renderer.resize(size)
            alone.append(facts(renderer.render(scene, time, outputs)))
    assert many == alone


def test_others_may_draw_in_between():
    scene, other = Moving(ball_scene(9)), shadows()
    with make_renderer((37, 23)) as renderer:
        alone = [facts(renderer.render(scene, time)) for time in TIMES]
        apart = [facts(renderer.render(other, time, "depth")) for time in TIMES]
        single = facts(renderer.render(clouds(), 1.0))
        pairs = zip(
            renderer.render_many(scene, TIMES), renderer.render_many(other, TIMES, "depth"), strict=True
        )
        for index, (first, second) in enumerate(pairs):
            assert facts(first) == alone[index]
            assert facts(second) == apart[index]
            assert facts(renderer.render(clouds(), 1.0)) == single


def test_the_plan_drawn_last_is_the_one_that_can_be_read():
    with make_renderer((16, 12)) as renderer:
        plan = renderer.plan(ball_scene(5), 0.0, "depth")
        renderer.draw(plan)
        frames = renderer.render_many(ball_scene(5), TIMES)
        renderer.surface(plan).distance()
        next(frames)
        with pytest.raises(GpuError, match="drawn last"):
            renderer.surface(plan)


def fails(time):
    if time >= 3.0:
        raise SceneError("no more")


def test_what_was_drawn_before_a_failure_comes_before_it():
    with make_renderer((16, 12)) as renderer:
        frames = renderer.render_many(Moving(ball_scene(5), fails), TIMES)
        assert [next(frames).time for _ in range(3)] == [0.0, 1.0, 2.5]
        with pytest.raises(SceneError, match="no more"):
            next(frames)
        alone = facts(renderer.render(ball_scene(5)))
        assert [facts(frame) for frame in renderer.render_many(ball_scene(5), [0.0])] == [alone]


def test_a_closed_renderer_says_so_and_keeps_nothing():
    renderer = make_renderer((16, 12))
    frames = renderer.render_many(ball_scene(5), TIMES)
    next(frames)
    renderer.close()
    with pytest.raises(GpuError, match="closed"):
        next(frames)
    with pytest.raises(GpuError, match="closed"):
        next(renderer.render_many(ball_scene(5), TIMES))


@pytest.mark.parametrize("queries", [False, True])
def test_no_object_is_made_once_the_ring_is_full(queries, monkeypatch):
    """Also where a GPU's queries tell the time, which are read a frame later as well."""
    counts = []
    with make_renderer((16, 12), count_fragments=True) as renderer:
        if queries:
            monkeypatch.setattr(device_of(renderer), "software", False)
        for frame in renderer.render_many(Moving(ball_scene(5)), range(22), ("color", "depth")):
            counts.append(count_objects(renderer))
            assert frame.shaded > 0
            assert "geometry" in frame.milliseconds
    assert counts[1:] == [counts[1]] * 21


@pytest.mark.parametrize("end", ["early", "failure", "whole"])
def test_however_it_ends_the_next_run_makes_no_object(end):
    def run(renderer):
        frames = renderer.render_many(Moving(ball_scene(5), fails), TIMES if end == "failure" else (0.0, 1.0))
        if end == "early":
            next(frames)
            frames.close()
        elif end == "failure":
            with pytest.raises(SceneError):
                list(frames)
        else:
            list(frames)
        return count_objects(renderer)

    with make_renderer((16, 12), count_fragments=True) as renderer:
        first = run(renderer)
        assert [run(renderer) for _ in range(5)] == [first] * 5

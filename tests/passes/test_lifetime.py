"""Contexts: nothing left behind, memory flat, other libraries' contexts in between."""

import gc
import os
import sys
import warnings
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import firefly_sample
from firefly_sample import SoftwareDriverWarning
from firefly_sample.errors import GpuError, NoGpuError, OutputError, PlanError
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.texture import Texture
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.clouds import cloud_scene, puff
from tests.conftest import make_renderer
from tests.gl_objects import count_objects
from tests.scenes import ball, ball_scene, geom_node, wall_scene
from tests.shadows import shadowed_scene


def test_no_gl_object_lives_after_release():
    """A renderer's objects can be counted after their release only in a context that outlives it.

    Therefore the test replaces the private device of a renderer by its own.
    """
    device = Device()
    with device:
        device.unbind()
        before = device.raw.count_objects()
        device.check("counting")
    renderer = make_renderer((40, 30))
    renderer._gpu.release()
    renderer._device.release()
    with device:
        renderer._device, renderer._gpu = device, Gpu(device)
    for settings in (
        Settings(),
        Settings(position_method="depth24"),
        Settings(look="classic"),
        Settings(light_method="loop"),
    ):
        renderer.settings = settings
        for size in ((40, 30), (64, 48)):
            renderer.resize(size)
            renderer.render(ball_scene(10), 0.0, ("color", "id"))
            renderer.render(cloud_scene(puff(50), blur=1.0, tint=0.5, show_texture=True), 0.0)
            next(renderer.render_many(ball_scene(10), (0.0, 1.0), ("color", "depth")))
    with device:
        assert device.raw.count_objects() != before
        renderer._gpu.release()
        assert device.raw.count_objects() == before
        device.check("the end")
    renderer._open = False  # its parts are released one by one
    device.release()


def test_models_that_are_gone_free_their_buffers():
    with make_renderer((16, 12)) as renderer:
        scene = wall_scene()
        renderer.render(scene)
        before = count_objects(renderer)
        for i in range(20):
            path = scene.root.attach_new_node(geom_node("ball", ball(1.0, 1), Material(f"m{i}")))
            path.set_pos(0, 8, 0)
            renderer.render(scene)
            path.remove_node()
            del path
        gc.collect()
        renderer.render(scene)
        after = count_objects(renderer)
        assert {kind: n for kind, n in after.items() if kind in ("Buffer", "VertexArray", "Texture")} == {
            kind: n for kind, n in before.items() if kind in ("Buffer", "VertexArray", "Texture")
        }


def test_particles_that_come_and_go_leave_nothing_behind():
    """Any count of them, drawn again and again: as many GL objects as after the first frames."""
    node = puff(50)
    scene, counts = cloud_scene(node, blur=1.0), []
    with make_renderer((16, 12)) as renderer:
        for turn in range(18):
            node.set_arrays(node.arrays.positions[: 50 - turn % 3], 0.1, 0.2, (1, 1, 1))
            node.change_shadow(blur=float(turn % 2))
            renderer.render(scene)
            counts.append(count_objects(renderer))
    assert counts[6:12] == counts[12:18]


def test_a_scene_that_is_gone_is_kept_by_nobody():
    """Shadow maps keep what was drawn for them, but not what they were drawn of."""
    with make_renderer((16, 12)) as renderer:
        scene = shadowed_scene("spot", (-3.0, -4.0, 5.5), resolution=64)
        geom = weakref.ref(scene.root.find("**/box").node().geoms[0][0])
        renderer.render(scene)
        del scene
        other = wall_scene()
        other.camera.node().camera_mask = 2  # it sees through another walk of the graph
        renderer.render(other)
        gc.collect()
        assert geom() is None


def resident_bytes():
    """Memory that this process holds now; its most so far would hide what is lost after a larger test."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def swarm_scene(count=60):
    """Balls under a swarm of lights and of dots that come, go and pass in front of and behind them."""
    scene = ball_scene(3)
    rng = np.random.default_rng(5)
    middles, sizes, phases = rng.uniform((-9, 2, -1), (9, 20, 3), (count, 3)), *rng.uniform(0, 6, (2, count))

    def places(time):
        return middles + 3.0 * np.stack([np.sin(phases + k + time) for k in range(3)], axis=1)

    def lights(time):
        return places(time), np.full((count, 3), 0.3), 0.2 + sizes * abs(np.sin(phases + time))

    scene.root.attach_new_node(PointLights("swarm", function=lights))
    scene.root.attach_new_node(Sprites("dots", function=lambda time: (places(time), (1, 1, 1), 0.05)))
    return scene


def test_five_hundred_frames_make_no_object_and_keep_memory_flat():
    """Lights fly and the camera turns; what shaders look up is in textures that are made once."""
    scene, in_view = swarm_scene(), set()
    with make_renderer((64, 48)) as renderer:

        def objects_after(frames):
            for frame in frames:
                scene.camera.set_h(40.0 * np.sin(0.1 * frame))
                scene.root.find("lights").set_x(0.001 * frame)
                in_view.add(renderer.render(scene, 0.05 * frame, ("color", "depth")).lights.in_view)
            gc.collect()
            return count_objects(renderer, 8192)

        settled = objects_after(range(200))
        memory = resident_bytes()
        for first in range(200, 500, 150):
            assert objects_after(range(first, first + 150)) == settled
        assert resident_bytes() - memory < 4 * 2**20
    assert len(in_view) > 20  # lights came and went


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("forest", {"fireflies": 40}),
        ("lightbulbs", {"columns": 6, "rows": 6, "sun": True}),
        ("smoke", {}),
        ("spheres", {"lights": 300}),
    ],
)
def test_nothing_swallows_ctrl_c_in_a_steady_frame(name, parameters):
    """NumPy asks Python about each entry of a dtype's list, and drops what is raised meanwhile."""
    scene = build_scene(find_scene(name), **parameters)
    called = set()
    with make_renderer((32, 24)) as renderer:
        for frame in range(2):
            renderer.render(scene, frame / 24)
        sys.setprofile(lambda frame, event, _: called.add(frame.f_code.co_name))
        try:
            for frame in renderer.render_many(scene, (2 / 24, 3 / 24)):
                assert frame.color.any()
        finally:
            sys.setprofile(None)
    assert "_draw_passes" in called
    assert "npy_ctypes_check" not in called


def test_two_renderers_take_turns(render):
    scene = ball_scene(20)
    alone = render(scene, None, (64, 48)).color
    with make_renderer((64, 48)) as a, make_renderer((32, 24)) as b:
        for _ in range(3):
            first = a.render(scene).color
            b.render(scene)
            assert np.array_equal(first, alone)


def test_a_closed_renderer_says_so():
    renderer = make_renderer((8, 6))
    renderer.close()
    renderer.close()
    with pytest.raises(GpuError, match="closed"):
        renderer.render(wall_scene())


def test_sizes_out_of_range_are_refused_with_the_limit():
    for size in ((0, 10), (10, -1), (2.5, 3)):
        with pytest.raises(OutputError, match="1 or more"):
            make_renderer(size)
    with pytest.raises(GpuError, match=r"limit of \d+"):
        make_renderer((10**6, 10))
    with pytest.raises(GpuError, match="supersample 2"):
        make_renderer((10000, 10), Settings(supersample=2))


def test_a_software_driver_is_warned_about_and_can_be_refused():
    from firefly_sample.renderer import Renderer

    with make_renderer((8, 6)) as renderer:
        if not renderer.software:
            pytest.skip("this machine has a GPU, so there is nothing to warn about")
    with pytest.warns(SoftwareDriverWarning, match="CPU"):
        Renderer((8, 6)).close()
    with warnings.catch_warnings():  # as the README says
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=firefly_sample.SoftwareDriverWarning)
        Renderer((8, 6)).close()
    with pytest.raises(NoGpuError, match="software rasteriser"):
        make_renderer((8, 6), require_gpu=True)


def test_no_such_device_is_one_line():
    with pytest.raises(NoGpuError, match="no EGL device 99") as caught:
        make_renderer((8, 6), device=99)
    assert "\n" not in str(caught.value)


def test_a_pass_may_touch_only_what_it_declares():
    with make_renderer((8, 6)) as renderer:
        plan = renderer.plan(wall_scene(), 0.0, ("color",))
        renderer.draw(plan)
        # no pass of the package touches more than it declares, so that the error needs the private images
        bound = BoundImages(renderer._gpu.images, plan, plan.passes[-1])
        with pytest.raises(PlanError, match="'resolve' does not declare that it reads 'depth'"):
            bound.read("depth")


def test_a_picture_that_does_not_fit_is_one_error_and_the_next_one_is_drawn():
    scene = ball_scene(5)
    with make_renderer((64, 48)) as renderer:
        alone = renderer.render(scene).color
        renderer.resize((16384, 8704))  # its radiance is over 2 GiB, which llvmpipe refuses
        if not renderer.software:
            pytest.skip("a GPU may have room for it; llvmpipe refuses")
        with pytest.raises(GpuError, match=r"no room for 16384x8704 samples .* MiB: choose a smaller size"):
            renderer.render(scene)
        renderer.resize((64, 48))
        assert np.array_equal(renderer.render(scene).color, alone)
        renderer.settings = Settings(supersample=2)
        renderer.size = (10000, 10)
        with pytest.raises(GpuError, match="10000x10 at supersample 2 is above"):
            renderer.render(scene)


def test_pictures_and_data_in_turn_make_no_texture_and_what_is_not_drawn_again_is_freed():
    scene = ball_scene(5)
    with make_renderer((64, 48)) as renderer:

        def objects(*turns):
            for outputs in turns:
                renderer.render(scene, outputs=outputs)
            counted = count_objects(renderer)
            return counted["Texture"], counted["Framebuffer"]

        alone = objects("color", "color")
        both = objects("id", "color", "id")
        assert both > alone
        assert objects("color", "id", "color") == both
        assert objects("color", "color") == alone
        renderer.resize((32, 24))
        objects("id")
        assert objects("color", "color") == alone


def test_changing_colors_and_cutoffs_do_not_pile_up():
    texture = Texture(np.full((4, 4, 4), 255, dtype=np.uint8))
    material = Material("leaf", texture=texture, alpha_mode="mask")
    scene = wall_scene(material=material)
    with make_renderer((8, 6)) as renderer:

        def objects(frames):
            for i in range(frames):
                scene.root.set_color((i / frames, 0.5, 0.5, 1))
                material.alpha_cutoff = 0.1 + 0.8 * i / frames
                renderer.render(scene)
            return count_objects(renderer)

        settled = objects(300)
        assert objects(300) == settled


def test_lights_drawn_are_counted_by_the_pass_itself():
    scene = ball_scene(20)
    with make_renderer((16, 12)) as renderer:
        assert renderer.render(scene).lights.dropped == 0
        plan = renderer.plan(scene)
        fewer = tuple(lights.take(np.arange(1, len(lights))) for lights in plan.lights)
        assert renderer.draw(replace(plan, lights=fewer)).lights.dropped == 1


def test_only_the_plan_drawn_last_can_be_read():
    scene = ball_scene(5)
    with make_renderer((16, 12)) as renderer:
        first, second = (renderer.plan(scene, time, "depth") for time in (0.0, 1.0))
        renderer.draw(first)
        renderer.draw(second)
        renderer.surface(second).distance()
        with pytest.raises(GpuError, match="drawn last"):
            renderer.surface(first)
    with pytest.raises(GpuError, match="closed"):
        renderer.surface(second)


def test_a_texture_above_the_drivers_limit_is_named():
    texture = Texture(np.zeros((1, 40000, 4), dtype=np.uint8), "panorama")
    with pytest.raises(GpuError, match="'panorama' is 40000x1"), make_renderer((8, 6)) as renderer:
        renderer.render(wall_scene(material=Material("sky", texture=texture)))

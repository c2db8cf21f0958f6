from tests.conftest import make_renderer
from tests.scenes import ball_scene


def test_the_first_frame_has_believable_times_for_each_of_its_passes():
    """llvmpipe's first timer query counts from its clock's zero: hours."""
    scene = ball_scene(20, ambient=(0.01, 0.01, 0.01))
    with make_renderer((64, 48)) as renderer:
        for _ in range(2):
            plan = renderer.plan(scene)
            frame = renderer.draw(plan)
            assert list(frame.milliseconds) == [step.name for step in plan.passes]
            assert all(0 < time < 60_000 for time in frame.milliseconds.values())


def test_the_passes_add_up_to_the_frame():
    """Nothing of the drawing is left out: vertices, and what a driver puts off until it must."""
    import time

    scene = ball_scene(20)
    with make_renderer((1600, 1200)) as renderer:  # so large that what is not drawing hardly counts
        ratios = []
        for _ in range(7):
            plan = renderer.plan(scene, 0.0, ("radiance",))
            start = time.perf_counter()
            milliseconds = renderer.draw(plan, read=False).milliseconds
            ratios.append(sum(milliseconds.values()) / (time.perf_counter() - start) / 1e3)
        assert 0.5 < sorted(ratios)[3] <= 1.0


def test_fragments_are_counted_exactly_where_the_count_is_known():
    """Full-screen passes shade every pixel once for each light."""
    from firefly_sample.settings import Settings

    scene = ball_scene(20)
    with make_renderer((64, 48), Settings(light_method="fullscreen"), count_fragments=True) as renderer:
        frame = renderer.render(scene)
        assert frame.shaded == 64 * 48 * frame.lights.in_view
    with make_renderer((64, 48), Settings(light_method="loop"), count_fragments=True) as renderer:
        assert renderer.render(scene).shaded == 64 * 48
    with make_renderer((64, 48)) as renderer:
        assert renderer.render(scene).shaded is None

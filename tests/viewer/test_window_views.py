"""What V goes through, drawn without a window: the right buffer and nothing else, as large as the window."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.particles import ParticleNode, ParticleShadow
from firefly_sample.settings import Settings
from firefly_sample.viewer.buffer_pictures import BUFFERS, buffers_of
from firefly_sample.viewer.window_views import PICTURE, STRIP, draw_view, views_of
from tests.conftest import make_renderer
from tests.scenes import ball_scene
from tests.viewer.workshop import EMISSION, SPECULAR, workshop

SIZE = (320, 240)
LOOKS = "classic", "pyrender", "flat"


@pytest.fixture(scope="module")
def renderer():
    with make_renderer(SIZE) as made:
        yield made


@pytest.fixture
def scene():
    """With something for every buffer to show."""
    built = workshop.build(shadows=True, lamps=10)
    sun = next(
        path.node() for path in built.root.find_all_matches("**") if isinstance(path.node(), DirectionalLight)
    )
    smoke = ParticleNode("smoke", [(0, 0, 1)], 0.5, 0.9)
    smoke.set_shadow(ParticleShadow(sun))
    built.root.attach_new_node(smoke)
    return built


@pytest.fixture
def drawn_plans(renderer, monkeypatch):
    """Every plan that is drawn, with whether it is read."""
    plans, draw = [], renderer.draw

    def watch(plan, read=True):
        plans.append((plan, read))
        return draw(plan, read)

    monkeypatch.setattr(renderer, "draw", watch)
    return plans


def test_the_views_of_each_look():
    assert views_of("correct") == (PICTURE, STRIP, *BUFFERS)
    for look in LOOKS:
        assert views_of(look) == (PICTURE, STRIP, *buffers_of(look))
    assert buffers_of("flat") == ("albedo", "normal", "depth", "position_world", "id")


@pytest.mark.parametrize("view", BUFFERS)
def test_a_buffer_is_all_that_is_drawn_and_read_for_its_view(renderer, scene, drawn_plans, view):
    drawn = draw_view(renderer, scene, 0.0, view)
    ((plan, read),) = drawn_plans
    assert (plan.outputs, read) == ((view,), True)
    assert list(drawn.frame.images) == [view]
    assert drawn.image.corner == (0, 0)
    assert drawn.image.pixels.shape == (240, 320, 3)
    assert drawn.picture() is drawn.image.pixels
    assert drawn.picture().any()
    assert drawn.note


def test_the_picture_is_read_only_for_a_screenshot(renderer, scene, drawn_plans):
    for read in (False, True):
        drawn = draw_view(renderer, scene, 0.0, PICTURE, read=read)
        assert (drawn_plans[-1][1], list(drawn.frame.images)) == (read, ["color"] * read)
    assert drawn.image is None
    assert drawn.picture().shape == (240, 320, 3)


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("size", [(480, 360), (641, 479)])
def test_the_strip_draws_its_buffers_as_small_as_they_are_shown(scene, samples, size):
    with make_renderer(size, Settings(supersample=samples)) as renderer:
        drawn = draw_view(renderer, scene, 0.0, STRIP, read=True)
        assert (renderer.size, renderer.settings.supersample) == (size, samples)
    assert drawn.plan.outputs == ("color",)
    picture, strip = drawn.picture(), drawn.image
    assert picture.shape == (size[1], size[0], 3)
    top = strip.corner[1]
    assert top + strip.pixels.shape[0] == size[1]
    np.testing.assert_array_equal(picture[:top], drawn.frame.color[:top])
    assert (picture[top:] != drawn.frame.color[top:]).any(axis=-1).mean() > 0.9


def test_a_window_too_small_for_the_strip_says_so(renderer, scene, drawn_plans):
    drawn = draw_view(renderer, scene, 0.0, STRIP, read=True)
    assert drawn.image is None
    assert drawn.note == "no room for the buffers: make the window larger"
    assert len(drawn_plans) == 1
    np.testing.assert_array_equal(drawn.picture(), drawn.frame.color)


@pytest.mark.parametrize("look", LOOKS)
def test_other_looks_draw_each_of_their_views(scene, look):
    with make_renderer((480, 360), Settings(look=look)) as renderer:
        for view in views_of(look):
            assert draw_view(renderer, scene, 0.0, view, read=True).picture().any(), view


def test_highlights_and_emission_are_on_the_things_that_have_them(renderer, scene):
    ids = renderer.render(scene, 0.0, ("id",))
    for view, name, radiance in (("specular", "shiny", SPECULAR), ("emission", "ember", EMISSION)):
        picture = draw_view(renderer, scene, 0.0, view).picture()
        thing = ids.id == next(i for i, path in enumerate(ids.id_names) if path.endswith(name))
        np.testing.assert_array_equal(picture.any(axis=-1), thing)
        (color,) = np.unique(picture[thing], axis=0)
        assert np.argmax(color) == np.argmax(radiance)


def test_emission_is_as_bright_as_in_the_picture(renderer, scene):
    scene.exposure = 0.25
    scene.root.find("**/sky").detach_node()
    for name in ("sun", "spot", "lamps"):
        scene.root.find(f"**/{name}").detach_node()
    shown = draw_view(renderer, scene, 0.0, "emission").picture()
    color = renderer.render(scene, 0.0).color
    ember = shown.any(axis=-1)
    assert np.abs(shown[ember].astype(int) - color[ember]).max() <= 1


def test_overdraw_counts_in_its_note(renderer, scene):
    most = renderer.render(scene, 0.0, ("overdraw",)).overdraw.max()
    assert most > 1
    drawn = draw_view(renderer, scene, 0.0, "overdraw")
    assert drawn.note.endswith(f"white {most}")
    assert (drawn.picture() == 255).all(axis=-1).any()


def test_a_sun_has_no_edges(renderer):
    scene = ball_scene(lights=0)
    scene.root.attach_new_node(DirectionalLight("sun")).set_p(-60)
    assert not draw_view(renderer, scene, 0.0, "wireframe").picture().any()


def test_the_atlas_shows_what_the_sun_sees(renderer, scene):
    drawn = draw_view(renderer, scene, 0.0, "shadow_atlas")
    width, height = drawn.plan.shadows.size
    assert drawn.frame.shadow_atlas.shape == (height, width) != (240, 320)
    assert f"2 maps, {width} x {height} texels" in drawn.note
    greys = drawn.picture()[(np.ptp(drawn.picture(), axis=-1) == 0) & drawn.picture().any(axis=-1)]
    # both maps use the whole range of greys
    assert greys.max() == 255
    assert greys.min() <= 26
    assert len(np.unique(greys)) > 100


def test_without_shadows_the_atlas_is_black(renderer):
    drawn = draw_view(renderer, workshop.build(shadows=False, lamps=3), 0.0, "shadow_atlas")
    assert not drawn.picture().any()
    assert drawn.note == "no light casts shadows"


def test_forward_shading_shows_the_buffers_that_deferred_shading_would_have():
    with make_renderer((64, 48), Settings(light_method="forward")) as renderer:
        for view in ("picture", "depth", "overdraw"):
            assert draw_view(renderer, ball_scene(5), 0.0, view, read=True).picture().any()
        assert renderer.settings.light_method == "forward"

"""What does not change is not drawn again, and no frame shows what was drawn before it."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.passes import geometry
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer, make_renderer
from tests.scenes import ball_scene, geom_node, wall

OUTPUTS = ("color", "radiance", "depth", "normal", "albedo")


@pytest.fixture
def draws(monkeypatch):
    """How many surfaces the geometry pass has drawn, in a list that grows."""
    drawn = []
    real = geometry.draw_surface
    monkeypatch.setattr(
        geometry,
        "draw_surface",
        lambda gpu, made, *rest: (
            drawn.append(made.batch),
            real(gpu, made, *rest),
        ),
    )
    return drawn


def test_a_still_camera_draws_its_surfaces_once(draws):
    scene = ball_scene(30)
    with make_renderer() as renderer:
        first = renderer.render(scene, 0.0, OUTPUTS)
        once = len(draws)
        scene.root.find("lights").set_pos(0, 0, 0.5)  # light is drawn anew
        second = renderer.render(scene, 1.0, OUTPUTS)
        assert len(draws) == once > 0
        renderer.reuse = False
        third = renderer.render(scene, 1.0, OUTPUTS)
        assert len(draws) == 2 * once
    assert np.array_equal(first["normal"], second["normal"])
    assert not np.array_equal(first["color"], second["color"])
    for name in OUTPUTS:
        assert np.array_equal(second[name], third[name])


def changes():
    """What may change of a scene that is drawn, by name: each must be seen."""

    def paint(scene):
        scene.material.texture.set_pixels(np.full((8, 8, 4), 128, dtype=np.uint8))

    def shrink(scene):
        scene.geom.set_vertices(0.9 * scene.geom.vertices)

    return {
        "camera": lambda scene: scene.camera.set_x(0.3),
        "lens": lambda scene: scene.camera.node().lens.set_fov(40.0),
        "place": lambda scene: scene.path.set_x(0.4),
        "color": lambda scene: scene.material.set_base_color((0.9, 0.1, 0.1, 1.0)),
        "hidden": lambda scene: scene.path.hide(),
        "texture": paint,
        "vertices": shrink,
    }


def textured_scene():
    scene = Scene()
    pixels = np.full((8, 8, 4), 255, dtype=np.uint8)
    pixels[:4] = (200, 40, 40, 255)
    scene.material = Material("paper", (1, 1, 1, 1), texture=Texture(pixels, "paper"))
    scene.geom = wall(4.0)
    scene.path = scene.root.attach_new_node(geom_node("wall", scene.geom, scene.material))
    scene.path.set_pos(0, 8, 0)
    scene.root.attach_new_node(AmbientLight("sky", (0.5, 0.5, 0.5)))
    return scene


@pytest.mark.parametrize("what", changes())
def test_what_changes_is_drawn_again(what, draws):
    scene = textured_scene()
    with make_renderer() as renderer:
        before = renderer.render(scene)["color"]
        renderer.render(scene)
        once = len(draws)
        changes()[what](scene)
        after = renderer.render(scene)["color"]
    assert once == 1
    assert not np.array_equal(before, after)
    with make_renderer() as fresh:
        assert np.array_equal(after, fresh.render(scene)["color"])


# A frame depends on nothing that was drawn before it: whatever a renderer has been through, it draws what a
# new one draws, to the last bit.

STEPS = {
    "move": lambda scene, renderer, at: scene.camera.set_pos(0.2 * at, -4.0, 3.0),
    "turn": lambda scene, renderer, at: scene.camera.set_hpr(3.0 + at, -12.0, 2.0),
    "resize": lambda scene, renderer, at: renderer.resize((48 + 16 * at, 40)),
    "depth": lambda scene, renderer, at: setattr(renderer, "settings", Settings(position_method="depth32f")),
    "forward": lambda scene, renderer, at: setattr(renderer, "settings", Settings(light_method="forward")),
    "volumes": lambda scene, renderer, at: setattr(renderer, "settings", Settings(light_method="volumes")),
    "samples": lambda scene, renderer, at: setattr(renderer, "settings", Settings(supersample=2)),
    "classic": lambda scene, renderer, at: setattr(renderer, "settings", Settings(look="classic")),
    "float64": lambda scene, renderer, at: setattr(renderer, "settings", Settings(interpolation="float64")),
    "usual": lambda scene, renderer, at: setattr(renderer, "settings", Settings()),
    "another": lambda scene, renderer, at: renderer.render(ball_scene(5, seed=at)),
    "lamp": lambda scene, renderer, at: scene.root.attach_new_node(PointLight(f"lamp {at}", (1, 1, 1), 3.0)),
    "shadow": lambda scene, renderer, at: scene.root.find("lights").node().set_shadow_caster(at % 2 == 0, 64),
    "outputs": lambda scene, renderer, at: (
        None
        if renderer.settings.light_method == "forward" or renderer.settings.supersample > 1
        else renderer.render(scene, 0.0, ("id", "depth", "overdraw"))
    ),
}


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(sorted(STEPS)), st.integers(0, 4)), min_size=1, max_size=10))
def test_no_history_shows(steps):
    """One renderer draws all examples, so that each has those before it as its history."""
    scene = ball_scene(6, ambient=(0.01, 0.01, 0.02))
    with borrow_renderer(reuse=True) as renderer:
        renderer.render(scene)
        for number, (name, at) in enumerate(steps):
            STEPS[name](scene, renderer, at)
            seen = renderer.render(scene, 0.1 * at)
            # a list's beginning is a history as well: comparing each frame would take three times as long
            if number in (len(steps) // 2, len(steps) - 1):
                with make_renderer(renderer.size, renderer.settings) as fresh:
                    assert seen["color"].tobytes() == fresh.render(scene, 0.1 * at)["color"].tobytes(), steps


FRESH = """
import hashlib, sys, warnings
warnings.simplefilter("ignore")
from firefly_sample import Renderer
from firefly_sample.scenes import build_scene, find_scene
with Renderer((160, 120)) as renderer:
    frame = renderer.render(build_scene(find_scene("forest"), fireflies=80), 7.25)
print(hashlib.sha256(frame["color"].tobytes()).hexdigest())
"""


def test_a_frame_after_others_is_that_of_a_fresh_process():

    told = subprocess.run([sys.executable, "-c", FRESH], capture_output=True, text=True, check=True)
    scene = build_scene(find_scene("forest"), fireflies=500)
    with make_renderer((320, 200)) as renderer:
        for time in (5.0, 5.1, 90.0):
            renderer.render(scene, time)
        renderer.settings = Settings(light_method="volumes", supersample=2)
        renderer.render(scene, 3.0)
        renderer.settings = Settings()
        renderer.resize((160, 120))
        place = scene.camera.get_pos()
        scene.camera.set_pos(0, -40, 30)
        renderer.render(scene, 7.25)
        scene.camera.set_pos(place)
        scene.set("fireflies", 80)
        frame = renderer.render(scene, 7.25)
    assert hashlib.sha256(frame["color"].tobytes()).hexdigest() == told.stdout.strip()


@pytest.mark.parametrize("interpolation", ["rasterizer", "float64"])
def test_what_takes_the_place_of_something_gone_is_not_taken_for_it(interpolation):
    """Python gives the id of what is gone to what comes next, and both have the same revision."""
    sizes, shades, seen, again = (2.0, 4.0, 8.0), (50, 100, 200), set(), 0
    with make_renderer((32, 24), Settings(interpolation=interpolation, albedo_format="rgba32f")) as renderer:
        for turn in range(60):
            geom = wall(sizes[turn % 3])
            texture = Texture(np.full((1, 1, 4), (*[shades[turn % 2]] * 3, 255), dtype=np.uint8))
            again += id(geom) in seen or id(texture) in seen
            seen |= {id(geom), id(texture)}
            scene = Scene(background=(0.0, 0.0, 1.0))
            scene.root.attach_new_node(geom_node("wall", geom, Material("m", texture=texture))).set_y(5)
            scene.root.attach_new_node(AmbientLight("sky"))
            scene.camera.node().lens = OrthographicLens(film_size=(16, 12), near=1, far=9)
            frame = renderer.render(scene, outputs=("id", "radiance"))
            there = frame.id >= 0
            assert there.sum() == (2 * sizes[turn % 3]) ** 2
            linear = ((shades[turn % 2] / 255 + 0.055) / 1.055) ** 2.4
            assert frame.radiance[there] == pytest.approx(linear, abs=1 / 65535)
            del scene, geom, texture, frame
    assert again

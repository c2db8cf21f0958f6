"""Visibility by rays: against known answers, and against the rasteriser, which may differ on edges alone."""

import builtins

import numpy as np
import pytest

from firefly_sample.errors import MissingPackageError
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.lab.float64 import edges, plan_of
from tests.lit_scenes import lit_scene
from tests.scenes import ball_scene, geom_node, orthographic_wall, wall, wall_scene


def both(scene, size=(160, 120), time=0.0):
    """Visibility by the rasteriser and by rays."""
    with make_renderer(size) as renderer:
        plan = renderer.plan(scene, time, ("visibility",))
        drawn = renderer.draw(plan)["visibility"]
    return drawn, cast_visibility(plan)


SCENES = {
    "balls": lambda: ball_scene(4),
    "turned": lambda: lit_scene(("ramp",), "everything"),
    "orthographic": lambda: lit_scene(("ramp",), orthographic=True),
    "lightbulbs": lambda: build_scene(find_scene("lightbulbs"), columns=4, rows=4),
}


@pytest.mark.parametrize("name", list(SCENES))
def test_rays_see_what_the_rasteriser_draws(name):
    drawn, cast = both(SCENES[name](), time=1.0)
    differs = (drawn != cast).any(axis=-1)
    assert (drawn[..., 0] >= 0).mean() > 0.3
    assert not (differs & ~edges(drawn)).any()
    # corners snap to 1/256 pixel: of a pixel that an edge passes through, about that much changes sides
    assert differs.sum() <= max(edges(drawn).sum() / 64, 3)


def test_leaves_are_cut_out_as_they_are_drawn():
    drawn, cast = both(build_scene(find_scene("forest"), fireflies=10), time=5.0)
    differs = (drawn != cast).any(axis=-1)
    # where alpha is near the cut-off, the driver's filtering decides; small leaves are all edges here
    assert differs.mean() <= 0.015
    assert (differs & ~edges(drawn)).sum() <= 0.0005 * differs.size
    assert (drawn[..., 0] >= 0).mean() > 0.9


def leafy_scene():
    """A wall behind one that is cut out in its left half, with a hard edge."""
    pixels = np.full((4, 4, 4), 255, dtype=np.uint8)
    pixels[:, :2, 3] = 0
    leaf = Material("leaf", texture=Texture(pixels), alpha_mode="mask", alpha_cutoff=0.5)
    scene = wall_scene(10.0, size=20.0)
    scene.root.attach_new_node(geom_node("leaf", wall(8.0), leaf)).set_pos(0, 5, 0)
    return scene


def test_what_alpha_cuts_away_shows_what_is_behind():
    plan = plan_of(leafy_scene(), (64, 48))
    names = np.array([plan.id_names[i].split("/")[-1] for batch in plan.batches for i in batch.ids])
    seen = names[cast_visibility(plan)[..., 0]]
    # the whole view is 5.77 high and 7.7 wide at the leaf, which is 8 wide
    assert (seen[:, :31] == "wall").all()
    assert (seen[:, 33:] == "leaf").all()


def test_backs_are_seen_on_two_sided_materials_alone():
    for double_sided, mirrored, turned, seen in (
        (False, False, False, True),
        (False, False, True, False),
        (False, True, False, True),
        (False, True, True, False),
        (True, False, True, True),
        (True, True, True, True),
    ):
        scene = wall_scene(10.0, material=Material("paper", double_sided=double_sided))
        path = scene.root.find("wall")
        path.set_hpr(180.0 * turned, 0, 0)
        path.set_scale(-1.0 if mirrored else 1.0, 1.0, 1.0)
        drawn, cast = both(scene, (16, 12))
        assert ((cast[..., 0] == 0) == seen).all()
        assert (drawn[..., 0] == cast[..., 0]).all()


@pytest.mark.parametrize("make", [wall_scene, orthographic_wall])
def test_the_planes_cut(make):
    """Walls at 3, 6 and 9: what is seen is the first one between near and far."""
    cases = ((1, 20, "3"), (4, 20, "6"), (5.99, 9, "6"), (7, 9.01, "9"), (1, 2, ""), (10, 20, ""))
    for near, far, expected in cases:
        scene = make(3.0)
        scene.root.find("wall").detach_node()
        for distance in (3, 6, 9):
            scene.root.attach_new_node(geom_node(str(distance), wall(40.0))).set_pos(0, distance, 0)
        orthographic = make is orthographic_wall
        scene.camera.node().lens = (
            OrthographicLens(film_size=(8, 6), near=near, far=far)
            if orthographic
            else PerspectiveLens(vfov=60, near=near, far=far)
        )
        plan = plan_of(scene, (16, 12))
        names = [plan.id_names[i].split("/")[-1] for batch in plan.batches for i in batch.ids]
        seen = {names[i] if i >= 0 else "" for i in np.unique(cast_visibility(plan)[..., 0])}
        assert seen == {expected}


@pytest.mark.parametrize("fov", [1e-3, 179.0])
def test_extreme_lenses_keep_their_pixels(fov):
    """A wall of cells that fills the view: each pixel's cell is known."""
    distance = 10.0
    width = 2 * distance * np.tan(np.radians(fov / 2))
    scene = wall_scene(distance, size=width, cells=10, vfov=fov)
    plan = plan_of(scene, (40, 40))
    triangle = cast_visibility(plan)[..., 1]
    row, column = np.divmod(np.arange(1600).reshape(40, 40), 40)
    cell = triangle % 100
    assert (cell % 10 == column // 4).all()
    assert (cell // 10 == 9 - row // 4).all()


def test_nothing_is_seen_of_nothing():
    assert (cast_visibility(build_plan(Scene(), Settings(), (8, 6))) == -1).all()


def test_a_missing_library_is_named(monkeypatch):
    real = builtins.__import__

    def without(name, *rest):
        if name.startswith("embreex"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingPackageError, match=r"-m pip install .*embreex"):
        cast_visibility(plan_of(ball_scene(1), (8, 6)))


def test_any_number_of_threads_gives_the_same():
    plan = plan_of(leafy_scene(), (300, 200))
    assert (cast_visibility(plan, threads=1) == cast_visibility(plan, threads=3)).all()

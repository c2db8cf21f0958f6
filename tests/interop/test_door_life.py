"""The life of the door's renderers: threads, sizes, several at once, beside pyrender's own, and their end."""

from __future__ import annotations

import math
import multiprocessing
import weakref
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pyrender
import pytest
import trimesh
from pyrender import RenderFlags
from trimesh.transformations import translation_matrix

import firefly_sample.interop.pyrender as door
from firefly_sample.errors import GpuError, OutputError, SceneError
from tests.interop import door_scenes as scenes
from tests.interop.door_parts import look, scene
from tests.interop.oracle import use_egl
from tests.interop.pyrender_twin import PYRENDER, Lamp, Lighting, Surface, codes

SIZE = 64, 48
BUILDS = scenes.twelve_lights, scenes.panes, scenes.textures, scenes.wireframes, scenes.points


def drawn(build=scenes.panes, size=SIZE):
    """The colour of a scene, by a renderer of its own."""
    with door.OffscreenRenderer(*size) as renderer:
        return renderer.render(build())[0]


@pytest.mark.parametrize("build", BUILDS)
def test_a_scene_has_the_same_bytes_again(build):
    """Drawn again, and built and drawn anew."""
    with door.OffscreenRenderer(*SIZE) as renderer:
        made = build()
        first, again = renderer.render(made), renderer.render(made)
        anew = renderer.render(build())
    for color, depth in (again, anew):
        assert (color == first[0]).all()
        assert (depth == first[1]).all()
    assert (drawn(build) == first[0]).all()


def test_a_renderer_lives_in_another_thread():
    with ThreadPoolExecutor(1) as other:
        assert (other.submit(drawn).result() == drawn()).all()


def test_two_threads_draw_with_a_renderer_each():
    together = Barrier(2)

    def many(build):
        with door.OffscreenRenderer(*SIZE) as renderer:
            made = build()
            together.wait()
            return [renderer.render(made)[0] for _ in range(10)]

    with ThreadPoolExecutor(2) as pool:
        drawings = list(pool.map(many, BUILDS[:2]))
    for build, pictures in zip(BUILDS[:2], drawings, strict=True):
        assert (np.array(pictures) == drawn(build)).all()


def test_two_threads_use_one_renderer_in_turn():
    made, expected = scenes.panes(), drawn()
    with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(1) as two:
        renderer = one.submit(door.OffscreenRenderer, *SIZE).result()
        for thread in (one, two, one, two):
            assert (thread.submit(renderer.render, made).result()[0] == expected).all()
        assert (renderer.render(made)[0] == expected).all()
        two.submit(renderer.delete).result()


def test_renderers_of_several_sizes_live_at_once():
    sizes = [(64, 48), (33, 17), (120, 90)]
    expected, made = [drawn(size=size) for size in sizes], scenes.panes()
    renderers = [door.OffscreenRenderer(*size) for size in sizes]
    for _ in range(2):
        for renderer, wanted in zip(renderers, expected, strict=True):
            assert (renderer.render(made)[0] == wanted).all()
    renderers[0].delete()
    for renderer, wanted in zip(renderers[1:], expected[1:], strict=True):
        assert (renderer.render(made)[0] == wanted).all()
        renderer.delete()
    assert (drawn(size=sizes[0]) == expected[0]).all()


@pytest.mark.parametrize("flags", [RenderFlags.NONE, RenderFlags.SEG, RenderFlags.RGBA | RenderFlags.FLAT])
def test_a_changed_size_draws_like_a_renderer_of_that_size(flags):
    made = scenes.intrinsics()
    colors = {node: index + 1 for index, node in enumerate(made.mesh_nodes)}
    with door.OffscreenRenderer(*SIZE) as changing:
        for size in [(64, 48), (160, 120), (40, 60), (64, 48)]:
            changing.viewport_width, changing.viewport_height = size
            with door.OffscreenRenderer(*size) as fixed:
                pairs = zip(
                    changing.render(made, flags, colors), fixed.render(made, flags, colors), strict=True
                )
                assert all((one == other).all() for one, other in pairs)


def test_an_error_leaves_a_renderer_as_it_was():
    with door.OffscreenRenderer(*SIZE) as renderer:
        with pytest.raises(SceneError):
            renderer.render(pyrender.Scene())
        assert (renderer.render(scenes.panes())[0] == drawn()).all()


def test_a_light_that_is_refused_is_there_again_when_it_is_put_right():
    made = scenes.panes()
    node = next(iter(made.light_nodes))
    with door.OffscreenRenderer(*SIZE) as renderer:
        before, right = renderer.render(made)[0], node.light.intensity
        node.light.intensity = -1.0
        with pytest.raises(SceneError, match="color must be"):
            renderer.render(made)
        node.light.intensity = right
        assert (renderer.render(made)[0] == before).all()


def test_a_size_that_is_refused_changes_nothing():
    with door.OffscreenRenderer(*SIZE) as renderer:
        for name in ("viewport_width", "viewport_height", "point_size"):
            before = getattr(renderer, name)
            for wrong in (0, -1):
                with pytest.raises(OutputError, match="pixels"):
                    setattr(renderer, name, wrong)
            assert getattr(renderer, name) == before


def test_after_delete_every_way_to_draw_says_so():
    made = scenes.panes()
    renderer = door.OffscreenRenderer(*SIZE)
    renderer.render(made)
    renderer.delete()
    renderer.delete()
    ways = (
        lambda: renderer.render(made),
        lambda: renderer.render(made, RenderFlags.DEPTH_ONLY),
        lambda: renderer.render(made, RenderFlags.SEG, {}),
        lambda: renderer.render_outputs(made),
    )
    for way in ways:
        with pytest.raises(GpuError, match="this OffscreenRenderer is deleted: make a new one"):
            way()


def test_a_renderer_that_is_dropped_is_freed():
    expected = drawn()

    def drop():
        renderer = door.OffscreenRenderer(*SIZE)
        assert (renderer.render(scenes.panes())[0] == expected).all()
        return weakref.ref(renderer)

    gone = drop()  # a warning would be an error
    assert gone() is None
    assert (drawn() == expected).all()


def beside_pyrender():
    """Four pictures of a scene, by pyrender's renderer and the door's in turn, and pyrender's at the end."""
    made = scenes.spotlights()
    theirs = pyrender.OffscreenRenderer(*SIZE)
    ours = door.OffscreenRenderer(*SIZE)
    pictures = [renderer.render(made)[0].copy() for renderer in (theirs, ours, theirs, ours)]
    ours.delete()
    pictures.append(theirs.render(made)[0].copy())
    theirs.delete()
    return pictures


def test_both_renderers_draw_in_one_process():
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawn, initializer=use_egl) as pool:
        theirs, ours, theirs_again, ours_again, theirs_at_last = pool.submit(beside_pyrender).result()
    assert (ours == drawn(scenes.spotlights)).all()
    assert (ours_again == ours).all()
    assert (theirs_again == theirs).all()
    assert (theirs_at_last == theirs).all()
    assert np.abs(ours.astype(int) - theirs).mean() < 2.0  # theirs has four samples in a pixel


# --- many lights ---


@pytest.mark.parametrize("kind", ["point", "spot", "directional"])
def test_a_pile_of_500_lights_is_one_light(kind):
    def pile(count):
        kinds = {
            "point": lambda share: pyrender.PointLight(intensity=40.0 * share),
            "spot": lambda share: pyrender.SpotLight(
                intensity=60.0 * share, innerConeAngle=0.2, outerConeAngle=0.5
            ),
            "directional": lambda share: pyrender.DirectionalLight(intensity=3.0 * share),
        }
        made = scene(ambient_light=(0.0, 0.0, 0.0))
        made.add(pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(3), look()))
        for _ in range(count):
            made.add(kinds[kind](1.0 / count), pose=translation_matrix((0, 0, 4)))
        return made

    one, many = (drawn(lambda count=count: pile(count)).astype(int) for count in (1, 500))
    assert one.max() > 100
    assert np.abs(one - many).max() <= 1


def test_each_of_500_lamps_lights_its_patch_of_the_floor():
    """The picture is that of the formula in float64, with all lamps."""
    made = pyrender.Scene(ambient_light=(0.0, 0.0, 0.0))
    made.add(pyrender.PerspectiveCamera(0.8), pose=translation_matrix((0, 0, 10)))
    floor = trimesh.creation.box((20.0, 20.0, 1.0))
    material = look((0.7, 0.6, 0.5, 1.0), metallic=0.0, roughness=0.8)
    made.add(pyrender.Mesh.from_trimesh(floor, material, smooth=False), pose=translation_matrix((0, 0, -0.5)))
    rng = np.random.default_rng(5)
    lighting = Lighting()
    for column in range(25):
        for row in range(20):
            place = 0.4 * (column - 12.0), 0.4 * (row - 9.5), 0.1
            color = rng.uniform(0.3, 1.0, 3)
            made.add(pyrender.PointLight(color, 0.01), pose=translation_matrix(place))
            lighting.lamps.append(Lamp(0.01 * color, np.array(place) - (0, 0, 10)))
    width, height = 160, 120
    rows, columns = np.mgrid[:height:5, :width:5]
    size = 2.0 * math.tan(0.4) * 10.0 / height
    count = rows.size
    positions = np.column_stack(
        [
            size * (columns.ravel() + 0.5 - 0.5 * width),
            size * (0.5 * height - rows.ravel() - 0.5),
            np.full(count, -10.0),
        ]
    )
    ones = np.ones(count)
    surface = Surface(
        position=positions,
        normal=np.tile((0.0, 0.0, 1.0), (count, 1)),
        to_eye=-positions / np.linalg.norm(positions, axis=1, keepdims=True),
        base=np.tile((0.7, 0.6, 0.5), (count, 1)),
        metallic=0.0 * ones,
        roughness=0.8 * ones,
        emission=np.zeros((count, 3)),
        tint=np.ones((count, 3)),
        occlusion=ones,
    )
    expected = codes(surface, lighting, PYRENDER.keys())
    color = drawn(lambda: made, (width, height))[rows, columns].reshape(-1, 3)
    assert np.ptp(expected) > 100
    assert np.abs(color - expected).max() <= 1

"""The door for pyrender's scripts: its names, its flags, its arguments, and what is added to them."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pyrender as theirs
import pytest
import trimesh
from pyrender import RenderFlags
from trimesh.transformations import rotation_matrix, translation_matrix

import firefly_sample.interop.pyrender as door
from firefly_sample.errors import GpuError, OutputError, SceneError, SettingsError
from firefly_sample.interop.pyrender.conversions import Conversions, Treatment
from firefly_sample.interop.pyrender.mirror import SceneMirror
from firefly_sample.interop.pyrender.offscreen import MOST_TOLD
from firefly_sample.losses import ConversionWarning
from firefly_sample.settings import Settings
from tests.interop.door_parts import EYE, add_lights, add_shapes, look, scene

SIZE = (64, 48)
MIDDLE = 24, 32


@pytest.fixture(scope="module")
def renderer():
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


def ball_scene(**given):
    """A ball of radius 1 at the origin, seen from a distance of 6, and its node."""
    made = add_lights(scene(**given), suns=1)
    return made, made.add(theirs.Mesh.from_trimesh(trimesh.creation.icosphere(4), material=look()))


def test_every_public_name_of_pyrender_is_there_and_the_same_but_for_the_renderer():
    for name in theirs.__all__:
        assert (getattr(door, name) is getattr(theirs, name)) == (name != "OffscreenRenderer"), name
    assert set(theirs.__all__) <= set(door.__all__)
    assert set(theirs.__all__) <= set(dir(door))
    with pytest.raises(AttributeError, match="nor pyrender has an attribute 'Mehs'"):
        getattr(door, "Mehs")  # noqa: B009 (a name that is not there)


def test_submodules_are_those_of_pyrender():
    import firefly_sample.interop.pyrender.constants as constants
    from firefly_sample.interop.pyrender.material import SpecularGlossinessMaterial

    assert constants is theirs.constants
    assert SpecularGlossinessMaterial is theirs.material.SpecularGlossinessMaterial


def test_all_names_can_be_imported_at_once():
    names: dict[str, object] = {}
    exec("from firefly_sample.interop.pyrender import *", names)
    assert names["OffscreenRenderer"] is door.OffscreenRenderer
    assert names["Mesh"] is theirs.Mesh


def test_a_script_may_ask_for_osmesa():
    """It need not be installed: without it, pyrender cannot be imported in the ordinary way."""
    text = """
import os; os.environ["PYOPENGL_PLATFORM"] = "osmesa"
import firefly_sample.interop.pyrender as pyrender
scene = pyrender.Scene()
scene.add(pyrender.PerspectiveCamera(1.0))
with pyrender.OffscreenRenderer(8, 8) as renderer:
    print(renderer.render(scene)[0].tolist()[0][0], os.environ["PYOPENGL_PLATFORM"])
"""
    command = [sys.executable, "-W", "ignore", "-c", text]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == "[255, 255, 255] osmesa\n"


def test_color_and_depth_have_pyrenders_types_and_shapes(renderer):
    made, _ = ball_scene()
    color, depth = renderer.render(made)
    assert color.shape == (48, 64, 3)
    assert color.dtype == np.uint8
    assert depth.shape == (48, 64)
    assert depth.dtype == np.float32
    assert math.isclose(depth[MIDDLE], 5.0, rel_tol=1e-3)
    assert depth[0, 0] == 0.0


def test_depth_alone_is_the_depth_of_the_picture(renderer):
    made, _ = ball_scene()
    assert np.array_equal(renderer.render(made, RenderFlags.DEPTH_ONLY), renderer.render(made)[1])


def test_depth_holds_blended_surfaces_like_any_other(renderer):
    made, _ = ball_scene()
    pane = theirs.Mesh.from_trimesh(
        trimesh.creation.box((4, 4, 0.02)), material=look((1, 1, 1, 0.3), alphaMode="BLEND")
    )
    made.add(pane, pose=translation_matrix((0, 0, 2)))
    assert math.isclose(renderer.render(made)[1][MIDDLE], 3.99, rel_tol=1e-5)


@pytest.mark.parametrize("alpha", [0.0, 0.25, 1.0])
def test_alpha_is_the_backgrounds_where_nothing_is_and_1_on_surfaces(renderer, alpha):
    made, _ = ball_scene(bg_color=(0.4, 0.1, 0.7, alpha))
    color, depth = renderer.render(made, flags=RenderFlags.RGBA)
    assert color.shape == (48, 64, 4)
    assert (color[depth > 0, 3] == 255).all()
    assert (color[depth == 0, 3] == round(255 * alpha)).all()
    assert (color[..., :3] == renderer.render(made)[0]).all()


def test_alpha_before_a_clear_background_is_that_of_a_pane(renderer):
    made = scene(bg_color=(0, 0, 0, 0))
    pane = theirs.Mesh.from_trimesh(
        trimesh.creation.box((4, 4, 0.02)), material=look((1, 1, 1, 0.4), alphaMode="BLEND")
    )
    made.add(pane)
    assert renderer.render(made, RenderFlags.RGBA)[0][MIDDLE][3] == 102


def test_the_background_is_shown_in_its_own_codes(renderer):
    made = theirs.Scene(bg_color=(0.2, 0.4, 0.8))
    made.add(theirs.PerspectiveCamera(1.0))
    for flags in (RenderFlags.NONE, RenderFlags.FLAT):
        assert renderer.render(made, flags)[0][0, 0].tolist() == [51, 102, 204]
    with door.OffscreenRenderer(*SIZE, look="correct") as other:
        assert other.render(made)[0][0, 0].tolist() == [51, 102, 204]


def test_the_size_can_be_changed_between_renders():
    made, _ = ball_scene()
    with door.OffscreenRenderer(32, 24) as changing:
        small = changing.render(made)[0]
        changing.viewport_width, changing.viewport_height = 64, 48
        assert changing.render(made)[0].shape == (48, 64, 3)
        changing.viewport_width, changing.viewport_height = 32, 24
        assert (changing.render(made)[0] == small).all()


def test_a_segment_has_its_own_color_as_a_number_or_as_three(renderer):
    made = add_shapes(scene())
    nodes = sorted(made.mesh_nodes, key=lambda node: node.name)
    seen, depth = renderer.render(made, RenderFlags.SEG, {nodes[0]: 7, nodes[2]: (1, 200, 30)})
    assert seen.dtype == np.uint8
    assert {tuple(each) for each in seen.reshape(-1, 3)} == {(0, 0, 0), (7, 7, 7), (1, 200, 30)}
    assert ((depth > 0) == seen.any(axis=-1)).all()  # what is not in the map hides nothing
    assert not renderer.render(made, RenderFlags.SEG)[0].any()


def test_segments_may_have_an_alpha_or_only_a_depth(renderer):
    made, node = ball_scene()
    made.add(theirs.Mesh.from_trimesh(trimesh.creation.box((9, 9, 0.1))), pose=translation_matrix((0, 0, -2)))
    plain, depth = renderer.render(made, RenderFlags.SEG, {node: 9})
    with_alpha, _ = renderer.render(made, RenderFlags.SEG | RenderFlags.RGBA, {node: 9})
    assert (with_alpha[..., :3] == plain).all()
    assert (with_alpha[..., 3] == 255).all()
    assert (renderer.render(made, RenderFlags.SEG | RenderFlags.DEPTH_ONLY, {node: 9}) == depth).all()
    assert ((depth > 0) == (plain[..., 0] == 9)).all()


def test_ids_that_eight_bits_do_not_hold_are_named(renderer):
    made, node = ball_scene()
    with pytest.warns(ConversionWarning, match="numbers above 255, which become 255: give three numbers"):
        assert renderer.render(made, RenderFlags.SEG, {node: 300})[0][MIDDLE].tolist() == [255] * 3


def test_outputs_are_in_pyrenders_axes(renderer):
    made, node = ball_scene()
    made.set_pose(node, translation_matrix((0.0, 0.5, 0.0)))
    found = renderer.render_outputs(
        made, ("depth", "position", "position_world", "normal", "normal_world", "id")
    )
    covered = np.isfinite(found["depth"])
    assert found["nodes"] == [node]
    assert ((found["id"] == 0) == covered).all()
    assert (found["id"][~covered] == -1).all()
    places = found["position_world"][covered]
    assert np.allclose(np.linalg.norm(places - (0.0, 0.5, 0.0), axis=1), 1.0, atol=0.01)
    assert np.allclose(found["normal_world"][covered], places - (0.0, 0.5, 0.0), atol=0.05)
    assert np.allclose(found["position"][covered], places - (0.0, 0.0, 6.0), atol=1e-4)
    assert np.allclose(found["position"][covered][:, 2], -found["depth"][covered])
    assert np.allclose(found["normal"][covered], found["normal_world"][covered], atol=1e-4)
    with pytest.raises(OutputError, match="SEG and DEPTH_ONLY"):
        renderer.render_outputs(made, ("id",), RenderFlags.SEG)


def test_the_camera_that_is_the_main_one_draws(renderer):
    made, _ = ball_scene()
    near = made.add(theirs.PerspectiveCamera(0.7), pose=translation_matrix((0, 0, 3)))
    made.main_camera_node = near
    assert math.isclose(renderer.render(made)[1][MIDDLE], 2.0, rel_tol=1e-3)


def test_what_is_no_scene_is_refused(renderer):
    with pytest.raises(SceneError, match=r"render takes a pyrender.Scene, got \[\]"):
        renderer.render([])
    with pytest.raises(SceneError, match=r"render_outputs takes a pyrender.Scene"):
        renderer.render_outputs(None)


def test_the_device_is_that_of_pyrenders_variable(monkeypatch):
    monkeypatch.setenv("EGL_DEVICE_ID", "0")
    with door.OffscreenRenderer(*SIZE) as first:
        assert first.render(ball_scene()[0])[1].any()
    monkeypatch.setenv("EGL_DEVICE_ID", "77")
    with pytest.raises(GpuError, match="77"):
        door.OffscreenRenderer(*SIZE)


def test_without_a_camera_the_error_says_what_to_do(renderer):
    with pytest.raises(SceneError, match="no camera: add one"):
        renderer.render(theirs.Scene())
    with pytest.raises(ValueError, match="no camera"):  # as pyrender's
        renderer.render(theirs.Scene())


def test_settings_are_given_by_name():
    with pytest.raises(SettingsError, match="look"):
        door.OffscreenRenderer(8, 8, look="pretty")
    with pytest.raises(SettingsError, match="full"):
        door.OffscreenRenderer(8, 8, light_resolution="half")
    made, _ = ball_scene()
    with door.OffscreenRenderer(*SIZE, supersample=2) as smooth, door.OffscreenRenderer(*SIZE) as hard:
        one, other = smooth.render(made), hard.render(made)
    edge = np.abs(one[0].astype(int) - other[0]).max(axis=-1) > 10
    assert 20 < edge.sum() < 200  # around a ball of 30 pixels


def test_the_look_of_gltf_is_a_word_away():
    """A matt surface that faces a light of intensity pi reflects its colour; pyrender's, 0.96 of that."""
    made = theirs.Scene(bg_color=(0, 0, 0))
    made.add(theirs.OrthographicCamera(1.0, 1.0), pose=EYE)
    made.add(theirs.DirectionalLight(intensity=math.pi), pose=EYE)
    matt = look((0.5, 0.5, 0.5, 1.0), metallic=0.0, roughness=1.0)
    made.add(theirs.Mesh.from_trimesh(trimesh.creation.box((4, 4, 2)), material=matt, smooth=False))
    codes = []
    for name in ("pyrender", "correct"):
        with door.OffscreenRenderer(*SIZE, look=name) as drawing:
            codes.append(int(drawing.render(made)[0][MIDDLE][0]))
    # head on, all cosines are 1: F = 0.04, D = 1; pi times the highlight is F D / 4, once over 1.00025
    theirs_linear = 0.96 * 0.96 * 0.5 + 0.04 * 0.25 / 1.00025
    ours_linear = 0.96 * 0.5 + 0.04 * 0.25
    assert codes == [
        round(255 * theirs_linear ** (1 / 2.2)),
        round(255 * (1.055 * ours_linear ** (1 / 2.4) - 0.055)),
    ]


def test_point_lights_cast_shadows_where_pyrender_has_none(renderer):
    made = scene(ambient_light=(0, 0, 0))
    made.add(theirs.Mesh.from_trimesh(trimesh.creation.box((6, 6, 0.1)), material=look(), smooth=False))
    made.add(theirs.Mesh.from_trimesh(trimesh.creation.box((1, 1, 0.1))), pose=translation_matrix((0, 0, 1)))
    made.add(theirs.PointLight(intensity=60.0), pose=translation_matrix((3, 0, 3)))
    plain, shadowed = (renderer.render(made, flags)[0] for flags in (0, RenderFlags.SHADOWS_POINT))
    darker = shadowed.astype(int).sum(-1) < plain.astype(int).sum(-1) - 60
    pixel = 2.0 * math.tan(0.35) * 5.95 / 48  # on the floor, whose top is at z = 0.05
    rows, columns = np.nonzero(darker)
    x, y = (columns - 31.5) * pixel, (23.5 - rows) * pixel
    # by similar triangles from the lamp at (3, 0, 3): the square's far upper edge, near lower edge, sides
    assert math.isclose(x.min(), 3.0 - 3.5 * 2.95 / 1.95, abs_tol=pixel)
    assert math.isclose(x.max(), 3.0 - 2.5 * 2.95 / 2.05, abs_tol=pixel)
    assert math.isclose(y.max(), 0.5 * 2.95 / 1.95, abs_tol=pixel)
    assert math.isclose(y.min(), -0.5 * 2.95 / 1.95, abs_tol=pixel)


def test_wireframes_can_be_made_solid(renderer):
    made = add_lights(add_shapes(scene(), wireframe=True), suns=1)
    solid = renderer.render(made, RenderFlags.ALL_SOLID)
    plain = renderer.render(add_lights(add_shapes(scene()), suns=1))
    assert (solid[0] == plain[0]).all()
    assert (solid[1] == plain[1]).all()


def test_what_cannot_be_kept_is_named_once(renderer):
    made, node = ball_scene()
    node.weights = [0.5]
    node.name = "morphing ball"
    with pytest.warns(ConversionWarning, match="skins and morph weights are left out: 'morphing ball'"):
        renderer.render(made)
    renderer.render(made)  # warnings are errors in these tests


def test_losses_of_meshes_are_named_once_where_pictures_are_not_as_pyrenders():
    """After flat frames and data, which do not depend on them, and not again for another pose."""
    card = {"positions": [(0, 0, 0), (1, 0, 0), (0, 1, 0)], "mode": 4, "material": look()}
    bent = {"normals": [(0, 0, 1)] * 3, "tangents": [(1, 0, 0, 0.5)] * 3, "joints_0": np.zeros((3, 4))}
    made = add_lights(scene(), suns=1)
    made.add(theirs.Mesh([theirs.Primitive(**card)]), name="bare")
    node = made.add(theirs.Mesh([theirs.Primitive(**card, **bent)]), name="bent")
    with door.OffscreenRenderer(*SIZE, look="correct") as drawing, door.OffscreenRenderer(*SIZE) as alike:
        for flags in (RenderFlags.FLAT, RenderFlags.SEG, RenderFlags.DEPTH_ONLY):
            drawing.render(made, flags, {node: 1})
        alike.render(made)
        with pytest.warns(ConversionWarning) as told:
            drawing.render(made)
        made.set_pose(node, translation_matrix((1, 0, 0)))
        drawing.render(made, RenderFlags.SKIP_CULL_FACES)
        drawing.render(made)
    lines = sorted(str(each.message) for each in told)
    assert [line.rpartition(": ")[2] for line in lines] == ["'bent'", "'bare'", "'bent'"]
    for line, what in zip(lines, ("joints_0", "meshes without normals", "tangents without"), strict=True):
        assert line.startswith(what)


@pytest.mark.parametrize(
    ("suns", "lamps", "maps", "share"),
    [(8, 0, 8, 1), (9, 0, 9, 2), (12, 0, 12, 2), (8, 1, 14, 2), (33, 0, 33, 4)],
)
def test_smaller_shadow_maps_are_named_with_a_way_out(suns, lamps, maps, share):
    """2^25 texels hold eight maps of 2048; a lamp has six of 512."""
    made = add_lights(scene(), suns=suns, lamps=lamps)
    conversions = Conversions()
    kinds = frozenset({"directional", "point"})
    mirror = SceneMirror(Treatment(shadows=kinds), conversions)
    drawn = mirror.update(made, SIZE)
    sun = drawn.root.find("**/+DirectionalLight").node()
    assert sun.get_shadow_resolution() == 2048 // share
    lines = conversions.losses.lines()
    assert len(lines) == (share > 1)
    assert all(line.startswith(f"{maps} shadow maps have 1/{share} of their usual texels") for line in lines)
    ways_out = "SHADOWS_DIRECTIONAL", "set_shadow_caster", "shadow_resolution"
    assert all(way in line for line in lines for way in ways_out)


def test_shadow_maps_of_a_size_that_is_set_are_not_named():
    """Twelve of 64 a side: the maps of 2048 that lights have otherwise would be smaller."""
    made, _ = ball_scene()
    add_lights(made, suns=11)
    with door.OffscreenRenderer(*SIZE, shadow_resolution=64) as drawing:
        drawing.render(made, RenderFlags.SHADOWS_DIRECTIONAL)  # warnings are errors in these tests


def test_settings_that_are_not_given_are_those_of_the_look():
    for name, options in (("pyrender", {}), ("correct", {"look": "correct"}), ("flat", {"look": "flat"})):
        with door.OffscreenRenderer(*SIZE, **options) as drawing:
            assert drawing.settings == Settings(look=name, tone="none")
            assert drawing.settings.budget == Settings(look=name).budget


def test_a_renderer_forgets_old_warnings(renderer):
    told = dict(renderer._told)
    with pytest.warns(ConversionWarning) as caught:
        renderer._tell([*(f"loss {number}" for number in range(MOST_TOLD + 50)), f"loss {MOST_TOLD}"])
    assert len(caught) == MOST_TOLD + 50
    assert len(renderer._told) == MOST_TOLD
    with pytest.warns(ConversionWarning, match="^loss 0$"):
        renderer._tell(["loss 0"])
    renderer._told = told


def test_a_scale_of_the_camera_is_named(renderer):
    made, _ = ball_scene()
    made.set_pose(made.main_camera_node, EYE @ np.diag((2.0, 2.0, 2.0, 1.0)))
    with pytest.warns(ConversionWarning, match="scale and shear of cameras are left out"):
        depth = renderer.render(made)[1]
    assert math.isclose(depth[MIDDLE], 5.0, rel_tol=1e-3)


def test_after_delete_nothing_can_be_drawn():
    gone = door.OffscreenRenderer(*SIZE)
    gone.delete()
    gone.delete()
    with pytest.raises(GpuError, match="deleted: make a new one"):
        gone.render(ball_scene()[0])


def test_a_turned_camera_sees_what_pyrender_would(renderer):
    made, _ = ball_scene()
    made.set_pose(made.main_camera_node, rotation_matrix(math.pi, (0, 1, 0)))
    made.set_pose(next(iter(made.mesh_nodes)), translation_matrix((0.5, 0.0, 4.0)))
    depth = renderer.render(made)[1]
    assert depth[24, :32].astype(bool).sum() > depth[24, 32:].astype(bool).sum()  # +x is on the left

import itertools

import numpy as np
import pytest

from firefly_sample.frame import OUTPUTS
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer
from tests.scenes import ball, ball_scene, geom_node, orthographic_wall, wall, wall_scene

EVERYTHING = ("albedo", "normal", "normal_world", "depth", "position", "position_world", "id")
POSITIONS = ("linear32f", "depth32f", "depth24")


@pytest.mark.parametrize("position", POSITIONS)
def test_a_wall_has_the_numbers_it_must_have(render, position):
    scene = wall_scene(distance=10.0, color=(0.5, 0.25, 0.04, 1.0))
    scene.camera.set_pos(0, 0, 0)
    frame = render(scene, Settings(position_method=position), (64, 48), EVERYTHING)
    bound = {"linear32f": 4.5e-7, "depth32f": 4.5e-7, "depth24": 1.2e-6 * 10}[position]
    assert np.abs(frame.depth / 10.0 - 1).max() <= bound
    # sqrt8: half a code of the root, doubled by the square
    assert np.abs(frame.albedo - (0.5, 0.25, 0.04)).max() <= 2 * 0.5 / 255
    assert np.abs(frame.normal - (0, -1, 0)).max() <= 6.4e-5
    assert (frame.id == 0).all()
    # the pixel's centre on the film: 60 degrees up and down, 4:3
    half = np.tan(np.radians(30))
    x = ((np.arange(64) + 0.5) / 32 - 1) * half * 4 / 3 * 10
    z = (1 - (np.arange(48) + 0.5) / 24) * half * 10
    assert np.abs(frame.position[..., 0] - x[None]).max() <= 10 * bound + 1e-6
    assert np.abs(frame.position[..., 2] - z[:, None]).max() <= 10 * bound + 1e-6


def test_world_space_outputs_follow_the_camera(render):
    scene = wall_scene(distance=10.0)
    scene.camera.set_pos(0, 20, 0)
    scene.camera.set_hpr(180, 0, 0)
    wall_path = scene.root.find("wall")
    wall_path.set_h(180)
    frame = render(scene, None, (32, 24), EVERYTHING)
    assert np.abs(frame.depth - 10.0).max() < 1e-5
    assert np.abs(frame.position_world[..., 1] - 10.0).max() < 1e-5
    assert np.abs(frame.normal_world - (0, 1, 0)).max() < 1e-4
    assert np.abs(frame.normal - (0, -1, 0)).max() < 1e-4
    # the camera looks back, so world +X is on the left
    assert frame.position_world[0, 0, 0] > 0 > frame.position_world[0, -1, 0]


@pytest.mark.parametrize("position", POSITIONS)
def test_an_orthographic_distance_is_linear(render, position):
    scene = orthographic_wall(distance=10.0)
    scene.root.find("wall").set_p(30)  # leans, so that distance changes over the picture
    frame = render(scene, Settings(position_method=position), (64, 48), EVERYTHING)
    z = (1 - (np.arange(48) + 0.5) / 24) * 6.0
    expected = 10.0 - np.tan(np.radians(30)) * z
    sign = np.sign(frame.depth[0, 0] - frame.depth[-1, 0])
    expected = 10.0 + sign * np.tan(np.radians(30)) * z
    assert np.abs(frame.depth - expected[:, None]).max() <= 100 * 6e-8 * 4
    assert np.abs(frame.position[..., 2] - z[:, None]).max() <= 1e-5


@pytest.mark.parametrize(
    ("position", "lamp", "ambient"),
    [
        # every two of the three meet
        (position, lamp, 0.5 * ((i + j) % 2))
        for i, position in enumerate(POSITIONS)
        for j, lamp in enumerate(("none", "out of view", "black", "in view"))
    ],
)
def test_outputs_two_by_two_are_what_they_are_together(position, lamp, ambient):
    """Whatever else is asked for, and whether or not anything shines."""
    scene = ball_scene(0, ambient=(ambient,) * 3)
    if lamp != "none":
        light = PointLight("lamp", (0.0, 0.0, 0.0) if lamp == "black" else (1, 1, 1), 8.0)
        scene.root.attach_new_node(light).set_pos(0, -50 if lamp == "out of view" else 6, 2)
    sampled = tuple(OUTPUTS)
    with borrow_renderer((16, 12), Settings(position_method=position), reuse=True) as renderer:
        together = renderer.render(scene, 0.0, sampled)
        assert (together.light.max() > 0) == (lamp == "in view" or ambient > 0)
        for pair in itertools.combinations_with_replacement(sampled, 2):
            frame = renderer.render(scene, 0.0, tuple(dict.fromkeys(pair)))
            for name in pair:
                assert np.array_equal(frame[name], together[name], equal_nan=True), pair


def test_where_nothing_is_drawn_every_output_is_its_invalid_value(render):
    scene = Scene(background=(0.25, 0.5, 0.75))
    for outputs in (EVERYTHING, ("depth",), ("position",)):
        frame = render(scene, None, (8, 6), outputs)
        for name in outputs:
            _assert_invalid(name, frame[name])


@pytest.mark.parametrize("position", POSITIONS)
def test_beside_a_ball_every_output_is_its_invalid_value(render, position):
    scene = Scene()
    scene.root.attach_new_node(geom_node("ball", ball())).set_pos(0, 10, 0)
    scene.camera.node().lens = PerspectiveLens(vfov=40, near=1, far=100)
    for outputs in (EVERYTHING, ("depth",), ("id", "depth")):
        frame = render(scene, Settings(position_method=position), (40, 30), outputs)
        if "id" in outputs:
            assert frame.id[15, 20] == 0
        for name in outputs:
            _assert_invalid(name, frame[name][:3])
            assert np.isfinite(frame[name][15, 20]).all()


def _assert_invalid(name, image):
    expected = {"albedo": 0, "normal": 0, "normal_world": 0, "depth": np.inf, "id": -1}.get(name, np.nan)
    assert np.array_equal(image, np.full_like(image, expected), equal_nan=name.startswith("position"))


def test_ids_name_each_instance_also_under_instancing(render):
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(fov=(90, 36.87), near=1, far=100)  # 3:1, 24 wide at 12
    node = geom_node("ball", ball())
    for i, name in enumerate("abc"):
        path = scene.root.attach_new_node(name)
        path.set_pos(8 * i - 8, 12, 0)
        path.attach_new_node(node)
    frame = render(scene, None, (90, 30), ("id",))
    seen = [frame.id[15, x] for x in (15, 45, 75)]
    assert [frame.id_names[i].split("/")[-2] for i in seen] == ["a", "b", "c"]
    assert set(np.unique(frame.id)) == {-1, *seen}


def test_visibility_names_the_triangle_and_the_instance_that_a_ray_meets_first():
    """Every pixel's own triangle holds its ray, and its distance is that of the depth buffer."""
    with borrow_renderer((64, 48)) as renderer:
        plan = renderer.plan(ball_scene(1), 0.0, ("visibility", "depth", "id"))
        frame = renderer.draw(plan)
    instances = [(batch, k) for batch in plan.batches for k in range(len(batch.ids))]
    covered = frame.id >= 0
    assert (frame.visibility[~covered] == -1).all()
    instance, triangle = frame.visibility[covered].T
    assert len(np.unique(instance)) == len(instances) == 4
    assert all(
        instances[i][0].ids[instances[i][1]] == k for i, k in zip(instance, frame.id[covered], strict=True)
    )
    row, column = np.nonzero(covered)
    ndc = (column + 0.5) / 32 - 1, 1 - (row + 0.5) / 24
    ray = plan.view.lens.view_from_distance(*ndc, 1.0)
    for i in range(len(instances)):
        batch, k = instances[i]
        mine = instance == i
        corners = batch.geom.vertices[batch.geom.triangles[triangle[mine]]]
        a, b, c = (corners @ batch.model_to_view[k][:3, :3] + batch.model_to_view[k][3, :3]).swapaxes(0, 1)
        to = ray[mine]
        shares = np.linalg.solve(np.stack([a, b, c], axis=2), to[..., None])[..., 0]  # of each corner
        assert (shares >= -1e-2 * shares.sum(axis=1, keepdims=True)).all()  # pixels are 1/256 off
        np.testing.assert_allclose(1 / shares.sum(axis=1), frame.depth[covered][mine], rtol=2e-5)


def test_single_sided_back_faces_are_culled_and_two_sided_ones_face_the_eye(render):
    for double_sided in (False, True):
        material = Material("card", (1, 1, 1, 1), double_sided=double_sided)
        scene = wall_scene(material=material)
        scene.root.find("wall").set_h(180)
        frame = render(scene, None, (8, 6), ("normal", "id"))
        assert (frame.id == (0 if double_sided else -1)).all()
        if double_sided:
            assert np.abs(frame.normal - (0, -1, 0)).max() < 1e-4


def test_a_mirrored_instance_keeps_its_front(render):
    scene = wall_scene()
    scene.root.find("wall").set_scale(-1, 1, 1)
    frame = render(scene, None, (8, 6), ("normal", "id"))
    assert (frame.id == 0).all()
    assert np.abs(frame.normal - (0, -1, 0)).max() < 1e-4


def test_normals_under_a_stretch_stay_perpendicular(render):
    scene = wall_scene(size=40.0)
    path = scene.root.find("wall")
    path.set_hpr(35, 0, 0)
    holder = scene.root.attach_new_node("stretch")
    holder.set_scale(3, 1, 1)
    path.reparent_to(holder)
    frame = render(scene, None, (16, 12), ("normal", "position"))
    edge_x = frame.position[6, 9] - frame.position[6, 4]
    edge_z = frame.position[9, 6] - frame.position[4, 6]
    normal = frame.normal[6, 6]
    assert abs(normal @ edge_x) <= 2e-4 * np.linalg.norm(edge_x)
    assert abs(normal @ edge_z) <= 2e-4 * np.linalg.norm(edge_z)


def _texture(alpha=255):
    """Red on top, green below; left half with the given alpha."""
    pixels = np.zeros((4, 4, 4), dtype=np.uint8)
    pixels[:2, :, 0], pixels[2:, :, 1] = 255, 255
    pixels[..., 3] = 255
    pixels[:, :2, 3] = alpha
    return Texture(pixels, "flag")


def test_a_texture_stands_upright_and_is_decoded_from_srgb(render):
    grey = np.full((4, 4, 4), 128, dtype=np.uint8)
    grey[..., 3] = 255
    frame = render(
        wall_scene(size=8, material=Material("flag", texture=_texture())), None, (40, 30), ("albedo",)
    )
    assert frame.albedo[10, 20] == pytest.approx((1, 0, 0), abs=1e-6)
    assert frame.albedo[20, 20] == pytest.approx((0, 1, 0), abs=1e-6)
    frame = render(wall_scene(material=Material("grey", texture=Texture(grey))), None, (8, 6), ("albedo",))
    assert np.abs(frame.albedo - 0.2158605).max() <= 2 * 0.5 / 255 * 0.47


@pytest.mark.parametrize("mode", ["opaque", "mask", "blend"])
def test_alpha_cuts_out_where_the_material_says_so(render, mode):
    material = Material("leaf", texture=_texture(alpha=60), alpha_mode=mode, double_sided=True)
    frame = render(wall_scene(size=11.0, material=material), None, (40, 30), ("id",))
    left, right = {"opaque": (0, 0), "mask": (-1, 0), "blend": (-1, -1)}[
        mode
    ]  # data leave out what is blended
    assert (frame.id[15, 8], frame.id[15, 30]) == (left, right)
    assert bool(frame.warnings) == (mode == "blend")
    if mode == "blend":
        assert "leaf" in frame.warnings[0]


def test_vertex_colors_multiply_and_a_nodes_color_replaces_them(render):
    scene = wall_scene(color=(1, 1, 1, 1))
    geom = wall()
    geom.set_colors(np.tile([0.25, 0.5, 1.0], (len(geom.vertices), 1)))
    scene.root.find("wall").remove_node()
    path = scene.root.attach_new_node(geom_node("wall", geom))
    path.set_pos(0, 10, 0)
    assert render(scene, None, (4, 3), ("albedo",)).albedo[1, 1] == pytest.approx((0.25, 0.5, 1), abs=4e-3)
    scene.root.set_color((0.04, 0.09, 0.16, 1))
    assert render(scene, None, (4, 3), ("albedo",)).albedo[1, 1] == pytest.approx(
        (0.04, 0.09, 0.16), abs=2e-3
    )


def test_geometry_behind_is_hidden_whatever_the_order(render):
    scene = wall_scene(distance=10.0)
    front = scene.root.attach_new_node(geom_node("front", wall(2.0)))
    front.set_pos(0, 5, 0)
    for position in POSITIONS:
        frame = render(scene, Settings(position_method=position), (40, 30), ("depth",))
        assert frame.depth[15, 20] == pytest.approx(5)
        assert frame.depth[2, 2] == pytest.approx(10)


def test_culling_leaves_out_only_what_cannot_be_seen(render):
    """Balls all around the camera: the picture is the same as with every one drawn by a giant bound."""
    rng = np.random.default_rng(7)
    scene = Scene()
    node = geom_node("ball", ball(1.0, 1))
    for place in rng.uniform(-20, 20, (200, 3)):
        path = scene.root.attach_new_node("place")
        path.set_pos(*place)
        path.attach_new_node(node)
    scene.camera.node().lens = PerspectiveLens(vfov=50, near=0.5, far=30)
    culled = render(scene, None, (160, 120), ("depth", "id"))
    # one more, far away and tiny, in the same Geom: its bound now reaches everywhere
    geom, material = node.geoms[0]
    vertices = np.concatenate([geom.vertices, [[1e4, 0, 0], [-1e4, 0, 0], [0, 1e4, 0]]])
    normals = np.concatenate([geom.normals, np.eye(3)])
    node.geoms[0] = (Geom(vertices, geom.triangles, normals), material)
    node.mark_changed()
    everything = render(scene, None, (160, 120), ("depth", "id"))
    assert np.array_equal(culled.id, everything.id)
    assert np.array_equal(culled.depth, everything.depth)


@pytest.mark.parametrize("shape", [(3, 5), (320, 480), (1, 7)])
def test_textures_of_any_size_are_drawn(render, shape):
    pixels = np.full((*shape, 4), 255, dtype=np.uint8)
    pixels[..., 1] = 0
    for mode in ("opaque", "mask"):
        material = Material("flag", texture=Texture(pixels), alpha_mode=mode)
        frame = render(wall_scene(size=30, material=material), None, (16, 12), ("albedo",))
        assert frame.albedo == pytest.approx(np.broadcast_to((1.0, 0, 1.0), frame.albedo.shape), abs=1e-6)


@pytest.mark.parametrize("position", POSITIONS)
def test_what_is_covered_does_not_depend_on_what_else_is_asked(render, position):
    """Geometry at the eye's plane (orthographic) and just before the far plane, where depths round away."""
    flat = orthographic_wall(distance=0.0)
    flat.lens.set_near_far(-5.0, 100.0)
    far = wall_scene(distance=100.0 * (1 - 1e-7), size=500.0)
    for scene in (flat, far):
        alone = render(scene, Settings(position_method=position), (16, 12), ("depth",)).depth
        beside = render(
            scene, Settings(position_method=position), (16, 12), ("depth", "color", "id", "normal")
        )
        assert (beside.id == 0).all()
        assert np.array_equal(alone, beside.depth)
        assert np.isfinite(alone).all()
        normal = render(scene, Settings(position_method=position), (16, 12), ("normal",)).normal
        assert np.array_equal(normal, beside.normal)


def test_a_flattened_wall_keeps_its_normal(render):
    scene = wall_scene()
    scene.root.find("wall").set_scale(1, 0, 1)
    frame = render(scene, None, (8, 6), ("normal",))
    assert np.abs(frame.normal - (0, -1, 0)).max() < 1e-4

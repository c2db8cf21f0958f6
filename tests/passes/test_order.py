"""What is drawn, in which order, and what a frame leaves behind."""

import ctypes

import numpy as np
import pytest

from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb
from tests.conftest import borrow_renderer
from tests.scenes import ball, geom_node, wall, wall_scene

POSITIONS = ("linear32f", "depth32f", "depth24")
HALF = np.tan(np.radians(30))


# --- Order ---


def cards(order):
    """Cards at eight distances, opaque and cut out by turns, that hide each other in part."""
    scene = Scene(background=(0.1, 0.1, 0.2))
    scene.camera.node().lens = PerspectiveLens(vfov=60, near=1, far=100)
    pixels = np.full((4, 4, 4), 255, dtype=np.uint8)
    pixels[1:3, 1:3, 3] = 0
    kinds = [{"alpha_mode": "mask", "texture": Texture(pixels)}, {}]
    colors = [(0.1 * i + 0.1, 0.5, 0.9 - 0.1 * i, 1) for i in range(8)]
    materials = [Material(f"m{i}", colors[i], **kinds[i % 2]) for i in range(8)]
    nodes = [geom_node(f"card {i}", wall(4.0), material) for i, material in enumerate(materials)]
    for i in order:
        path = scene.root.attach_new_node(nodes[i])
        path.set_pos(0.7 * i - 2, 5 + 1.5 * i, 0.4 * (i % 3))
    scene.root.attach_new_node(PointLights("l", [(0, 3, 1), (2, 9, -1)], (1, 1, 1), 12.0))
    return scene


def drawn(scene):
    """The first instance of each batch, by its node's name, in drawing order."""
    plan = build_plan(scene, size=(64, 48))
    return [plan.id_names[batch.ids[0]].split("/")[-1] for batch in plan.batches]


ORDERS = [list(range(8)), list(range(8))[::-1], [3, 6, 1, 4, 7, 0, 2, 5]]


@pytest.mark.parametrize("order", ORDERS, ids=["near-first", "far-first", "mixed"])
def test_opaque_batches_come_before_cut_outs_each_front_to_back(order):
    assert drawn(cards(order)) == [f"card {i}" for i in (1, 3, 5, 7, 0, 2, 4, 6)]
    plan = build_plan(cards(order), size=(64, 48))
    assert [batch.surface.cutout for batch in plan.batches] == [False] * 4 + [True] * 4


def test_blend_is_ordered_as_a_cut_out():
    scene = cards([1, 3])
    node = geom_node("glass", wall(4.0), Material("glass", alpha_mode="blend"))
    scene.root.attach_new_node(node).set_pos(0, 3, 0)
    assert drawn(scene) == ["card 1", "card 3", "glass"]


def test_instances_of_a_batch_are_front_to_back_with_their_ids():
    scene = Scene()
    scene.camera.set_h(180)  # front is where the camera looks: -Y
    node = geom_node("ball", ball(1.0, 1), Material("clay"))
    for y in (30, 10, 40, 20, 5):
        path = scene.root.attach_new_node(f"at {y}")
        path.set_pos(0, -y, 0)
        path.attach_new_node(node)
    plan = build_plan(scene)
    (batch,) = plan.batches
    assert batch.model_to_view[:, 3, 1] == pytest.approx([5, 10, 20, 30, 40])
    names = [plan.id_names[i].split("/")[-2] for i in batch.ids]
    assert names == ["at 5", "at 10", "at 20", "at 30", "at 40"]


def test_a_batch_is_ordered_by_its_nearest_instance():
    scene = cards([1])  # at 6.5
    node = geom_node("pair", wall(4.0), Material("pair"))
    for y in (60, 4):
        path = scene.root.attach_new_node(f"at {y}")
        path.set_pos(0, y, 0)
        path.attach_new_node(node)
    assert drawn(scene) == ["pair", "card 1"]


@pytest.mark.parametrize("position", POSITIONS)
def test_the_picture_does_not_depend_on_the_order_of_the_nodes(render, position):
    outputs = ("color", "albedo", "normal", "depth", "id")
    frames = [render(cards(order), Settings(position_method=position), (96, 72), outputs) for order in ORDERS]
    names = [np.array([*frame.id_names, ""])[frame.id] for frame in frames]
    assert len(np.unique(names[0])) >= 8
    for frame, seen in zip(frames[1:], names[1:], strict=True):
        assert np.array_equal(seen, names[0])
        for output in outputs[:-1]:
            assert frame[output].tobytes() == frames[0][output].tobytes()


# --- Culling ---

EDGES = {"left": (-1, 0), "right": (1, 0), "bottom": (0, -1), "top": (0, 1)}


def beyond(edge, outside, distance=10.0, aspect=4 / 3):
    """A point `outside` the view's plane at that edge (along the plane's normal), at that distance."""
    x, z = EDGES[edge]
    slope = HALF * aspect if x else HALF
    reach = slope * distance + outside * np.hypot(1, slope)
    return x * reach, distance, z * reach


def narrow_and_wide(render, attach, output, size=(160, 120)):
    """The picture, and the same pixels cut from a view of twice the width and height."""
    images = []
    for zoom in (1, 2):
        scene = Scene()
        attach(scene.root)
        fov = 2 * np.degrees(np.arctan(zoom * HALF))
        scene.camera.node().lens = PerspectiveLens(vfov=fov, near=1, far=100)
        images.append(render(scene, None, (size[0] * zoom, size[1] * zoom), (output,))[output])
    width, height = size
    return images[0], images[1][height // 2 : height // 2 + height, width // 2 : width // 2 + width]


@pytest.mark.parametrize("outside", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("edge", EDGES)
def test_a_ball_that_reaches_in_is_drawn(render, edge, outside):
    def attach(root):
        root.attach_new_node(geom_node("ball", ball())).set_pos(*beyond(edge, outside))

    ids, expected = narrow_and_wide(render, attach, "id")
    assert (expected == 0).sum() >= 5
    # a silhouette that runs through a pixel's centre may fall either way
    assert (ids != expected).sum() <= 2


@pytest.mark.parametrize("outside", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("edge", EDGES)
def test_a_dot_that_reaches_in_is_drawn(render, edge, outside):
    def attach(root):
        root.attach_new_node(Sprites("dot", [beyond(edge, outside)], (1, 1, 1), 1.0))

    picture, expected = narrow_and_wide(render, attach, "radiance")
    # 0.9 outside along the plane's normal is a little more across the film, on which dots are flat
    assert (expected > 0).any() or outside == 0.9
    assert np.abs(picture - expected).max() <= 1e-5


@pytest.mark.parametrize("edge", EDGES)
def test_a_large_dot_far_outside_reaches_in(render, edge):
    def attach(root):
        root.attach_new_node(Sprites("dot", [beyond(edge, 3.0)], (1, 1, 1), 5.0))

    picture, expected = narrow_and_wide(render, attach, "radiance")
    assert (expected > 0).sum() > 1000
    assert np.abs(picture - expected).max() <= 1e-5


@pytest.mark.parametrize(("y", "seen"), [(0.25, 1.25), (100.75, 99.75)], ids=["near", "far"])
def test_a_ball_across_the_near_or_far_plane_is_drawn(render, y, seen):
    """Its centre is not between the planes; from inside, its far half is seen, else its front."""
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(vfov=1, near=1, far=100)
    material = Material("clay", double_sided=True)
    scene.root.attach_new_node(geom_node("ball", ball(), material)).set_pos(0, y, 0)
    frame = render(scene, None, (17, 17), ("id", "depth"))
    assert frame.id[8, 8] == 0
    assert frame.depth[8, 8] == pytest.approx(seen, abs=0.01)


@pytest.mark.parametrize("hpr", [(0, 0, 0), (0, 0, 40), (30, 10, -65), (-25, 0, 90), (150, 35, 10)])
@pytest.mark.parametrize("scale", [(30, 1, 1), (1, 1, 30), (-30, 1, 1)])
def test_a_long_thin_thing_that_reaches_in_is_drawn(render, hpr, scale):
    """Only its tip is in view; brute force is the same shape with the matrix in its vertices."""
    ids = []
    for baked in (False, True):
        scene = Scene()
        path = scene.root.attach_new_node("needle")
        path.set_hpr(*hpr)
        path.set_scale(*scale)
        matrix = np.array(path.get_mat())
        axis = matrix[int(np.argmax(np.abs(scale)))][:3]
        axis = axis if axis[1] < 0 else -axis  # the centre lies farther away than the tip
        path.set_pos(*((1, 10, 0.5) - axis))
        thing = ball()
        if baked:
            matrix = np.array(path.get_mat())
            triangles = thing.triangles if np.prod(scale) > 0 else thing.triangles[:, ::-1]
            vertices = thing.vertices @ matrix[:3, :3] + matrix[3, :3]
            # one far corner that no triangle uses: its sphere holds everything
            vertices = np.concatenate([vertices, [[1e4, 1e4, 1e4], [-1e4, -1e4, -1e4]]])
            thing, path = Geom(vertices, triangles), scene.root
        path.attach_new_node(geom_node("thing", thing))
        scene.camera.node().lens = PerspectiveLens(vfov=60, near=1, far=100)
        ids.append(render(scene, None, (96, 72), ("id",)).id)
    assert (ids[1] == 0).sum() >= 20
    assert (ids[0] != ids[1]).sum() <= 4


# --- The far plane ---


@pytest.mark.parametrize(("position", "far"), [(p, f) for p in POSITIONS for f in (100.0, 5000.0)])
def test_a_wall_just_before_the_far_plane_is_not_lost(render, position, far):
    """Its depth rounds to the clear value, which less-equal lets through."""
    scene = wall_scene(distance=far * (1 - 1e-7), size=4 * far, near=1.0, far=far)
    assert (render(scene, Settings(position_method=position), (32, 24), ("id",)).id == 0).all()


@pytest.mark.parametrize("distance", [1e6, 1e12, 1e18])
@pytest.mark.parametrize("far", [1e19, np.inf])
def test_reversed_depth_keeps_what_is_very_far(render, distance, far):
    scene = wall_scene(distance=distance, size=4 * distance, near=1.0, far=far)
    frame = render(scene, Settings(position_method="depth32f"), (32, 24), ("id", "depth"))
    assert (frame.id == 0).all()
    assert frame.depth == pytest.approx(distance, rel=1e-5)


# --- What a frame leaves behind ---

STATES = {  # glGet's name: what OpenGL starts with
    0x935D: 0x935E,  # GL_CLIP_DEPTH_MODE: -1..1
    0x0B74: 0x0201,  # GL_DEPTH_FUNC: less
    0x0B46: 0x0901,  # GL_FRONT_FACE: counter-clockwise
    0x0B45: 0x0405,  # GL_CULL_FACE_MODE: back
    0x864F: 0,  # GL_DEPTH_CLAMP
    0x0B71: 0,  # GL_DEPTH_TEST
    0x0B44: 0,  # GL_CULL_FACE
    0x0BE2: 0,  # GL_BLEND
    0x0B72: 1,  # GL_DEPTH_WRITEMASK
}


def _states(device):
    found = {}
    for name in STATES:
        if name == 0x935D and not device.capabilities.clip_control:
            found[name] = STATES[name]
            continue
        value = ctypes.c_int(-1)
        device.raw.call("glGetIntegerv", name, ctypes.byref(value))
        found[name] = value.value
    return found


@pytest.mark.parametrize("position", POSITIONS)
@pytest.mark.parametrize("lights", ["volumes", "fullscreen", "loop"])
@pytest.mark.parametrize("outputs", [("color",), ("depth",)])
def test_a_frame_leaves_the_context_as_opengl_starts_it(position, lights, outputs):
    scene = cards(range(8))
    scene.root.find("card 6").set_scale(-1, 1, 1)  # the last batch is mirrored
    scene.root.attach_new_node(Sprites("dots", [(0, 4, 0)], (1, 1, 1), 1.0))
    with borrow_renderer((32, 24), Settings(position_method=position, light_method=lights)) as renderer:
        renderer.render(scene, 0.0, outputs)
        with renderer._device:
            assert renderer._device.ctx.front_face == "ccw"
            assert {hex(k): hex(v) for k, v in _states(renderer._device).items()} == {
                hex(k): hex(v) for k, v in STATES.items()
            }


# --- The classic look's background ---


@pytest.mark.parametrize("supersample", [1, 2])
@pytest.mark.parametrize("lit", [False, True])
def test_the_classic_background_is_encoded_for_the_display(render, lit, supersample):
    background = (0.02, 0.25, 0.75)
    scene = Scene(background=background)
    scene.camera.node().lens = PerspectiveLens(vfov=60, near=1, far=100)
    if lit:
        scene.root.attach_new_node(geom_node("ball", ball())).set_pos(0, 10, 0)
        scene.root.attach_new_node(PointLights("l", [(0, 7, 0)], (1, 1, 1), 6.0))
    frame = render(scene, Settings(look="classic", supersample=supersample), (32, 24))
    corner = frame.color[:6].reshape(-1, 3)
    assert np.abs(corner - 255 * linear_to_srgb(background)).max() <= 0.51

"""Whole masks: closed forms, and equal to what is drawn of an instance alone."""

import numpy as np
import pytest

from firefly_sample import load_model
from firefly_sample.assets import asset_dir
from firefly_sample.capture.datasets.instances import find_instances, instance_records, owner_image
from firefly_sample.capture.datasets.masks import box_of
from firefly_sample.capture.datasets.silhouettes import draw_silhouettes
from firefly_sample.errors import OutputError
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer
from tests.scenes import ball, geom_node, wall

SIZE = 64, 48


def drawn(scene, time=0.0, size=SIZE, outputs=("id",), settings=None):
    """A frame, its instances and their silhouettes."""
    with borrow_renderer(size, settings) as renderer:
        plan = renderer.plan(scene, time, outputs)
        frame = renderer.draw(plan)
        instances = find_instances(plan)
        return frame, instances, draw_silhouettes(renderer, plan, instances)


def flat_scene():
    """A camera of four pixels a unit."""
    scene = Scene()
    scene.camera.node().lens = OrthographicLens(film_size=(16.0, 12.0), near=1.0, far=100.0)
    return scene


@pytest.mark.parametrize(
    ("x", "z", "size", "box", "pixels", "inside"),
    [
        (0, 0, 5.0, (22, 14, 20, 20), 400, 400),
        (8, 0, 5.0, (54, 14, 20, 20), 400, 200),  # half outside, at the right
        (-8, 6, 5.0, (-10, -10, 20, 20), 400, 100),  # a quarter inside, at the upper left
        (0, -12, 5.0, (22, 62, 20, 20), 400, 0),  # below the picture, where nothing is in view
        (24, 0, 5.0, (118, 14, 10, 20), 200, 0),  # half beyond the canvas
        (40, 0, 5.0, (0, 0, 0, 0), 0, 0),
        (0, 0, 200.0, (-64, -48, 192, 144), 192 * 144, 64 * 48),
    ],
)
def test_a_square_has_the_box_and_the_pixels_that_it_must_have(x, z, size, box, pixels, inside):
    scene = flat_scene()
    scene.root.attach_new_node(geom_node("square", wall(size))).set_pos(x, 10, z)
    frame, instances, (whole,) = drawn(scene)
    assert (whole.box, whole.pixels, whole.in_picture) == (box, pixels, inside)
    assert np.array_equal(whole.mask(), frame["id"] == 0)
    (record,) = instance_records(frame["id"], instances, (whole,))
    assert record["whole"] == {"pixels": pixels, "in_picture": inside, "box": list(box)}
    assert record["visible"]["pixels"] == inside


def test_a_sphere_covers_its_cone_and_is_half_hidden():
    """The rays that meet a sphere are those within asin(radius / distance) of its middle."""
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(vfov=40.0, near=0.5, far=100)
    scene.root.attach_new_node(geom_node("ball", ball(1.5, 5))).set_pos(0, 8, 0)
    scene.root.attach_new_node(geom_node("cover", wall(4.0))).set_pos(-2, 2, 0)  # left of the middle
    frame, instances, (whole, _) = drawn(scene, size=(160, 120))
    v, u = np.mgrid[:120, :160] + 0.5
    slope = np.hypot(u - 80, v - 60) * np.tan(np.radians(20)) / 60
    rim = np.tan(np.arcsin(1.5 / 8))
    doubtful = np.abs(slope / rim - 1) < 0.002  # the mesh is flat between its vertices
    assert doubtful.sum() < 40
    assert np.array_equal(whole.mask()[~doubtful], (slope < rim)[~doubtful])
    assert whole.pixels == whole.mask().sum()
    assert whole.box == box_of(whole.mask())
    record = instance_records(frame["id"], instances, (whole, whole))[0]
    # both are symmetric about the middle, between two columns
    assert record["visible"]["pixels"] * 2 == record["whole"]["pixels"]
    assert record["visible"]["box"][0] == 80


def leaf():
    pixels = np.full((16, 16, 4), 255, dtype=np.uint8)
    pixels[4:12, 3:9, 3] = 0
    return Material("leaf", texture=Texture(pixels), alpha_mode="mask", double_sided=True)


def mixed_scene():
    """Cut-outs, two-sided surfaces, a skin, mirrored, nested and blended ones in front of each other."""
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(vfov=50.0, near=0.5, far=100)
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    things = [
        ("leaf", wall(3.0), leaf(), (-0.5, 5, 0), (160, 0, 0)),
        ("wall", wall(4.0), Material("wall"), (1, 7, 0.5), (20, 0, 0)),
        ("back", wall(4.0), Material("back"), (0, 4, 0), (180, 0, 0)),  # one-sided, and turned away
        ("ball", ball(1.2, 2), Material("clay"), (2.5, 6, -1), (0, 0, 0)),
        ("glass", ball(1.0, 2), Material("glass", (1, 1, 1, 0.5), alpha_mode="blend"), (0, 4, 0), (0, 0, 0)),
    ]
    paths = []
    for name, geom, material, pos, hpr in things:
        path = scene.root.attach_new_node(name)
        path.attach_new_node(geom_node(f"{name} mesh", geom, material)).set_sx(-1 if name == "ball" else 1)
        path.set_pos_hpr(*pos, *hpr)
        paths.append(path)
    walker = scene.root.attach_new_node("walker")
    load_model(asset_dir("models") / "walker.glb").reparent_to(walker)
    walker.set_pos_hpr(-1.2, 4, -1, 60, 0, 0)
    paths.append(walker)
    for path in paths:
        path.set_tag("category", path.get_name())
    return scene, paths


@pytest.mark.parametrize("look", ["correct", "classic"])
def test_a_whole_mask_is_what_is_drawn_of_an_instance_alone(look):
    scene, paths = mixed_scene()
    settings = Settings(look=look)
    frame, instances, whole = drawn(scene, 0.7, settings=settings)
    assert [instance.category for instance in instances] == [path.get_name() for path in paths]
    owners = owner_image(frame["id"], instances)
    counts = {}
    for number, (path, silhouette) in enumerate(zip(paths, whole, strict=True)):
        for other in paths:
            other.show() if other == path else other.hide()
        with borrow_renderer(SIZE, settings) as renderer:
            alone = renderer.render(scene, 0.7, ("id",))["id"] >= 0
        assert np.array_equal(silhouette.mask(), alone)
        assert alone[owners == number].all()
        counts[path.get_name()] = int(alone.sum())
    # two-sided leaves have holes; blended surfaces have ids with the classic look alone
    assert counts.pop("back") == 0
    assert (counts.pop("glass") > 0) == (look == "classic")
    assert min(counts.values()) > 50


def test_parts_that_are_out_of_view_count():
    """Of an instance with one part in the picture and one beside it."""
    scene = flat_scene()
    pair = scene.root.attach_new_node("pair")
    pair.set_tag("category", "pair")
    for x in (0, 12):
        pair.attach_new_node(geom_node("square", wall(5.0))).set_pos(x, 10, 0)
    frame, (instance,), (whole,) = drawn(scene)
    assert instance.ids == (0, 1)
    assert (frame["id"] == 0).sum() == whole.in_picture == 400
    assert (whole.pixels, whole.box) == (800, (22, 14, 68, 20))


def test_geometry_at_the_eye_may_be_anywhere():
    """A ground from behind the eye to the horizon fills the lower half of the canvas."""
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(vfov=90.0, near=0.01, far=1e6)
    scene.root.attach_new_node(geom_node("ground", wall(1000.0))).set_pos_hpr(0, 0, -1, 0, -90, 0)
    _, _, (whole,) = drawn(scene)
    # the far edge, 1 below and 500 ahead, is 0.05 pixels below the horizon
    assert whole.box == (-64, 24, 192, 72)
    assert whole.pixels == 192 * 72
    assert whole.in_picture == 64 * 24


def test_frames_that_are_drawn_between_silhouettes_stay_the_same():
    outputs = ("albedo", "depth", "id")
    times = (0.0, 0.4, 0.8)
    scene, _ = mixed_scene()
    with borrow_renderer(SIZE) as renderer:
        expected = [renderer.render(scene, time, outputs) for time in times]
    scene, _ = mixed_scene()
    with borrow_renderer(SIZE) as renderer:
        renderer.reuse, found, masks = True, [], []
        for time in times:
            plan = renderer.plan(scene, time, outputs)
            found.append(renderer.draw(plan))
            masks.append(draw_silhouettes(renderer, plan, find_instances(plan)))
            again = renderer.draw(plan)  # the geometry pass must not keep what silhouettes have drawn
            assert all(np.array_equal(again[name], found[-1][name]) for name in outputs)
    for one, other in zip(expected, found, strict=True):
        assert all(np.array_equal(one[name], other[name]) for name in outputs)
    assert not np.array_equal(masks[0][-1].mask(), masks[1][-1].mask())  # the walker walks


def test_a_frame_that_is_not_read_back_yet_is_not_touched():
    """`render_many` asks for the next time when a frame is drawn, and before the scene moves on."""
    scene, _ = mixed_scene()
    with borrow_renderer(SIZE) as renderer:
        expected = [renderer.render(scene, time, ("id",))["id"] for time in (0.0, 0.4)]

        def times():
            for time in (0.0, 0.4):
                yield time
                plan = renderer.plan(scene, time, ("id",))
                draw_silhouettes(renderer, plan, find_instances(plan))

        found = [frame["id"] for frame in renderer.render_many(scene, times(), ("id",))]
    assert all(map(np.array_equal, expected, found))


def test_supersampling_is_refused():
    scene = flat_scene()
    with borrow_renderer(SIZE, Settings(supersample=2)) as renderer:
        plan = renderer.plan(scene, 0.0, ("color",))
        with pytest.raises(OutputError, match=r"'id'.*set supersample to 1"):
            draw_silhouettes(renderer, plan, ())

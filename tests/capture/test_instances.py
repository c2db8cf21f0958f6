"""The instances of a frame: how ids are grouped, their poses, visible pixels and records."""

import io
import json
import sys

import numpy as np
import PIL.Image
import pytest
from pycocotools import mask as coco

from firefly_sample.capture.datasets.instances import (
    find_instances,
    instance_records,
    owner_image,
    split_linear,
)
from firefly_sample.capture.datasets.masks import box_of, encode_rle, join_boxes, mask_png
from firefly_sample.errors import MissingPackageError
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.capture.objects import crowd
from tests.conftest import borrow_renderer
from tests.scenes import ball, geom_node, wall

SIZE = 64, 48


def listed(scene):
    plan = build_plan(scene, Settings(), SIZE, ("id",))
    return plan, find_instances(plan)


def grown(scene, text):
    """Nodes by name: each line is a parent, a name, and a tag behind ``=``; balls are those with a ``*``."""
    paths = {"root": scene.root}
    for line in text.split():
        parent, _, name = line.partition(">")
        name, equals, tag = name.partition("=")
        node = geom_node(name, ball(subdivisions=0)) if name.startswith("*") else name
        paths[name] = paths[parent].attach_new_node(node)
        if equals:
            paths[name].set_tag("category", tag)
    return paths


def test_ids_belong_to_the_nearest_tag_above_them():
    scene = Scene()
    grown(
        scene,
        "root>*ground root>car=car car>*body car>wheel=wheel wheel>*tyre wheel>*hub car>*roof root>*cup=",
    )
    plan, instances = listed(scene)
    found = [
        (one.name, one.category, [plan.id_names[number].rpartition("/")[2] for number in one.ids])
        for one in instances
    ]
    assert found == [
        ("root/car", "car", ["*body", "*roof"]),
        ("root/car/wheel", "wheel", ["*tyre", "*hub"]),
        ("root/*cup", "*cup", ["*cup"]),  # an empty tag stands for the name
    ]


def test_a_node_below_two_parents_is_two_instances():
    scene = Scene()
    paths = grown(scene, "root>left root>right left>chair=chair chair>*seat chair>*seat")
    paths["chair"].instance_to(paths["right"])
    paths["right"].set_x(3)
    _, (one, other) = listed(scene)
    assert (one.name, other.name) == ("root/left/chair", "root/right/chair")
    assert (one.ids, other.ids) == ((0, 1), (2, 3))
    assert (other.pose - one.pose).round(12).tolist() == [[0, 0, 0, 3], *np.zeros((3, 4)).tolist()]


def test_without_tags_each_geometry_instance_is_one():
    scene = Scene()
    paths = grown(scene, "root>a a>*cup")
    paths["a"].attach_new_node(geom_node("*cup", ball(subdivisions=0)))
    plan, instances = listed(scene)
    assert [(one.name, one.category, one.ids) for one in instances] == [
        ("root/a/*cup", "*cup", (0,)),
        ("root/a/*cup#2", "*cup", (1,)),
    ]
    assert tuple(one.name for one in instances) == plan.id_names


def test_a_tag_on_a_hidden_node_is_a_tag():
    scene = Scene()
    paths = grown(scene, "root>*ground root>box=box box>*inside")
    paths["box"].hide()
    assert listed(scene)[1] == ()
    paths["*inside"].show_through()
    assert [(one.name, one.ids) for one in listed(scene)[1]] == [("root/box", (1,))]
    paths["box"].clear_tag("category")
    assert len(listed(scene)[1]) == 2


def test_names_with_slashes_do_not_join_instances():
    scene = Scene()
    grown(scene, "root>a a>b=x b>*one root>a/b=x a/b>*two")
    assert [(one.name, one.ids) for one in listed(scene)[1]] == [("root/a/b", (0,)), ("root/a/b", (1,))]


def test_a_pose_is_kept_when_the_scene_changes():
    scene = Scene()
    path = grown(scene, "root>*ball")["*ball"]
    path.set_pos(1, 5, 2)
    _, (one,) = listed(scene)
    path.set_pos(9, 9, 9)
    assert one.pose[:3, 3].tolist() == [1, -2, 5]


def test_poses_and_stretches_lose_nothing():
    rng = np.random.default_rng(5)
    scene = Scene()
    scene.camera.set_pos_hpr(1, 2, 3, 40, 50, 60)
    cases = {
        "plain": (1, 1, 1), "large": (3, 3, 3), "wide": (3, 1, 2), "mirrored": (-2, 2, 2),
        "turned": (-2, -2, -2), "odd": (-1, 2, 3), "flat": (0, 1, 1),
    }  # fmt: skip
    for name, scale in cases.items():
        above = scene.root.attach_new_node("above")
        above.set_pos_hpr(*rng.uniform(-9, 9, 3), *rng.uniform(-180, 180, 3))
        path = above.attach_new_node(geom_node(name, ball(subdivisions=0)))
        path.set_pos_hpr(*rng.uniform(-9, 9, 3), *rng.uniform(-180, 180, 3))
        path.set_scale(*scale)
        if name == "plain":
            above.set_scale(1, 2, 4)  # shears what is turned below it
    _, instances = listed(scene)
    world_to_view = np.linalg.inv(scene.camera.get_net_transform().get_mat())
    world_to_camera = world_to_view[:, [0, 2, 1, 3]] * (1, -1, 1, 1)
    for one in instances:
        rotation, net = one.pose[:3, :3], scene.root.find(f"**/{one.category}").get_net_transform().get_mat()
        assert np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-14
        assert np.linalg.det(rotation) == pytest.approx(1.0)
        assert one.pose[3].tolist() == [0, 0, 0, 1]
        points = rng.uniform(-1, 1, (20, 3))
        expected = (np.column_stack([points, np.ones(20)]) @ net @ world_to_camera)[:, :3]
        assert np.abs(points @ one.stretch.T @ rotation.T + one.pose[:3, 3] - expected).max() < 1e-12
        assert np.array_equal(one.stretch, one.stretch.T)
    assert [one.uniform for one in instances] == [False, True, False, True, True, False, False]
    mean = 6 ** (1 / 3)
    assert [one.scale for one in instances] == pytest.approx([2, 3, mean, -2, -2, -mean, 0], abs=1e-9)


def test_the_rotation_is_the_nearest_one():
    """No turn of it, however small, comes nearer: the polar decomposition is the minimum."""
    rng = np.random.default_rng(3)
    linear = rng.normal(size=(40, 3, 3))
    linear[np.linalg.det(linear) < 0] *= -1.0
    rotation, stretch = split_linear(linear)
    assert np.abs(rotation @ stretch - linear).max() < 1e-13
    assert (np.linalg.eigvalsh(stretch) > 0).all()
    away = np.linalg.norm(rotation - linear, axis=(1, 2))
    for axis in range(3):
        for angle in (1e-3, -1e-3, 2.0):
            turn = np.eye(3)
            one, other = (axis + 1) % 3, (axis + 2) % 3
            turn[[one, other], [one, other]] = np.cos(angle)
            turn[one, other], turn[other, one] = -np.sin(angle), np.sin(angle)
            assert (np.linalg.norm(turn @ rotation - linear, axis=(1, 2)) > away).all()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_poses_lead_to_where_the_output_position_says(seed):
    """Corners that are seen, moved by the pose and projected, lie in pixels whose surface is that near."""
    scene, _, to_pixels = crowd(seed, SIZE, 8)
    for number, path in enumerate(scene.root.find_all_matches("**/thing*")):
        for part in path.get_children():
            part.remove_node()
        path.attach_new_node(geom_node("sheet", wall(1.6), Material("paper", double_sided=True)))
        path.get_parent().set_scale(1 + number % 2)
    with borrow_renderer(SIZE) as renderer:
        plan = renderer.plan(scene, 0.0, ("id", "position"))
        frame = renderer.draw(plan)
    instances = find_instances(plan)
    owners, seen = owner_image(frame["id"], instances), 0
    for number, one in enumerate(instances):
        # each pixel's position is a point of the square, in the square's own space
        mask = owners == number
        points = frame["position"][mask][:, [0, 2, 1]].astype(np.float64) * (1, -1, 1)
        own = (points - one.pose[:3, 3]) @ one.pose[:3, :3] @ np.linalg.inv(one.stretch)
        assert np.abs(own[:, 1]).max(initial=0) < 2e-5
        assert np.abs(own[:, [0, 2]]).max(initial=0) < 0.8 + 2e-5
        # and a point of it is drawn where it is projected
        rows, columns = np.nonzero(mask)
        moved = own @ one.stretch.T @ one.pose[:3, :3].T + one.pose[:3, 3]
        where = to_pixels(moved)
        assert np.abs(where - np.column_stack([columns, rows])).max(initial=0) < 1e-3
        # corners that are in the picture and not hidden end the mask
        corners = np.array([(x, 0, z) for x in (-0.8, 0.8) for z in (-0.8, 0.8)])
        for corner in to_pixels(corners @ one.stretch.T @ one.pose[:3, :3].T + one.pose[:3, 3]):
            column, row = np.round(corner).astype(int)
            near = owners[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3]
            if mask.sum() > 30 and 2 < column < 61 and 2 < row < 45 and set(near.ravel()) <= {-1, number}:
                assert (near == number).any()
                assert (near == -1).any()
                seen += 1
    assert seen >= 4


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools' own
def test_records_are_the_output_id_pixel_for_pixel():
    scene, _, _ = crowd(1, SIZE, 10)
    with borrow_renderer(SIZE) as renderer:
        plan = renderer.plan(scene, 0.0, ("id",))
        ids = renderer.draw(plan)["id"]
    records = instance_records(ids, find_instances(plan), rle=True)
    assert 3 <= len(records) < 10  # some are out of view or hidden
    assert json.loads(json.dumps(records)) == records
    union = np.zeros(ids.shape, dtype=int)
    for record in records:
        mask = coco.decode(record["rle"]).astype(bool)
        assert np.array_equal(mask, np.isin(ids, record["ids"]))
        assert record["visible"]["pixels"] == mask.sum() == coco.area(record["rle"]) > 0
        assert record["visible"]["box"] == coco.toBbox(record["rle"]).tolist()
        assert record["rle"]["size"] == [48, 64]
        assert "whole" not in record
        union += mask
    assert np.array_equal(union, ids >= 0)  # nothing else is in the picture
    smallest = [record["ids"][0] for record in records]
    assert smallest == sorted(smallest)
    assert [("stretch" in record) for record in records] == [
        int(record["name"].rpartition(" ")[2]) % 3 > 0 for record in records
    ]


def test_a_record_without_geometry_in_the_picture_is_left_out():
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(vfov=40)
    ids = np.full((48, 64), -1, dtype=np.int32)
    assert instance_records(ids, listed(scene)[1]) == []


def test_boxes_are_those_of_pycocotools():
    rng = np.random.default_rng(0)
    for share in (0.0, 0.001, 0.01, 0.3, 1.0):
        mask = rng.random((37, 53)) < share
        box = box_of(mask)
        assert list(box) == coco.toBbox(encode_rle(mask)).tolist()
        assert join_boxes(box, box_of(~mask)) == (0, 0, 53, 37) or not mask.any() or mask.all()


def test_a_mask_is_a_grey_png():
    mask = np.random.default_rng(1).random((48, 64)) < 0.5
    with PIL.Image.open(io.BytesIO(mask_png(mask))) as picture:
        assert (picture.format, picture.mode, picture.size) == ("PNG", "L", (64, 48))
        assert np.array_equal(np.asarray(picture), 255 * mask)


def test_without_pycocotools_the_error_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pycocotools.mask", None)
    with pytest.raises(MissingPackageError, match=r"pycocotools.*-m pip install"):
        encode_rle(np.zeros((2, 2), dtype=bool))

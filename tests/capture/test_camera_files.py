"""Points of the world from files alone: a manifest's camera and a depth against `position_world`.

Three cameras see the forest: its own, one off centre, and an orthographic one. The bound is the depth's own
rounding: half a code of a 16-bit PNG, or half a unit in the last place of a float32, along the pixel's ray.
`position_world` is itself rounded to float32.
"""

from __future__ import annotations

import json

import numpy as np
import PIL.Image
import pytest

from firefly_sample.capture.sequence import capture_frames
from firefly_sample.capture.views import parse_views
from firefly_sample.scenes import build_scene, find_scene
from tests.capture.captures import content
from tests.readers import read_bop, read_nerf

SIZE = (64, 48)
SCALE = 0.01
U32 = 1.01 * 2.0**-24
LENSES = (
    {},
    {"fx": 70, "fy": 75, "cx": 20, "cy": 33},
    {"projection": "orthographic", "fx": 2, "fy": 3, "cx": 36, "cy": 20, "near": 0.5, "far": 900},
)
FOREST = {"size": SIZE, "parameters": {"fireflies": 3}, "time": 5.0}


def views_of_the_forest():
    """Views at the place of the forest's camera, through each of the lenses."""
    scene = build_scene(find_scene("forest"), fireflies=3)
    scene.update(5.0)
    matrix = scene.camera.get_net_transform().get_mat()
    pose = {"panda3d": [*matrix.T[:3].tolist(), [0, 0, 0, 1]]}
    size = {"width": SIZE[0], "height": SIZE[1]}
    return [{"camera_to_world": pose, **lens, **(size if lens else {})} for lens in LENSES]


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    path = tmp_path_factory.mktemp("views") / "three.json"
    path.write_text(json.dumps(views_of_the_forest()))
    return str(path)


@pytest.fixture(scope="module", params=["png16", "exr"])
def forest(request, views, tmp_path_factory):
    """A capture of the forest by the three cameras, and the format of its depth."""
    folder = tmp_path_factory.mktemp(request.param)
    scale = SCALE if request.param == "png16" else None
    capture_frames(
        *("forest", folder),
        views=views,
        outputs=("depth", "position_world"),
        formats=f"depth={request.param}",
        depth_scale=scale,
        **FOREST,
    )
    return folder, request.param


def read_array(path):
    with np.load(path) as arrays:
        (array,) = arrays.values()
    return array


def read_depth(folder, manifest, path):
    """A depth image as other programs read it: distances with NaN where nothing is, and their rounding."""
    if path.suffix == ".png":
        with PIL.Image.open(path) as image:
            codes = np.asarray(image).astype(np.float64)
        scale = manifest["depth_scale"]
        return np.where(codes == 0, np.nan, codes * scale), np.full(codes.shape, 0.5 * scale)
    if path.suffix == ".exr":
        import OpenEXR

        with OpenEXR.File(str(path)) as file:
            channels = file.channels()
            depth = np.array(channels["depth.Z" if "depth.Z" in channels else "Z"].pixels)
    assert depth.dtype == np.float32
    return np.where(np.isfinite(depth), depth, np.nan).astype(np.float64), U32 * np.abs(depth)


def rays(camera):
    """Points at distance 0, and what a unit of distance adds to them, in OpenCV's axes of a camera."""
    rows, columns = np.mgrid[: camera["height"], : camera["width"]] + camera["pixel_center"]
    right = (columns - camera["cx"]) / camera["fx"]
    down = (rows - camera["cy"]) / camera["fy"]
    zero, one = np.zeros_like(right), np.ones_like(right)
    if camera["projection"] == "perspective":
        return np.zeros((*right.shape, 3)), np.stack([right, down, one], axis=-1)
    return np.stack([right, down, zero], axis=-1), np.stack([zero, zero, one], axis=-1)


AXES = {"opencv": (0, 1, 2), "opengl": (0, 1, 2), "panda3d": (0, 2, 1)}
SIGNS = {"opencv": (1, 1, 1), "opengl": (1, -1, -1), "panda3d": (1, 1, -1)}


def test_points_of_the_forest_are_position_world(forest):
    folder, kind = forest
    manifest = json.loads((folder / "manifest.json").read_text())
    assert [frame["view"] for frame in manifest["frames"]] == [0, 1, 2]
    assert [frame["camera"]["projection"][0] for frame in manifest["frames"]] == ["p", "p", "o"]
    for frame in manifest["frames"]:
        camera = frame["camera"]
        expected = read_array(folder / frame["files"]["position_world"])
        depth, rounding = read_depth(folder, manifest, folder / frame["files"]["depth"])
        drawn = np.isfinite(depth)
        assert drawn.sum() > 1500
        assert (drawn == np.isfinite(expected).all(axis=-1)).all()
        start, ray = rays(camera)
        eye = np.array(camera["camera_to_world"]["opencv"])[:3, 3]
        bound = (rounding * np.linalg.norm(ray, axis=-1) + rounding_of_points(expected, eye))[drawn]
        for convention in ("opencv", "opengl", "panda3d"):
            axes, signs = list(AXES[convention]), SIGNS[convention]
            points = (start + ray * depth[..., None])[..., axes] * signs
            pose = np.array(camera["camera_to_world"][convention])
            found = points @ pose[:3, :3].T + pose[:3, 3]
            off = np.linalg.norm(found - expected, axis=-1)[drawn]
            assert (off <= bound).all(), (kind, convention)
            if kind == "png16":  # the bound is no larger than it must be
                assert off.max() > 0.4 * SCALE


def rounding_of_points(points, eye):
    """That of a float32 position, and of the float32 depth that it, and a code, was made of."""
    return U32 * (np.linalg.norm(points, axis=-1) + np.linalg.norm(points - eye, axis=-1))


@pytest.mark.parametrize("dataset", ["nerf", "bop"])
def test_points_of_documents_are_position_world(dataset, tmp_path):
    """A lens off centre from two places; a code of depth is a millimetre."""
    lens = {"width": SIZE[0], "height": SIZE[1], "fx": 70, "fy": 75, "cx": 20, "cy": 33}
    poses = [[[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]], [[0.8, -0.6, 0, 3], [0.6, 0.8, 0, 1], [0, 0, 1, 0]]]
    views = {**lens, "views": [{"camera_to_world": {"panda3d": [*pose, [0, 0, 0, 1]]}} for pose in poses]}
    manifest = capture_frames(
        *("tests.capture.scenes:parade", tmp_path),
        dataset=dataset,
        views=parse_views(views),
        size=SIZE,
        time=0.0,
        outputs=("color", "depth", "position_world"),
    )
    assert manifest["depth_scale"] == 0.001
    pictures = {"nerf": read_nerf, "bop": read_bop}[dataset](tmp_path)
    assert len(pictures) == 2
    for picture, frame in zip(pictures, manifest["frames"], strict=True):
        expected = read_array(tmp_path / frame["files"]["position_world"])
        assert picture.path == tmp_path / frame["files"]["color"]
        drawn = np.isfinite(picture.depth)
        assert drawn.sum() > 150
        assert (drawn == np.isfinite(expected).all(axis=-1)).all()
        off = np.linalg.norm(picture.world_points() - expected, axis=-1)[drawn]
        rows, columns = np.indices(drawn.shape) + picture.pixel_center
        pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1)
        length = np.linalg.norm(pixels @ np.linalg.inv(picture.k).T, axis=-1)
        bound = 0.0005 * length + rounding_of_points(expected, picture.camera_to_world[:3, 3])
        assert (off <= bound[drawn]).all()
        assert off.max() > 0.0004


@pytest.mark.parametrize("forest", ["exr"], indirect=True)
def test_the_views_of_a_manifest_give_the_same_pictures(views, forest, tmp_path):
    folder, _ = forest
    again = tmp_path / "again"
    outputs = ("depth", "position_world")
    options = {"outputs": outputs, "formats": "depth=exr", **FOREST}
    capture_frames("forest", again, views=str(folder / "manifest.json"), **options)
    before, now = content(folder), content(again)
    assert before.keys() == now.keys()
    for name in before.keys() - {"manifest.json"}:
        assert before[name] == now[name], name

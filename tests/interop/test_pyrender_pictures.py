"""Our pictures against pyrender's own, of the same scenes: what is covered, and how far away it is.

pyrender reads its depth from a standard 24-bit buffer as float32 and makes 2 n f / (f + n - z (f - n)) of it,
n and f being the planes. Half a step of the buffer, what it is read as, and each rounding of the formula are
worth about 2^-25 y/n of a distance y. These scenes end at y = 20 with n = 1, so that its own error is about
3e-6, far below the 1e-4 that is asked for.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import pyrender
import pytest
import trimesh

from firefly_sample.interop.pyrender import scenes as pyrender_scenes
from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.interop.pyrender.meshes import MeshWriter
from firefly_sample.losses import ConversionWarning
from firefly_sample.scene import transforms
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, Spotlight
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb
from tests.conftest import borrow_renderer
from tests.interop.oracle import LIT, SIZE, Agreement, agreement, undo_perspective
from tests.interop.scenes import random_scene
from tests.scenes import wall_scene

NEAR, FAR = 1.0, 40.0


def perspective(seed: int, far: float = FAR, centred: bool = True) -> PerspectiveLens:
    rng = np.random.default_rng(seed)
    offset = (0.0, 0.0) if centred else tuple(rng.uniform(-0.15, 0.15, 2))
    return PerspectiveLens(
        fov=rng.uniform(35, 70), aspect_ratio=4 / 3, near=NEAR, far=far, film_offset=offset
    )


def orthographic(seed: int, near: float = NEAR) -> OrthographicLens:
    offset = tuple(np.random.default_rng(seed).uniform(-1, 1, 2))
    return OrthographicLens((12, 9), near=near, far=FAR, film_offset=offset)


def assert_all_agree(found: list[Agreement]) -> None:
    """Each picture agrees, and there was something to compare."""
    for seed, each in enumerate(found):
        assert each, f"seed {seed}: {each}"
    assert np.mean([each.covered for each in found]) > 0.1
    assert np.mean([each.compared for each in found]) > 0.65
    assert max(each.differing for each in found) < 1e-3


@pytest.mark.parametrize("centred", [True, False])
@pytest.mark.parametrize("far", [FAR, math.inf])
@pytest.mark.filterwarnings("ignore:off-centre cameras")
def test_perspective_pictures_agree(draw_with_pyrender, renderer, centred, far):
    found = []
    for seed in range(100):
        scene = random_scene(seed, perspective(seed, far, centred))
        ours = renderer.render(scene, 0.0, ("depth",)).depth
        found.append(agreement(ours, draw_with_pyrender(to_pyrender(scene, size=SIZE))[1]))
    assert_all_agree(found)


@pytest.mark.parametrize("near", [NEAR, -5.0])
def test_orthographic_pictures_agree(draw_with_pyrender, renderer, near):
    found = []
    for seed in range(100):
        scene = random_scene(seed, orthographic(seed, near))
        ours = renderer.render(scene, 0.0, ("depth",)).depth
        converted = to_pyrender(scene, size=SIZE)
        camera = converted.main_camera_node.camera
        theirs = undo_perspective(draw_with_pyrender(converted)[1], camera.znear, camera.zfar)
        moved = camera.znear - near
        found.append(agreement(ours, np.where(theirs > 0, theirs - moved, 0.0)))
    assert_all_agree(found)


def test_the_forest_without_its_leaves_agrees(draw_with_pyrender):
    """Near 50, far 500: the buffer is good to 1e-6. The leaves stay away since pyrender cuts nothing out."""
    size = (320, 240)
    scene = build_scene(find_scene("forest"), fireflies=0)
    for path in scene.root.find_all_matches("**"):
        node = path.node()
        if isinstance(node, GeomNode):
            node.geoms = [
                (geom, material) for geom, material in node.geoms if material.alpha_mode == "opaque"
            ]
            node.mark_changed()
    with borrow_renderer(size) as renderer:
        ours = renderer.render(scene, 0.0, ("depth",)).depth
    with pytest.warns(ConversionWarning):
        converted = to_pyrender(scene, size=size)
    found = agreement(ours, draw_with_pyrender(converted, size)[1])
    assert found, found
    assert found.covered > 0.7
    assert found.compared > 0.6
    assert found.differing < 1e-3


def test_pictures_agree_where_a_scene_of_pyrenders_is_converted(draw_with_pyrender, renderer):
    """Instances, mirrored and sheared ones too, below a stretched node; a camera without an aspect ratio."""
    found = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        theirs = pyrender.Scene()
        for shape in (trimesh.creation.icosphere(2), trimesh.creation.box((1.0, 0.6, 1.4))):
            poses = np.tile(np.eye(4), (5, 1, 1))
            poses[:, :3, :3] = rng.normal(size=(5, 3, 3)) * 0.6  # some of these mirror
            poses[:, :3, 3] = rng.uniform(-2, 2, (5, 3))
            pose = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))
            pose[:3, :3] *= rng.uniform(0.6, 1.4, 3) * rng.choice((-1.0, 1.0), 3)
            mesh = pyrender.Mesh.from_trimesh(shape, pyrender.MetallicRoughnessMaterial(), poses=poses)
            theirs.add(mesh, pose=pose)
        pose = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))
        pose[:3, 3] = pose[:3, 2] * 9.0
        theirs.add(pyrender.PerspectiveCamera(rng.uniform(0.5, 1.0), NEAR, FAR), pose=pose)
        ours = renderer.render(from_pyrender(theirs, size=SIZE), 0.0, ("depth",)).depth
        found.append(agreement(ours, draw_with_pyrender(theirs)[1]))
    assert_all_agree(found)


def things(seed: int) -> pyrender.Scene:
    """Boxes and balls about the origin."""
    rng = np.random.default_rng(seed)
    scene = pyrender.Scene()
    for shape in (trimesh.creation.icosphere(2), trimesh.creation.box((1.0, 0.6, 1.4))):
        mesh = pyrender.Mesh.from_trimesh(shape, pyrender.MetallicRoughnessMaterial(metallicFactor=0.0))
        for _ in range(4):
            pose = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))
            pose[:3, 3] = rng.uniform(-2, 2, 3)
            scene.add(mesh, pose=pose)
    return scene


@pytest.mark.parametrize(
    "camera",
    [
        pyrender.PerspectiveCamera(0.7, NEAR, FAR),
        pyrender.PerspectiveCamera(0.7, NEAR),
        pyrender.PerspectiveCamera(0.7, NEAR, FAR, aspectRatio=2.0),
        pyrender.PerspectiveCamera(0.7, NEAR, aspectRatio=0.5),
        pyrender.IntrinsicsCamera(180.0, 180.0, 65.0, 75.0, NEAR, FAR),
        pyrender.IntrinsicsCamera(220.0, 160.0, 80.0, 60.0, NEAR, FAR),
        pyrender.IntrinsicsCamera(150.0, 210.0, 95.0, 45.0, NEAR, FAR),
    ],
    ids=["height", "endless", "wide", "narrow and endless", "off centre", "fx > fy", "fx < fy, off centre"],
)
def test_pyrenders_cameras_see_the_same(draw_with_pyrender, renderer, camera):
    found = []
    for seed in range(10):
        theirs = things(seed)
        pose = trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).uniform(size=3))
        pose[:3, 3] = pose[:3, 2] * 9.0
        theirs.add(camera, pose=pose)
        ours = renderer.render(from_pyrender(theirs, size=SIZE), 0.0, ("depth",)).depth
        found.append(agreement(ours, draw_with_pyrender(theirs)[1]))
    assert_all_agree(found)


def test_an_orthographic_camera_is_as_high_as_pyrenders(draw_with_pyrender, renderer):
    """pyrender takes the viewport's shape for it, whatever its width."""
    found = []
    for seed in range(10):
        theirs = things(seed)
        theirs.add(
            pyrender.OrthographicCamera(2.0, 3.0, NEAR, FAR),
            pose=trimesh.transformations.translation_matrix((0, 0, 9)),
        )
        ours = renderer.render(from_pyrender(theirs, size=SIZE), 0.0, ("depth",)).depth
        depth = undo_perspective(draw_with_pyrender(theirs)[1], NEAR, FAR)
        found.append(agreement(ours, depth))
    assert_all_agree(found)


def draw_windings_as_they_are(monkeypatch):
    mesh = MeshWriter.mesh
    monkeypatch.setattr(
        MeshWriter,
        "mesh",
        lambda self, node, material, overrides, color, wireframe, mirrored, visible: mesh(
            self, node, material, overrides, color, wireframe, False, visible
        ),
    )


def forget_to_transpose(monkeypatch):
    right = transforms.matrix_to_gltf

    def wrong(matrix):
        turned = right(matrix)
        turned[:3, :3] = turned[:3, :3].T
        return turned

    monkeypatch.setattr(pyrender_scenes, "matrix_to_gltf", wrong)


def turn_axes(turn):
    # private, because there is no public function that could turn the axes wrongly
    return lambda monkeypatch: monkeypatch.setattr(transforms, "_FROM_GLTF", turn(transforms._FROM_GLTF))


@pytest.mark.parametrize(
    "spoil",
    [
        pytest.param(turn_axes(np.transpose), id="axes turned the other way"),
        pytest.param(turn_axes(lambda axes: np.eye(4)), id="axes not turned"),
        pytest.param(turn_axes(np.abs), id="axes mirrored"),
        pytest.param(forget_to_transpose, id="matrices not transposed"),
        pytest.param(draw_windings_as_they_are, id="winding of mirrored instances not turned"),
    ],
)
def test_a_wrong_conversion_is_seen(draw_with_pyrender, renderer, monkeypatch, spoil):
    spoil(monkeypatch)
    for seed in range(5):
        scene = random_scene(seed, perspective(seed))
        ours = renderer.render(scene, 0.0, ("depth",)).depth
        assert not agreement(ours, draw_with_pyrender(to_pyrender(scene, size=SIZE))[1]), f"seed {seed}"


@pytest.mark.parametrize(
    "change",
    [
        lambda lens: lens.set_film_offset(-lens.get_film_offset()[0], lens.get_film_offset()[1]),
        lambda lens: lens.set_film_offset(lens.get_film_offset()[0], -lens.get_film_offset()[1]),
        lambda lens: lens.set_focal_length(lens.get_focal_length() * 1.01),
    ],
)
def test_another_lens_is_seen(draw_with_pyrender, renderer, change):
    for seed in range(5):
        scene = random_scene(seed, perspective(seed, centred=False))
        ours = renderer.render(scene, 0.0, ("depth",)).depth
        change(scene.lens)
        assert not agreement(ours, draw_with_pyrender(to_pyrender(scene, size=SIZE))[1]), f"seed {seed}"


def test_without_a_tone_curve_tones_are_pyrenders(draw_with_pyrender):
    """Greys under an ambient light of 1: pyrender shows their linear value to the power 1/2.2.

    We show in sRGB what a smooth surface without metal reflects head-on: 4 %, and of the rest the grey.
    """
    greys = np.array([0.0, 0.002, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0])
    theirs = pyrender.Scene(bg_color=(51 / 255, 128 / 255, 179 / 255, 1.0), ambient_light=(1.0, 1.0, 1.0))
    for index, grey in enumerate(greys):
        card = trimesh.creation.box((0.8, 2.0, 0.1))
        material = pyrender.MetallicRoughnessMaterial(
            baseColorFactor=(grey, grey, grey, 1.0), metallicFactor=0.0, roughnessFactor=1.0
        )
        pose = trimesh.transformations.translation_matrix((index - 3.5, 0.0, 0.0))
        theirs.add(pyrender.Mesh.from_trimesh(card, material), pose=pose)
    theirs.add(
        pyrender.PerspectiveCamera(math.pi / 3, NEAR, FAR),
        pose=trimesh.transformations.translation_matrix((0, 0, 10)),
    )
    color, depth = draw_with_pyrender(theirs, SIZE, LIT)
    with borrow_renderer(SIZE, Settings(tone="none")) as renderer:
        frame = renderer.render(from_pyrender(theirs, size=SIZE), 0.0, ("color", "depth", "id"))
    seen = [(frame.id == index) & (depth > 0) for index in range(len(greys))]
    ours, others = (np.array([np.median(picture[mask]) for mask in seen]) for picture in (frame.color, color))
    assert np.abs(others - 255 * greys ** (1 / 2.2)).max() <= 1
    reflected = 0.04 + 0.96 * greys
    # rounded in the G-buffer and in the picture
    assert np.abs(ours - 255 * linear_to_srgb(reflected)).max() <= 1
    assert np.abs(ours - 255 * reflected ** (1 / 2.2)).max() <= 5  # the curves alone
    np.testing.assert_array_equal(frame.color[0, 0], color[0, 0])
    assert (depth[0, 0], frame.depth[0, 0]) == (0.0, math.inf)


def test_an_emissive_texture_shines_alike(draw_with_pyrender):
    """One that is black but for a label, and one of a single colour."""
    bottle, label = np.zeros((8, 8, 3), np.uint8), np.full((8, 8, 3), (200, 128, 0), np.uint8)
    bottle[0, 0] = 255
    for texture in (bottle, label):
        theirs = pyrender.Scene(ambient_light=(0.1, 0.1, 0.1))
        sphere = trimesh.creation.uv_sphere(1.0)
        sphere.visual = trimesh.visual.TextureVisuals(uv=sphere.vertices[:, :2] / 2 + 0.5)
        material = pyrender.MetallicRoughnessMaterial(
            baseColorFactor=(0.2, 0.2, 0.2, 1.0),
            metallicFactor=0.0,
            emissiveFactor=(1.0, 1.0, 1.0),
            emissiveTexture=texture,
        )
        theirs.add(pyrender.Mesh.from_trimesh(sphere, material), name="bottle")
        theirs.add(
            pyrender.PerspectiveCamera(math.pi / 3, NEAR, FAR),
            pose=trimesh.transformations.translation_matrix((0, 0, 3)),
        )
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            scene = from_pyrender(theirs, size=SIZE)
        assert [str(each.message) for each in caught] == []
        with borrow_renderer(SIZE, Settings(tone="none")) as renderer:
            frame = renderer.render(scene, 0.0, ("radiance", "id"))
        on = frame.id >= 0
        linear = (draw_with_pyrender(theirs, SIZE, LIT)[0] / 255.0) ** 2.2
        np.testing.assert_allclose(frame.radiance[on].mean(axis=0), linear[on].mean(axis=0), atol=0.01)


def lamp(light, attenuation=(0.0, 0.0, 1.0)):
    light.set_attenuation(attenuation)
    return light


def cone(light):
    light.set_cone(20.0, 20.0)
    return light


def sun():
    light = DirectionalLight("sun", (1.0, 0.7, 0.5))
    light.set_direction((0.3, 1.0, -0.4))
    return light


@pytest.mark.parametrize(
    ("light", "least", "most"),
    [
        (lamp(PointLight("lamp", (30.0, 20.0, 10.0))), 0.9, 1.0),
        (lamp(PointLight("lamp", (120.0, 80.0, 40.0)), (0.0, 0.0, 4.0)), 0.9, 1.0),
        (cone(lamp(Spotlight("spot", (60.0, 40.0, 20.0)))), 0.9, 1.0),
        (sun(), 0.9, 1.0),
        (AmbientLight("sky", (1.0, 0.7, 0.5)), 0.98, 1.02),
    ],
    ids=["inverse square", "a quarter of it", "spotlight", "direction", "ambient"],
)
def test_lights_are_as_bright(draw_with_pyrender, renderer, light, least, most):
    """A matt grey wall: pyrender's has a highlight of 4 %, which takes up to 8 % from what the wall reflects.

    Without the pi of the conversion it would be a third as bright. Codes are its linear colour to the 1/2.2.
    """
    scene = wall_scene()
    path = scene.root.attach_new_node(light)
    path.set_pos(1, 4, 2)
    path.set_hpr(10, -5, 0)
    ours = renderer.render(scene, 0.0, ("radiance",)).radiance
    codes = draw_with_pyrender(to_pyrender(scene, size=SIZE), SIZE, LIT)[0]
    theirs = (codes / 255.0) ** 2.2
    clear = (ours.min(axis=-1) > 0.02) & (codes.max(axis=-1) < 255)
    assert clear.mean() > 0.05
    low, high = np.percentile(theirs[clear] / ours[clear], (2, 98))
    assert least < low < high < most
    assert ((theirs.min(axis=-1) > 0.01) == (ours.min(axis=-1) > 0.01)).mean() > 0.97

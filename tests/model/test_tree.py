"""From a file's data to nodes: what they are, where they stand, and what a frame says about them."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from firefly_sample import (
    AmbientLight,
    Camera,
    DirectionalLight,
    GeomNode,
    NodePath,
    OrthographicLens,
    PerspectiveLens,
    PointLight,
    Renderer,
    Scene,
    Settings,
    Spotlight,
    build_plan,
    load_model,
)
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import ModelError
from firefly_sample.model.root import ModelRoot
from tests.model.gltf_files import GltfFile
from tests.model.quads import CORNERS, quad, reflected, shaded

GLASS = {"KHR_materials_transmission": {"transmissionFactor": 1.0}}
LINE = "KHR_materials_transmission is not drawn, of materials:"


def load(file: GltfFile, tmp_path, **options) -> NodePath:
    return load_model(file.write(tmp_path / "model.glb"), **options)


def quads_in(path: NodePath) -> list[np.ndarray]:
    """The corners of the Geoms at and below a path, in its parent's space, in the order of a walk."""
    found = []
    for below in [path, *path.find_all_matches("**/+GeomNode")]:
        for geom, _ in getattr(below.node(), "geoms", ()):
            found.append(np.c_[geom.vertices, np.ones(len(geom.vertices))] @ below.get_mat(path.get_parent()))
    return [corners[:, :3] for corners in found]


def z_up(points: np.ndarray) -> np.ndarray:
    return np.float64(points)[:, [0, 2, 1]] * (1, -1, 1)


def test_the_root_is_named_after_the_file_and_says_what_is_not_drawn(tmp_path):
    root = load(shaded(GltfFile(), extensions=GLASS), tmp_path)
    assert isinstance(root.node(), ModelRoot)
    assert root.get_name() == "model"
    assert root.node().warnings == (f"{LINE} 'paint'",)


def test_nodes_stand_where_the_file_puts_them(tmp_path):
    file = GltfFile()
    mesh = quad(file)
    outer = file.node(name="outer", translation=[1, 2, 3], scale=[2, 2, 2])
    file.node(name="inner", parent=outer, mesh=mesh, rotation=[0, math.sqrt(0.5), 0, math.sqrt(0.5)])
    file.node(name="mirror", parent=outer, mesh=mesh, scale=[-1, 1, 1])
    root = load(file, tmp_path)
    turned = np.stack([CORNERS[:, 2], CORNERS[:, 1], -CORNERS[:, 0]], axis=1)
    expected = [2 * points + (1, 2, 3) for points in (turned, CORNERS * (-1, 1, 1))]
    for found, wanted in zip(quads_in(root), expected, strict=True):
        np.testing.assert_allclose(found, z_up(wanted), atol=1e-12)
    geoms = [path.node().geoms[0][0] for path in root.find_all_matches("outer/*")]
    assert geoms[0] is geoms[1]


def test_instances_are_children(tmp_path):
    moves = np.float32([[0, 0, 0], [5, 0, 0], [0, 7, 0]])
    file = GltfFile()
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": file.accessor(moves)}}}
    file.node(name="herd", mesh=quad(file), extensions=extension, scale=[2, 2, 2])
    root = load(file, tmp_path)
    herd = root.find("herd")
    assert [path.get_name() for path in herd.get_children()] == ["herd 0", "herd 1", "herd 2"]
    for found, move in zip(quads_in(root), moves, strict=True):
        np.testing.assert_allclose(found, z_up(2 * (CORNERS + move)), atol=1e-12)
    assert len({id(path.node().geoms[0][0]) for path in herd.get_children()}) == 1


def test_instances_of_a_morphed_mesh_share_its_pose(tmp_path):
    file = GltfFile()
    moves = np.float32([[0, 0, 0], [5, 0, 0]])
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": file.accessor(moves)}}}
    lifted = np.float32([[0, 0, 1]] * 4)
    file.node(mesh=quad(file, targets=[{"POSITION": lifted}]), weights=[0.5], extensions=extension)
    for found, move in zip(quads_in(load(file, tmp_path)), moves, strict=True):
        np.testing.assert_allclose(found, z_up(CORNERS + 0.5 * lifted + move), atol=1e-12)


def test_a_skinned_mesh_follows_its_joints_and_not_its_node(tmp_path):
    file = GltfFile()
    joint = file.node(name="joint", translation=[0, 3, 0])
    everything = {"JOINTS_0": np.zeros((4, 4), np.uint8), "WEIGHTS_0": np.float32([[1, 0, 0, 0]] * 4)}
    file.node(
        name="body", mesh=quad(file, **everything), skin=file.add("skins", joints=[joint]), scale=[9, 9, 9]
    )
    (found,) = quads_in(load(file, tmp_path))
    np.testing.assert_allclose(found, z_up(CORNERS + np.array([0, 3, 0])), atol=1e-12)


def test_cameras_look_where_the_file_says_through_its_lens(tmp_path):
    file = GltfFile()
    lens = {"yfov": math.radians(40), "znear": 0.5, "aspectRatio": 2.0}
    file.add("cameras", type="perspective", perspective=lens)
    file.add("cameras", type="orthographic", orthographic={"xmag": 2, "ymag": 3, "znear": 0, "zfar": 8})
    # it looks along -Z of the file, up is Y: along +Y here, up is Z
    file.node(name="eye", camera=0, translation=[0, 0, 5])
    file.node(name="flat", camera=1)
    root = load(file, tmp_path)
    eye, flat = root.find("eye"), root.find("flat")
    assert isinstance(eye.node(), Camera)
    assert tuple(eye.get_pos(root)) == (0.0, -5.0, 0.0)
    assert isinstance(eye.node().lens, PerspectiveLens)
    fitted = eye.node().lens.for_picture(300, 100)  # a picture of another shape keeps the height of view
    assert fitted.get_vfov() == pytest.approx(40.0)
    assert (fitted.get_aspect_ratio(), fitted.get_near(), fitted.get_far()) == (3.0, 0.5, math.inf)
    assert isinstance(flat.node().lens, OrthographicLens)
    np.testing.assert_allclose(flat.node().lens.for_picture(200, 300).get_film_size(), (4.0, 6.0), rtol=1e-12)


def test_a_mesh_below_a_camera_and_beside_one_is_drawn(tmp_path):
    file = GltfFile()
    file.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1}, name="lens")
    mesh = quad(file)
    head = file.node(name="head", camera=0, mesh=mesh)
    file.node(name="lamp", parent=head, mesh=mesh)
    root = load(file, tmp_path)
    assert len(quads_in(root)) == 2
    assert isinstance(root.find("head").node(), GeomNode)
    assert isinstance(root.find("head/lens").node(), Camera)
    assert root.find("head/lamp")


def test_lights_have_the_units_of_the_file(tmp_path):
    """A white diffuse surface reflects 1/pi of what arrives in glTF, and all of it here."""
    lights = [
        {"type": "point", "color": [1, 0.5, 0.25], "intensity": 20, "range": 7},
        {"type": "spot", "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}, "intensity": 2},
        {"type": "directional", "intensity": 3},
    ]
    file = GltfFile()
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    for index, name in enumerate(("lamp", "spot", "sun")):
        file.node(name=name, extensions={"KHR_lights_punctual": {"light": index}})
    root = load(file, tmp_path)
    lamp, spot, sun = (root.find(name).node() for name in ("lamp", "spot", "sun"))
    assert (type(lamp), type(spot), type(sun)) == (PointLight, Spotlight, DirectionalLight)
    np.testing.assert_allclose(lamp.get_color(), np.array([1, 0.5, 0.25]) * 20 / np.pi, rtol=1e-15)
    np.testing.assert_allclose(spot.get_color(), [2 / np.pi] * 3, rtol=1e-15)
    np.testing.assert_allclose(sun.get_color(), [3 / np.pi] * 3, rtol=1e-15)
    assert lamp.get_attenuation() == spot.get_attenuation() == (0.0, 0.0, 1.0)
    assert (lamp.get_max_distance(), spot.get_max_distance()) == (7.0, math.inf)
    np.testing.assert_allclose(spot.get_cone()[:2], np.degrees([0.25, 0.5]), rtol=1e-15)


def test_a_light_of_the_file_gives_the_radiance_of_the_specification(tmp_path):
    """Half a metre above a quad without metal, at the middle: as in glTF's appendix B.3."""
    file = shaded(
        GltfFile(), pbrMetallicRoughness={"metallicFactor": 0, "baseColorFactor": [0.5, 0.25, 1, 1]}
    )
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 2}]}}
    file.node(translation=[0, 0, 0.5], extensions={"KHR_lights_punctual": {"light": 0}})
    frame = drawn(load(file, tmp_path), outputs=("radiance",))
    expected = reflected([0.5, 0.25, 1.0], 2 / 0.25, 1.0)
    np.testing.assert_allclose(frame.radiance[16, 16], expected, rtol=1e-5)


def drawn(root: NodePath, outputs=("albedo",), settings: Settings | None = None):
    """A frame of 33x33 pixels of a model, which the quad fills."""
    scene = Scene()
    root.reparent_to(scene.root)
    scene.camera.set_pos(0, -10, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(2, 2), near=1, far=20)
    settings = settings or Settings(albedo_format="rgba32f", normal_format="rgba32f")
    with Renderer((33, 33), settings) as renderer:
        return renderer.render(scene, outputs=outputs)


def test_a_frame_repeats_what_is_not_drawn_once_for_each_line(tmp_path):
    path = shaded(GltfFile(), extensions=GLASS).write(tmp_path / "lamp.glb")
    scene = Scene()
    scene.root.attach_new_node(AmbientLight("sky"))
    models = [load_model(path) for _ in range(2)]
    for model in models:
        model.reparent_to(scene.root)
    line = f"model 'lamp': {LINE} 'paint'"
    said = build_plan(scene, Settings(), (8, 8)).warnings
    assert [each for each in said if "lamp" in each] == [line]
    models[0].hide()
    models[1].remove_node()
    assert line not in build_plan(scene, Settings(), (8, 8)).warnings


def test_5000_nested_nodes(tmp_path, monkeypatch):
    """In a chain: nothing recurses, and no node is told of each one that is added below it."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    file, above = GltfFile(), None
    for number in range(5000):
        above = file.node(name=f"n{number}", translation=[0.001, 0, 0], parent=above)
    file.node(name="sheet", parent=above, mesh=quad(file))
    path = file.write(tmp_path / "deep.glb")
    for _ in range(2):  # the second one is kept
        root = load_model(path)
        assert root.node().subtree_revision < 10
    low, high = root.get_tight_bounds()
    np.testing.assert_allclose([low, high], [(4, 0, -1), (6, 0, 1)], atol=1e-9)
    assert root.find("**/sheet")
    assert root.copy_to(NodePath("elsewhere")).node().subtree_revision < 10
    for copied in (copy.deepcopy(root), root.copy_to(NodePath("elsewhere"))):
        np.testing.assert_allclose(copied.get_tight_bounds()[0], low, atol=1e-9)
    root.set_pos(-5, 0, 0)
    assert (drawn(root, outputs=("id",)).id >= 0).all()


@pytest.mark.parametrize("scene", ["night", 1])
def test_a_scene_of_the_file_is_chosen(tmp_path, monkeypatch, scene):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    file = GltfFile()
    file.add("nodes", name="one")
    file.add("nodes", name="two")
    file.json["scenes"] = [{"nodes": [0], "name": "day"}, {"nodes": [1], "name": "night"}]
    assert [path.get_name() for path in load(file, tmp_path).get_children()] == ["one"]
    assert [path.get_name() for path in load(file, tmp_path, scene=scene).get_children()] == ["two"]


def test_numbers_that_a_node_refuses_name_the_file(tmp_path):
    file = GltfFile()
    file.json["extensions"] = {
        "KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 1e300, "name": "star"}]}
    }
    file.node(name="", extensions={"KHR_lights_punctual": {"light": 0}})
    with pytest.raises(ModelError, match=r"model\.glb: light 'node 0': color must be"):
        load(file, tmp_path)


def test_scales_that_multiply_beyond_float64_are_an_error_of_the_file(tmp_path):
    file, above = GltfFile(), None
    for number in range(4):
        above = file.node(name=f"n{number}", scale=[1e100] * 3, parent=above)
    with pytest.raises(
        ModelError, match=r"model\.glb: node 'n3': its transform to the root has numbers that"
    ):
        load(file, tmp_path)

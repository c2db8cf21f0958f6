"""From glTF files to the numbers of a frame: attributes, textures, alpha, sides, lights and cameras."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from firefly_sample import OrthographicLens, Renderer, Scene, Settings, load_model
from tests.conftest import make_renderer
from tests.model.gltf_files import COMPONENT_TYPES, GltfFile
from tests.model.quads import CORNERS, NORMALS, TRIANGLES, UVS, picture, quad, reflected

SIZE = 33
MIDDLE = SIZE // 2
TEXELS = np.uint8([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]])
COLORS = TEXELS.reshape(4, 3) / 255.0
"""Of the upper left, upper right, lower left and lower right quarter."""
NEAREST = {"magFilter": 9728, "minFilter": 9728}
MATT = {"metallicFactor": 0}
LIGHTS = "KHR_lights_punctual"


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    settings = Settings(albedo_format="rgba32f", normal_format="rgba32f", range_falloff="gltf")
    with make_renderer((SIZE, SIZE), settings) as made:
        yield made


@pytest.fixture
def draw(renderer, tmp_path):
    """``draw(file, ...)`` gives a frame of a file, whose quad fills it; `behind`: from its other side."""

    def drawn(file: GltfFile, *outputs: str, behind=False, camera=None, width=2.0, time=0.0):
        root = load_model(file.write(tmp_path / "model.glb"))
        scene = Scene()
        root.reparent_to(scene.root)
        if camera is not None:
            scene.camera = root.find(f"**/{camera}")
        else:
            scene.camera.set_pos(0, 10 if behind else -10, 0)
            scene.camera.set_hpr(180 if behind else 0, 0, 0)
            scene.camera.node().lens = OrthographicLens(film_size=(width, width), near=1, far=20)
        return renderer.render(scene, time, outputs or ("albedo", "normal_world", "position_world", "id"))

    return drawn


def painted(file: GltfFile, **material) -> int:
    return file.add("materials", **{"pbrMetallicRoughness": MATT, **material})


def textured(file: GltfFile, texture: int, **info) -> int:
    return painted(file, pbrMetallicRoughness={**MATT, "baseColorTexture": {"index": texture, **info}})


def quarters(image: np.ndarray) -> np.ndarray:
    """The pixels in the middle of the quarters of a picture."""
    near, far = SIZE // 4, SIZE - 1 - SIZE // 4
    return np.array([image[near, near], image[near, far], image[far, near], image[far, far]])


def stored(values, kind: str, normalized: bool) -> np.ndarray:
    """Values of 0 to 1 in a type."""
    if kind == "f4":
        return np.float32(values)
    most = np.iinfo(kind).max if normalized else 1
    return np.round(np.asarray(values) * most).astype(kind)


def interleaved(file: GltfFile, **attributes: tuple[np.ndarray, bool]) -> dict[str, int]:
    """Add arrays, and whether they are normalised, in one view, each element at a multiple of four bytes."""
    parts = {name: array.view(np.uint8).reshape(4, -1) for name, (array, _) in attributes.items()}
    rows, offsets = np.zeros((4, 0), np.uint8), {}
    for name, part in parts.items():
        offsets[name] = rows.shape[1]
        rows = np.hstack([rows, part, np.zeros((4, -part.shape[1] % 4), np.uint8)])
    view = file.view(rows.tobytes(), byteStride=rows.shape[1])
    return {
        name: file.add(
            "accessors",
            bufferView=view,
            byteOffset=offsets[name],
            componentType=COMPONENT_TYPES[array.dtype.str[1:]],
            count=4,
            type=f"VEC{array.shape[1]}",
            normalized=normalized,
        )
        for name, (array, normalized) in attributes.items()
    }


POSITION_TYPES = ["f4", "i1", "u1 normalized", "i2 normalized", "u2", "i1 normalized", "u2 normalized"]
TEXCOORD_TYPES = ["f4", "u1 normalized", "u2 normalized", "i1", "u2", "i2 normalized", "i1 normalized"]
COLOR_TYPES = [("f4", 3), ("u1", 4), ("u2", 3), ("f4", 4), ("u1", 3), ("u2", 4), ("f4", 3)]
NORMAL_TYPES = ["f4", "i1", "i2", "f4", "i1", "i2", "i1"]


@pytest.mark.parametrize("shift", range(3))
@pytest.mark.parametrize("row", range(7))
def test_interleaved_attributes_of_every_type(draw, row, shift):
    """The seven types of each attribute meet in three ways."""
    kind, _, normalized = POSITION_TYPES[row].partition(" ")
    uv_kind, _, uv_normalized = TEXCOORD_TYPES[(row + shift) % 7].partition(" ")
    color_kind, width = COLOR_TYPES[(row + 2 * shift) % 7]
    normal_kind = NORMAL_TYPES[(row + 3 * shift) % 7]
    file = GltfFile()
    corners = (CORNERS + np.float32([1, 1, 0])) / 2
    attributes = interleaved(
        file,
        POSITION=(stored(corners, kind, bool(normalized)), bool(normalized)),
        NORMAL=(stored(NORMALS, normal_kind, True), normal_kind != "f4"),
        TEXCOORD_0=(stored(UVS, uv_kind, bool(uv_normalized)), bool(uv_normalized)),
        COLOR_0=(stored([[0.2, 0.4, 0.6, 1.0][:width]] * 4, color_kind, True), color_kind != "f4"),
    )
    material = textured(file, picture(file, TEXELS, **NEAREST))
    mesh = file.mesh(indices=TRIANGLES.ravel(), material=material, **attributes)
    file.node(mesh=mesh, translation=[-1, -1, 0], scale=[2, 2, 2])
    frame = draw(file)
    np.testing.assert_allclose(quarters(frame.albedo), COLORS * (0.2, 0.4, 0.6), atol=4e-3)
    np.testing.assert_allclose(frame.normal_world[MIDDLE, MIDDLE], (0, -1, 0), atol=1e-6)
    np.testing.assert_allclose(frame.position_world[0, 0, ::2], (1 / SIZE - 1, 1 - 1 / SIZE), atol=1e-5)


def test_one_image_with_two_samplers(draw):
    """Texture coordinates beyond the image: one material repeats it, the other continues its edge."""
    file = GltfFile()
    repeated = picture(file, TEXELS, **NEAREST)
    clamped = file.add("textures", source=0, sampler=file.add("samplers", wrapS=33071, **NEAREST))
    for x, texture in ((-1, repeated), (1, clamped)):
        mesh = quad(file, TEXCOORD_0=UVS + np.float32([1, 0]), material=textured(file, texture))
        file.node(mesh=mesh, translation=[x, 0, 0])
    frame = draw(file, "albedo", width=4.0)
    rows, columns = np.array([12, 20]), np.array([4, 12, 20, 28])  # two texels each
    expected = COLORS[[[0, 1, 1, 1], [2, 3, 3, 3]]]
    np.testing.assert_allclose(frame.albedo[rows[:, None], columns], expected, atol=1e-6)


def test_an_emission_texture_with_texture_coordinates_of_its_own(draw):
    """The second set is the first, turned by a quarter; its transform moves it by half of the picture."""
    file = GltfFile()
    texture = picture(file, TEXELS, **NEAREST)
    moved = {"KHR_texture_transform": {"offset": [0.5, 0], "texCoord": 1}}
    material = textured(file, texture)
    file.json["materials"][material] |= {
        "emissiveTexture": {"index": texture, "extensions": moved},
        "emissiveFactor": [1, 1, 0.5],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
    }
    file.node(mesh=quad(file, TEXCOORD_1=UVS[[1, 2, 3, 0]], material=material))
    frame = draw(file, "albedo", "emission")
    np.testing.assert_allclose(quarters(frame.albedo), COLORS, atol=1e-6)
    turned = [2, 0, 3, 1]  # the upper left corner has the coordinates (0, 1), those of the lower left texel
    moved_right = [1, 0, 3, 2]
    texels = [moved_right[texel] for texel in turned]
    np.testing.assert_allclose(quarters(frame.emission), COLORS[texels] * (4, 4, 2), rtol=1e-3)


def test_a_texture_may_use_the_second_texture_coordinates_where_the_first_are_missing(draw):
    file = GltfFile()
    material = textured(file, picture(file, TEXELS, **NEAREST), texCoord=1)
    given = {"POSITION": CORNERS, "NORMAL": NORMALS, "TEXCOORD_1": UVS, "indices": TRIANGLES.ravel()}
    file.node(mesh=file.mesh(material=material, **given))
    frame = draw(file)
    np.testing.assert_allclose(quarters(frame.albedo), COLORS, atol=1e-6)
    assert not any("texture" in line for line in frame.warnings)


@pytest.mark.parametrize("factor", [1.0, 0.5, 0.0])
@pytest.mark.parametrize("cutoff", [None, 0.0, 0.1, 100 / 255, 0.5, 1.0, 1.1])
def test_alpha_below_the_cutoff_is_cut_out(draw, cutoff, factor):
    """Half of the quads have a vertex alpha of 0.5."""
    codes = np.array([0, 100, 128, 255])
    texels = np.full((4, 4), 255, np.uint8)
    texels[:, 3] = codes
    file = GltfFile()
    texture = picture(file, texels.reshape(2, 2, 4), **NEAREST)
    surface = {**MATT, "baseColorFactor": [1, 1, 1, factor], "baseColorTexture": {"index": texture}}
    given = {} if cutoff is None else {"alphaCutoff": cutoff}
    material = painted(file, alphaMode="MASK", pbrMetallicRoughness=surface, **given)
    file.node(mesh=quad(file, material=material))
    colors = np.float32([[1, 1, 1, 0.5]] * 4)
    file.node(mesh=quad(file, material=material, COLOR_0=colors), translation=[0, 0, -1])
    found = quarters(draw(file, "id").id)
    limit = 0.5 if cutoff is None else cutoff
    front, back = codes / 255 * factor >= limit, codes / 255 * factor * 0.5 >= limit
    np.testing.assert_array_equal(found >= 0, front | back)
    np.testing.assert_array_equal(found == 0, front)


def test_alpha_of_opaque_materials_does_not_matter(draw):
    file = GltfFile()
    file.node(mesh=quad(file, material=painted(file), COLOR_0=np.float32([[1, 0.5, 0, 0]] * 4)))
    np.testing.assert_allclose(draw(file).albedo[MIDDLE, MIDDLE], (1, 0.5, 0), atol=1e-6)


def test_the_default_material_beside_another(draw):
    file = GltfFile()
    red = painted(file, pbrMetallicRoughness={**MATT, "baseColorFactor": [1, 0, 0, 1]})
    halves = [CORNERS * np.float32([0.5, 1, 1]) + np.float32([x, 0, 0]) for x in (-0.5, 0.5)]
    left = file.primitive(POSITION=halves[0], indices=TRIANGLES.ravel(), material=red)
    right = file.primitive(POSITION=halves[1], indices=TRIANGLES.ravel())
    file.node(mesh=file.mesh(left, right))
    albedo = draw(file).albedo
    np.testing.assert_allclose(quarters(albedo), [(1, 0, 0), (1, 1, 1)] * 2, atol=1e-6)


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("sides", [1, 2])
def test_a_mirrored_node_shows_its_front(draw, sides, flat):
    file = GltfFile()
    given = {"POSITION": CORNERS, "indices": TRIANGLES.ravel()} | ({} if flat else {"NORMAL": NORMALS})
    file.node(mesh=file.mesh(material=painted(file, doubleSided=sides == 2), **given), scale=[-1, 1, 1])
    front, back = draw(file), draw(file, behind=True)
    assert (front.id >= 0).all()
    np.testing.assert_allclose(front.normal_world[MIDDLE, MIDDLE], (0, -1, 0), atol=1e-6)
    assert (back.id >= 0).all() == (sides == 2)
    if sides == 2:
        np.testing.assert_allclose(back.normal_world[MIDDLE, MIDDLE], (0, 1, 0), atol=1e-6)


def test_instances_below_a_mirrored_node_show_their_fronts(draw):
    file = GltfFile()
    moves, scales = np.float32([[-1, 0, 0], [1, 0, 0]]), np.float32([[1, 1, 1], [-1, 1, 1]])
    attributes = {"TRANSLATION": file.accessor(moves), "SCALE": file.accessor(scales)}
    extensions = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    file.node(mesh=quad(file, material=painted(file)), extensions=extensions, scale=[-1, 1, 1])
    frame = draw(file, "id", "normal_world", width=4.0)
    row = frame.id[MIDDLE]
    assert (row >= 0).all()
    assert row[0] != row[-1]
    np.testing.assert_allclose(frame.normal_world[MIDDLE], [(0, -1, 0)] * SIZE, atol=1e-6)


def lit(file: GltfFile, light: dict, **node) -> GltfFile:
    """A matt white quad, and a light."""
    file.json["extensions"] = {LIGHTS: {"lights": [light]}}
    file.node(name="lamp", extensions={LIGHTS: {"light": 0}}, **node)
    file.node(mesh=quad(file, material=painted(file)))
    return file


@pytest.mark.parametrize("scale", [[1, 1, 1], [3, 3, 3], [0.1, 5, 2], [-2, 2, 2]])
@pytest.mark.parametrize("kind", ["point", "spot", "directional"])
def test_a_matt_surface_has_the_radiance_of_the_specification(draw, kind, scale):
    """Candela over the distance squared, or lux, as glTF's appendix B reflects it; scale does not count."""
    angle, distance = 0.4, 2.0
    place = [distance * math.sin(angle), 0, distance * math.cos(angle)]
    turn = [0, math.sin(angle / 2), 0, math.cos(angle / 2)]
    light = {"type": kind, "intensity": 7, "color": [1, 0.5, 0.25]}
    if kind == "spot":
        light["spot"] = {"innerConeAngle": 0.3, "outerConeAngle": 0.6}
    file = lit(GltfFile(), light, translation=place, rotation=turn, scale=scale)
    arriving = 7.0 if kind == "directional" else 7.0 / distance**2
    expected = reflected(1.0, np.array([1, 0.5, 0.25]) * arriving, math.cos(angle))
    radiance = draw(file, "radiance").radiance
    np.testing.assert_allclose(radiance[MIDDLE, MIDDLE], expected, rtol=1e-5)


def test_a_range_ends_as_the_specification_recommends(draw):
    light = {"type": "point", "intensity": 7, "range": 3}
    file = lit(GltfFile(), light, translation=[0, 0, 2], scale=[2, 2, 2])
    expected = reflected(1.0, 7 / 4 * (1 - (2 / 3) ** 4), 1.0)
    np.testing.assert_allclose(draw(file, "radiance").radiance[MIDDLE, MIDDLE], [expected] * 3, rtol=1e-5)


def test_the_edge_of_a_spotlight_differs_from_the_recommended_one_by_what_the_documents_say(draw):
    inner, outer = 0.2, 0.7
    cone = {"innerConeAngle": inner, "outerConeAngle": outer}
    frame = draw(
        lit(GltfFile(), {"type": "spot", "intensity": 7, "spot": cone}, translation=[0, 0, 1]),
        "radiance",
        "position_world",
    )
    x = frame.position_world[MIDDLE, :, 0].astype(float)
    cosine = 1 / np.sqrt(1 + x * x)
    t = np.clip((cosine - math.cos(outer)) / (math.cos(inner) - math.cos(outer)), 0, 1)
    strength = frame.radiance[MIDDLE, :, 0] / reflected(1.0, 7 * cosine**2, cosine)
    np.testing.assert_allclose(strength, t * t * (3 - 2 * t), atol=1e-3)
    assert 0.25 < np.abs(strength - t * t).max() < 0.30


@pytest.mark.parametrize("scale", [[1, 1, 1], [2, 2, 2], [0.5, 3, 1]])
@pytest.mark.parametrize("camera", ["perspective", "orthographic"])
def test_cameras_show_their_height_whatever_their_scale(draw, camera, scale):
    lenses = {
        "perspective": {"yfov": 2 * math.atan(0.2), "znear": 0.1},
        "orthographic": {"xmag": 4, "ymag": -1, "znear": 0, "zfar": 50},
    }
    file = GltfFile()
    file.add("cameras", type=camera, name="lens", **{camera: lenses[camera]})
    file.node(name="eye", camera=0, translation=[0, 0, 5], scale=scale)
    file.node(mesh=quad(file))
    corner = draw(file, "position_world", camera="eye").position_world[0, 0]
    np.testing.assert_allclose(corner, (1 / SIZE - 1, 0, 1 - 1 / SIZE), atol=1e-4)


def test_cameras_and_lights_move_with_their_nodes(draw):
    file = lit(GltfFile(), {"type": "point", "intensity": 1})
    file.add("cameras", type="perspective", perspective={"yfov": 1.0, "znear": 0.1})
    file.node(name="eye", camera=0)
    times = file.accessor(np.float32([0, 1]))
    courses = {2: [[0, 0, 5], [0, 0, 7]], 0: [[0, 0, 1], [0, 0, 2]]}
    samplers = [{"input": times, "output": file.accessor(np.float32(course))} for course in courses.values()]
    channels = [
        {"sampler": number, "target": {"node": node, "path": "translation"}}
        for number, node in enumerate(courses)
    ]
    file.add("animations", samplers=samplers, channels=channels)
    frame = draw(file, "depth", "radiance", camera="eye", time=0.5)
    assert frame.depth[MIDDLE, MIDDLE] == pytest.approx(6.0, rel=1e-6)
    np.testing.assert_allclose(
        frame.radiance[MIDDLE, MIDDLE], [reflected(1.0, 1 / 1.5**2, 1.0)] * 3, rtol=1e-5
    )


def test_names_are_those_of_the_file(draw):
    file = GltfFile()
    mesh = quad(file)
    for name in ("a/b", "twin", "twin", "Ünï 木 😀"):
        file.node(name=name, mesh=mesh)
    file.node(mesh=mesh)
    names = [name.removeprefix("root/model/") for name in draw(file, "id").id_names]
    assert names == ["a/b", "twin", "twin#2", "Ünï 木 😀", "node 4"]

"""Lights: what is read of them, in the formula of Panda3D's shader generator, gives Panda3D's picture."""

from __future__ import annotations

import math

import numpy as np
import pytest
from panda3d import core

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.lights import light_state, read_light
from firefly_sample.model.panda3d.transforms import affine_matrix
from firefly_sample.scene.light import Attenuation
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.node import PandaNode
from tests.panda.agreement import near_edge
from tests.panda.compare import draw_ours
from tests.panda.lit_cards import DISTANCE, SHININESS, lit_card, made, shadow_of_a_card
from tests.panda.oracle import SIZE
from tests.panda.scenes import ASPECT


def by_formula(light, matrix):
    """Codes, as floats, of the card lit by a light of ours whose node has a matrix to the world."""
    width, height = SIZE
    half = math.tan(math.radians(20)) * DISTANCE
    x = (np.arange(width) + 0.5) / width * 2 - 1
    z = 1 - (np.arange(height) + 0.5) / height * 2
    points = np.zeros((height, width, 3))
    points[..., 0], points[..., 2] = x * half, (z * half / ASPECT)[:, None]
    normal = eye = np.array([0.0, -1.0, 0.0])
    if isinstance(light, AmbientLight):
        return np.broadcast_to(np.clip(light.get_color(), 0, 1) * 255, points.shape)
    if isinstance(light, PointLights):
        arrays = light.evaluate(0.0)
        color, highlight = arrays.colors[0], light.specular_colors_of(arrays)[0]
        origin = arrays.positions[0] @ matrix[:3, :3] + matrix[3, :3]
    else:
        color, highlight, origin = light.get_color(), light.get_specular_color(), matrix[3, :3]
    strength = np.ones((height, width))
    if isinstance(light, DirectionalLight):
        to_light = np.broadcast_to(-light.get_direction() @ matrix[:3, :3], points.shape)
    else:
        to_light = origin - points
        distance = np.linalg.norm(to_light, axis=-1)
        strength = 1 / (
            light.get_attenuation() @ np.array([np.ones_like(distance), distance, distance**2]).reshape(3, -1)
        )
        strength = strength.reshape(height, width)
    to_light = to_light / np.linalg.norm(to_light, axis=-1, keepdims=True)
    if isinstance(light, Spotlight):
        cosine = -(to_light @ matrix[1, :3])
        cone = light.get_cone()
        assert cone.inner == cone.outer
        strength = (
            strength * np.clip(cosine, 0, 1) ** cone.exponent * (cosine >= math.cos(math.radians(cone.outer)))
        )
    halfway = to_light + eye
    halfway /= np.linalg.norm(halfway, axis=-1, keepdims=True)
    matt = strength * np.clip(to_light @ normal, 0, 1)
    shine = strength * np.clip(halfway @ normal, 0, 1) ** SHININESS
    return np.clip(np.clip(matt[..., None] * color, 0, 1) + 0.5 * shine[..., None] * highlight, 0, 1) * 255


ASIDE = (1, -3, 0.5), (15, -10, 40)
CASES = {
    "ambient": ("AmbientLight", {}, ASIDE),
    "warm": ("AmbientLight", {"color_temperature": 3000}, ASIDE),
    "directional": ("DirectionalLight", {}, ASIDE),
    "direction": ("DirectionalLight", {"direction": (1, 2, -1), "specular_color": (0.9, 0, 0.2, 1)}, ASIDE),
    "point": ("PointLight", {}, ASIDE),
    "attenuation": ("PointLight", {"attenuation": (0.5, 0.1, 0.05)}, ASIDE),
    "highlight": ("PointLight", {"specular_color": (0, 0.9, 0.2, 1)}, ASIDE),
    "sphere": ("SphereLight", {"radius": 1}, ASIDE),
    "spot": ("Spotlight", {}, ASIDE),
    "wide": ("Spotlight", {"lens_fov": 60, "exponent": 3, "attenuation": (0, 0.3, 0)}, ASIDE),
    "parallel": ("Spotlight", {"lens": core.OrthographicLens(), "exponent": 0}, ASIDE),
}


@pytest.mark.parametrize("name", CASES)
def test_the_picture_is_panda3ds(by_panda, name):
    kind, values, place = CASES[name]
    theirs = by_panda(lit_card, kind, values, [*place[0], *place[1]]).color[..., :3]
    light = read_light(made(kind, **values), Losses())
    ours = by_formula(light, affine_matrix(core.TransformState.make_pos_hpr(*place).get_mat()))
    off = np.abs(theirs - ours)
    # rounded to a code; Panda3D's numbers are float32
    assert off.max() <= 0.501


def read(kind, **values):
    """Our light, and what was said of it."""
    losses = Losses()
    return read_light(made(kind, **values), losses), losses.lines()


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("AmbientLight", AmbientLight),
        ("DirectionalLight", DirectionalLight),
        ("PointLight", PointLight),
        ("Spotlight", Spotlight),
    ],
)
def test_an_ordinary_light_loses_nothing(kind, expected):
    light, said = read(kind)
    assert type(light) is expected
    assert light.name == "lamp"
    assert light.get_color() == pytest.approx((0.5, 0.4, 0.3))
    assert said == []


def test_a_point_light_beside_its_node_is_where_its_point_is():
    light, said = read(
        "PointLight",
        point=(1, 2, 3),
        attenuation=(1, 2, 3),
        max_distance=7,
        specular_color=(0, 1, 0, 1),
        shadow_caster=True,
    )
    arrays = light.evaluate(0.0)
    assert arrays.positions.tolist() == [[1, 2, 3]]
    assert arrays.radii.tolist() == [7]
    assert light.specular_colors_of(arrays).tolist() == [[0, 1, 0]]
    assert light.get_attenuation() == Attenuation(1, 2, 3)
    assert light.is_shadow_caster()
    assert any("are at their points" in line for line in said)


@pytest.mark.parametrize("kind", ["PointLight", "Spotlight"])
def test_a_max_distance_ends_the_light(kind):
    light, said = read(kind, max_distance=4)
    assert light.get_max_distance() == 4
    assert said == ["lights end at their max distances, which Panda3D's shader generator ignores: 'lamp'"]


@pytest.mark.parametrize(
    ("kind", "values", "color", "said"),
    [
        ("PointLight", {"color": (-1, 0.5, 2, 1)}, (0, 0.5, 2), "negative colors are 0"),
        ("AmbientLight", {"color": (-1, 0.5, 2, 1)}, (0, 0.5, 2), "negative colors are 0"),
        ("PointLight", {"color": (math.nan, 1, 1, 1)}, (0, 0, 0), "that are not finite are black"),
        (
            "PointLight",
            {"attenuation": (0, 0, 0)},
            (0, 0, 0),
            "the attenuation (0, 0, 0), which divides by 0",
        ),
        ("Spotlight", {"attenuation": (math.inf, 0, 0)}, (0, 0, 0), "attenuation is not finite are dark"),
        ("PointLight", {"attenuation": (-1, 0, 0.5)}, (0.5, 0.4, 0.3), "negative coefficients"),
        ("DirectionalLight", {"direction": (0, 0, 0)}, (0, 0, 0), "without a direction are dark"),
        ("SphereLight", {"radius": 2}, (0.5, 0.4, 0.3), "sphere lights shine from their centres"),
        ("Spotlight", {"lens_fov": 200}, (0.5, 0.4, 0.3), "cones of 0.02 to 179.9 degrees"),
        ("Spotlight", {"lens_view_hpr": (10, 0, 0)}, (0.5, 0.4, 0.3), "however their lenses are turned"),
        ("Spotlight", {"exponent": -1}, (0.5, 0.4, 0.3), "exponents of 0 to 1e+06"),
    ],
)
def test_what_is_not_the_same_is_named(kind, values, color, said):
    light, lines = read(kind, **values)
    assert light.get_color() == pytest.approx(color)
    assert len(lines) == 1
    assert said in lines[0]
    assert lines[0].endswith(": 'lamp'")


def test_a_rectangle_light_gives_no_light_and_is_named():
    light, said = read("RectangleLight")
    assert type(light) is PandaNode
    assert said == ["lights of the type RectangleLight give no light: 'lamp'"]


@pytest.mark.parametrize(("given", "expected"), [((512, 512), 512), ((256, 2048), 2048), ((1, 1), 16)])
def test_shadow_maps(given, expected):
    light = made("PointLight", shadow_caster=True, shadow_buffer_size=given)
    light.set_camera_mask(core.BitMask32(6))
    losses = Losses()
    ours = read_light(light, losses)
    assert ours.is_shadow_caster()
    assert ours.get_shadow_resolution() == expected
    assert ours.camera_mask == 6
    assert bool(losses.lines()) == (given == (1, 1))


def test_shadows_of_the_sun_reach_further_and_states_of_casters_are_named():
    assert read("PointLight", shadow_caster=True)[1] == []
    assert "not only in their lenses' film" in read("DirectionalLight", shadow_caster=True)[1][0]
    state = core.RenderState.make(core.CullFaceAttrib.make(core.CullFaceAttrib.M_cull_none))
    said = read("PointLight", shadow_caster=True, initial_state=state)[1]
    assert said == ["the initial states of shadow casters are not used: 'lamp'"]


CHANGES = {
    "AmbientLight": {"color": (1, 0, 0, 1), "color_temperature": 4000},
    "DirectionalLight": {"specular_color": (1, 0, 0, 1), "direction": (1, 0, 0), "shadow_caster": True},
    "PointLight": {"attenuation": (1, 1, 0), "max_distance": 3, "point": (1, 0, 0), "shadow_caster": True},
    "Spotlight": {"exponent": 3, "max_distance": 3, "lens_fov": 50, "lens_view_hpr": (1, 0, 0)},
}


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [(kind, name, value) for kind, changes in CHANGES.items() for name, value in changes.items()],
)
def test_a_lights_state_changes_with_each_of_its_numbers(kind, name, value):
    light = made(kind)
    before = light_state(light)
    assert light_state(light) == before
    assert hash(light_state(light)) == hash(before)
    owner = light.get_lens() if name.startswith("lens_") else light
    getattr(owner, f"set_{name.removeprefix('lens_')}")(value)
    assert light_state(light) != before


@pytest.mark.parametrize("value", [(256, 256), (512, 256)])
def test_the_size_of_a_shadow_map_is_in_the_state(value):
    light = made("PointLight", shadow_caster=True, shadow_buffer_size=(512, 512))
    before = light_state(light)
    light.set_shadow_buffer_size(value)
    assert light_state(light) != before


@pytest.mark.parametrize(
    ("kind", "seen_by_light"),
    [("DirectionalLight", True), ("PointLight", True), ("Spotlight", True), ("Spotlight", False)],
)
def test_shadows_are_where_panda3ds_are(by_panda, kind, seen_by_light):
    theirs = by_panda(shadow_of_a_card, kind, seen_by_light).color[..., :3].astype(int)
    ours = draw_ours(shadow_of_a_card, kind, seen_by_light)[0].color.astype(int)
    off = np.abs(theirs - ours).max(axis=-1)
    dark = [picture.max(axis=-1) < 3 for picture in (theirs, ours)]
    inner = ~(near_edge(dark[0]) | near_edge(dark[1]))
    assert off[inner].max() <= 1
    shadow = dark[0][40:80, 60:100]  # the middle, within the spotlight's cone
    assert shadow.any() == seen_by_light
    assert not shadow.all()

"""Arrays that the API takes: what becomes of each kind of numbers, and what is refused by name."""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.capture.frames import parse_frames
from firefly_sample.errors import FireflyError, OutputError, ParameterError, SceneError, SettingsError
from firefly_sample.frame import check_size
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.arrays import as_codes, as_colors
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
ONE = [(0, 1, 2)]


def _geom(**given):
    return Geom(**{"vertices": CORNERS, "triangles": ONE, "name": "thing"} | given)


def _set_mat(matrix):
    path = NodePath("thing")
    path.set_mat(matrix)
    return path.get_mat()


def _set_pos(place):
    path = NodePath("thing")
    path.set_pos(place)
    return path.get_pos()


def _set_color(color):
    path = NodePath("thing")
    path.set_color(color)
    return path.get_color()


def _planned(attribute):
    def planned(value):
        scene = Scene()
        setattr(scene, attribute, value)
        plan = build_plan(scene, size=(8, 8))
        return getattr(plan, attribute) if attribute == "exposure" else plan.background.horizon

    return planned


def _light(method, get):
    def made(value):
        light = Spotlight("thing")
        getattr(light, method)(value)
        return get(light)

    return made


def _sun(direction):
    sun = DirectionalLight("thing")
    sun.set_direction(direction)
    return sun.get_direction()


def _ball(center):
    node = ParticleNode("thing")
    node.set_bounding_sphere(1.0, center)
    return node.get_bounding_sphere()[0]


PLACES = np.array(CORNERS)
SHARES = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
NUMBERS = {  # what takes numbers, and numbers of 0 and 1 that it takes
    "vertices": (lambda v: _geom(vertices=v).vertices, PLACES),
    "normals": (lambda v: _geom(normals=v).normals, PLACES),
    "texcoords": (lambda v: _geom(texcoords=v).texcoords, PLACES[:, :2]),
    "positions of lights": (lambda v: PointLights("thing", v).arrays.positions, PLACES),
    "radii of lights": (lambda v: PointLights("thing", PLACES, radii=v).arrays.radii, np.ones(3)),
    "positions of sprites": (lambda v: Sprites("thing", v).arrays.positions, PLACES),
    "positions of particles": (lambda v: ParticleNode("thing", v).arrays.positions, PLACES),
    "radii of particles": (lambda v: ParticleNode("thing", PLACES, v).arrays.radii, np.ones(3)),
    "alphas of particles": (lambda v: ParticleNode("thing", PLACES, 1, v).arrays.alphas, np.ones(3)),
    "center": (_ball, PLACES[1]),
    "attenuation": (_light("set_attenuation", lambda light: light.get_attenuation()), np.ones(3)),
    "direction": (_sun, PLACES[1]),
    "matrix": (_set_mat, np.eye(4)),
    "set_pos": (_set_pos, PLACES[1]),
    "exposure": (_planned("exposure"), np.ones(3)),
}
COLORS = {  # what takes colours
    "colors": (lambda v: _geom(colors=v).colors, SHARES),
    "colors of lights": (lambda v: PointLights("thing", PLACES, v).arrays.colors, SHARES),
    "specular colors": (
        lambda v: PointLights("thing", PLACES, specular_colors=v).specular_colors_of(
            PointLights("l", PLACES).arrays
        ),
        SHARES,
    ),
    "colors of sprites": (lambda v: Sprites("thing", PLACES, v).arrays.colors, SHARES),
    "colors of particles": (lambda v: ParticleNode("thing", PLACES, colors=v).arrays.colors, SHARES),
    "color": (lambda v: PointLight("thing", v).get_color(), SHARES[0]),
    "color of the sky": (lambda v: AmbientLight("thing", v).get_color(), SHARES[0]),
    "specular color": (_light("set_specular_color", lambda light: light.get_specular_color()), SHARES[0]),
    "base_color": (lambda v: Material("thing", v).base_color, np.array([0.0, 1.0, 0.0, 1.0])),
    "ambient": (lambda v: Material("thing", ambient=v).ambient, SHARES[0]),
    "emission": (lambda v: Material("thing", emission=v).emission, SHARES[0]),
    "specular": (lambda v: Material("thing", specular=v).specular, SHARES[0]),
    "set_color": (_set_color, np.array([0.0, 1.0, 0.0, 1.0])),
    "background": (_planned("background"), SHARES[0]),
}


class _Tensor:
    """As torch's: an array by asking."""

    def __init__(self, values):
        self.values = values

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.values, dtype)


class _Elsewhere:
    """As torch's on a GPU, or with a gradient."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad")


RIGHT = {
    "float64": lambda v: v,
    "list": lambda v: v.tolist(),
    "float32": lambda v: v.astype(np.float32),
    "float16": lambda v: v.astype(np.float16),
    "longdouble": lambda v: v.astype(np.longdouble),
    "big-endian": lambda v: v.astype(">f8"),
    "int64": lambda v: v.astype(np.int64),
    "int8": lambda v: v.astype(np.int8),
    "columns first": lambda v: np.asfortranarray(v),
    "every second": lambda v: np.repeat(v, 2, axis=0)[::2],
    "read-only": lambda v: np.broadcast_to(v, v.shape),
    "unmasked": lambda v: np.ma.array(v),
    "tensor": _Tensor,
}
WRONG = {
    "complex": lambda v: v + 1j,
    "text": lambda v: v.astype(str),
    "bool": lambda v: v.astype(bool),
    "objects": lambda v: v.astype(object),
    "none": lambda v: None,
    "ragged": lambda v: [*v.tolist(), [1.0, 2.0, 3.0, 4.0, 5.0]],
    "masked": lambda v: np.ma.array(v, mask=v > 0),
    "list of masked": lambda v: [*np.ma.array(v, mask=v > 0)],
    "NaN": lambda v: np.where(v > 0, np.nan, v),
    "infinity": lambda v: np.where(v > 0, -np.inf, v),
    "one too many": lambda v: np.repeat(v, 5, axis=0)[: len(v) + 2],
    "a dimension more": lambda v: v[None, None],
    "dates": lambda v: v.astype("datetime64[s]"),
    "elsewhere": lambda v: _Elsewhere(),
}


@pytest.mark.parametrize("kind", RIGHT)
@pytest.mark.parametrize("where", [*NUMBERS, *COLORS])
def test_numbers_of_every_right_kind_are_the_same_numbers(where, kind):
    take, values = (NUMBERS | COLORS)[where]
    taken = np.asarray(take(RIGHT[kind](values)))
    assert taken.dtype == np.float64
    assert np.array_equal(taken, values)


MEANT_OTHERWISE = {  # what is a right value there, of another meaning
    ("ambient", "none"),
    ("specular colors", "none"),
    ("colors", "none"),
    ("normals", "none"),
    ("radii of lights", "none"),
    ("vertices", "one too many"),
    ("texcoords", "none"),
    ("positions of lights", "one too many"),
    ("positions of sprites", "one too many"),
    ("positions of particles", "one too many"),
}


@pytest.mark.filterwarnings("ignore:.*converting a masked element to nan")  # as NumPy says of one number
@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("where", [*NUMBERS, *COLORS])
def test_numbers_of_every_wrong_kind_are_refused_by_name(where, kind):
    if (where, kind) in MEANT_OTHERWISE:
        return
    take, values = (NUMBERS | COLORS)[where]
    named = "thing|exposure|background"
    with pytest.raises(SceneError, match=named):
        take(WRONG[kind](values))


@pytest.mark.parametrize("where", COLORS)
def test_a_colour_is_not_negative(where):
    take, values = COLORS[where]
    with pytest.raises(SceneError, match=r"thing|background"):
        take(-values)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("where", COLORS)
def test_colours_of_unsigned_integers_are_shares_of_the_largest(where, dtype):
    """As glTF has them (normalized integers: c / 255, c / 65535), and trimesh."""
    take, values = COLORS[where]
    largest = np.iinfo(dtype).max
    given = values.astype(dtype) * dtype(largest // 4)
    expected = values * float(largest // 4) / float(largest)
    assert np.asarray(take(given)) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("dtype", ["u4", ">u4", "u8"])
@pytest.mark.parametrize("where", COLORS)
def test_colours_of_wider_unsigned_integers_are_refused(where, dtype):
    """They mostly hold 0 to 255, which would be black as shares of the largest."""
    take, values = COLORS[where]
    with pytest.raises(SceneError, match=r"(thing|background).* uint8 or uint16.* got .*: divide them by"):
        take((values * 255).astype(dtype))


@given(st.integers(0, 255))
def test_vertex_colours_of_trimesh_are_taken_as_they_are(code):
    mesh = trimesh.Trimesh(CORNERS, ONE, vertex_colors=[[code, 0, 255, 128]] * 3)
    geom = Geom(mesh.vertices, mesh.faces, colors=mesh.visual.vertex_colors)
    assert geom.colors.tolist() == [[code / 255, 0.0, 1.0]] * 3
    assert geom.alphas.tolist() == [128 / 255] * 3


def test_colours_above_one_say_what_to_do():
    for take in (lambda c: _geom(colors=[c] * 3), Material().set_base_color, _set_color):
        with pytest.raises(SceneError, match=r"0(\.\.| to )1, got .*divide them by .*255.*uint8"):
            take((200, 100, 50, 255))
    with pytest.raises(SceneError, match=r"0 to 1, got .*divide them by .*255.*uint8"):
        Texture(np.full((2, 2, 4), 255.0))


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_what_no_division_makes_a_colour_is_not_to_be_divided(value):
    def pixels(color):
        return Texture([[color]])

    for take in (lambda c: _geom(colors=[c] * 3), Material().set_base_color, _set_color, pixels):
        with pytest.raises(SceneError, match=r"colors?|pixels") as refused:
            take((2.0, 0.0, value, 1.0))
        assert "divide" not in str(refused.value)


def test_colours_that_were_computed_may_be_rounded():
    above, below = 1.0 + 2.0**-52, -1e-17
    geom = _geom(colors=[(above, below, 0.5)] * 3)
    assert geom.colors[0].tolist() == [1.0, 0.0, 0.5]
    assert Material("m", (above, below, 0.5, 1)).base_color.tolist() == [1.0, 0.0, 0.5, 1.0]
    assert _set_color((above, below, 0.5, 1)) == (1.0, 0.0, 0.5, 1.0)
    particles = ParticleNode("p", PLACES, alphas=(above, below, 0.5), colors=(above, below, 0.5)).arrays
    assert particles.colors.tolist() == [[1.0, 0.0, 0.5]] * 3
    assert particles.alphas.tolist() == [1.0, 0.0, 0.5]


def test_alpha_of_vertex_colours_costs_nothing_where_it_is_one():
    assert _geom(colors=[(1, 0, 0, 1)] * 3).alphas is None
    assert _geom(colors=[(1, 0, 0)] * 3).alphas is None
    geom = _geom(colors=[(1, 0, 0, 0.5)] * 3)
    assert geom.alphas.tolist() == [0.5] * 3
    geom.set_colors(None)
    assert geom.colors is None
    assert geom.alphas is None


# --- Indices ---


@pytest.mark.parametrize(
    "index", [2**32 + 2, 2**31, -1, 3, 2**63 - 1, -(2**32) + 2, np.uint64(2**64 - 1)], ids=str
)
def test_an_index_that_no_vertex_has_is_named_and_does_not_wrap(index):
    triangles = np.array([(0, 1, 2), (0, 1, index)], dtype=np.uint64 if index > 2**63 else np.int64)
    with pytest.raises(SceneError, match=rf"'thing'.*outside 0\.\.2: triangle 1 has {index}"):
        _geom(triangles=triangles)


@pytest.mark.parametrize("dtype", ["u1", "i1", "<u2", ">u4", "i8", "u8", "f4", "f8"])
def test_indices_of_every_type_are_whole_numbers(dtype):
    geom = _geom(triangles=np.array(ONE, dtype=dtype))
    assert geom.triangles.tolist() == [[0, 1, 2]]
    assert geom.triangles.dtype == np.int32


@pytest.mark.parametrize(
    "triangles",
    [[(0, 1, 1.5)], [(0, 1, np.nan)], [(False, True, True)], [("0", "1", "2")], [(0, 1, 2j)], [(0, 1, None)]],
    ids=str,
)
def test_what_is_no_index_is_refused(triangles):
    with pytest.raises(SceneError, match="'thing': triangles must be whole numbers"):
        _geom(triangles=triangles)


def test_no_triangles_are_no_mistake():
    assert len(_geom(triangles=np.zeros((0, 3))).triangles) == 0


# --- Textures ---


@given(st.lists(st.integers(0, 255), min_size=4, max_size=4))
def test_pixels_keep_their_codes_through_every_type(codes):
    stored = np.array([[codes]], dtype=np.uint8)
    for given_ in (
        stored,
        stored.tolist(),
        stored.astype(np.int64),
        stored / 255.0,
        (stored / np.float32(255)).astype(np.float32),
        stored.astype(np.uint16) * 257,
        stored.astype(">u2") * 257,
    ):
        assert np.array_equal(Texture(given_).pixels, stored)
    for wide in (np.uint32, np.uint64):
        with pytest.raises(SceneError, match=r"pixels of unsigned .* uint8 or uint16.* got .*: divide them"):
            Texture(stored.astype(wide))


def test_pixels_of_more_digits_are_rounded_to_the_nearest_code():
    assert as_codes("p", np.array([0.0, 0.5 / 255 - 1e-9, 0.5 / 255 + 1e-9, 1.0])).tolist() == [0, 0, 1, 255]
    assert as_codes("p", np.array([0, 128, 129, 65535], dtype=np.uint16)).tolist() == [0, 0, 1, 255]
    assert as_codes("p", np.array([False, True])).tolist() == [0, 255]


@pytest.mark.parametrize(
    "pixels",
    [
        np.full((2, 2, 4), 1.5),
        np.full((2, 2, 4), -0.1),
        np.full((2, 2, 4), np.nan),
        np.full((2, 2, 4), 256),
        np.full((2, 2, 4), -1),
        np.full((2, 2, 4), 1j),
        np.full((2, 2, 4), "1"),
        np.full((2, 2), 1),
        np.full((2, 2, 3), 1),
        np.full((0, 2, 4), 1),
    ],
    ids=lambda pixels: f"{pixels.dtype}{pixels.shape}",
)
def test_what_is_no_picture_is_refused(pixels):
    with pytest.raises(SceneError, match="texture 'leaf': pixels"):
        Texture(pixels, "leaf")


# --- Large and small ---


@pytest.mark.parametrize("what", ["vertices", "normals", "texcoords"])
def test_numbers_that_float32_does_not_hold_are_refused(what):
    values = np.array(CORNERS)[:, : 2 if what == "texcoords" else 3] * 1e39
    with pytest.raises(SceneError, match=f"'thing': {what} has a number above 1e[+]30, which float32"):
        _geom(**{what: values})


@pytest.mark.parametrize("scale", [1e-300, 1e-20, 1.0, 1e20, 1e30])
def test_normals_are_computed_at_every_scale(scale):
    assert _geom(vertices=np.array(CORNERS) * scale).normals == pytest.approx(np.tile([0, -1, 0], (3, 1)))


@pytest.mark.parametrize("length", [1e-30, 1e-7, 1e7, 1e29])
def test_normals_of_extreme_lengths_become_directions(length):
    assert np.abs(_geom(normals=np.tile([0, -length, 0], (3, 1))).normals).max() == 1.0
    assert _geom(normals=np.tile([0, -3.0, 0], (3, 1))).normals[0].tolist() == [0, -3, 0]


@pytest.mark.parametrize("value", [1e39, 1e31, np.inf])
def test_backgrounds_that_float32_does_not_hold_are_refused(value):
    for background in ((value, 0, 0), VerticalGradient((0, 0, 0), (0, value, 0))):
        scene = Scene(background=background)
        with pytest.raises(SceneError, match=r"background must be three numbers in 0\.\.1e[+]30"):
            build_plan(scene, size=(8, 8))


# --- Single numbers ---


@pytest.mark.parametrize("value", [np.int64(3), np.uint8(3), np.array(3), 3])
def test_whole_numbers_of_numpy_are_whole_numbers(value):
    assert parse_frames(value) == range(3, 4)
    assert check_size((value, value)) == (3, 3)
    assert Parameter("count", int, 1, "Count.").check(value, "s") == 3
    assert type(Parameter("count", int, 1, "Count.").check(value, "s")) is int
    settings = Settings(supersample=value - 1, shadow_taps=value + 1, particle_shadow_slices=value * 8)
    assert settings == Settings(supersample=2, shadow_taps=4, particle_shadow_slices=24)
    assert type(settings.particle_shadow_slices) is int
    path = NodePath("p")
    path.hide(value)
    assert path.node().draw_control == 3
    path.set_color((1, 0, 0), value)
    path.set_material(Material(), value)
    lamp = PointLight("lamp")
    lamp.set_shadow_caster(True, value + 97)
    assert lamp.get_shadow_resolution() == 100
    assert ParticleNode("p", seed=value).seed == 3


@pytest.mark.parametrize("value", ["3", True, 3.5, None, [3], 3j])
def test_what_is_no_whole_number_is_refused(value):
    lamp = PointLight("lamp")
    for act, error in (
        (lambda: parse_frames(value) if value != "3" else parse_frames("x"), OutputError),
        (lambda: check_size((value, value)), OutputError),
        (lambda: Parameter("count", int, 1, "Count.").check(value, "s"), ParameterError),
        (lambda: Settings(supersample=value), SettingsError),
        (lambda: Settings(particle_shadow_slices=value), SettingsError),
        (lambda: NodePath("p").hide([value]), SceneError),
        (lambda: lamp.set_shadow_caster(True, [value]), SceneError),
        (lambda: ParticleNode("p", seed=value), ParameterError),
    ):
        with pytest.raises(error, match=re.escape(repr(value)) if value != "3" else "'[x3]'|3"):
            act()


@pytest.mark.parametrize("value", [np.float32(0.5), np.float16(0.5), Fraction(1, 2), Decimal("0.5"), 0.5])
def test_numbers_of_every_kind_are_numbers(value):
    assert Settings(exposure=value).exposure == 0.5
    assert Parameter("size", float, 1.0, "Size.").check(value, "s") == 0.5
    assert PerspectiveLens(near=value).get_near() == 0.5
    assert Material("m", shininess=value, alpha_cutoff=value).alpha_cutoff == 0.5
    assert PointLight("l", radius=value).get_max_distance() == 0.5


@pytest.mark.parametrize("value", ["0.5", True, None, 0.5j, np.complex128(0.5), [0.5], np.array([0.5]), b"1"])
def test_what_is_no_number_is_refused(value):
    light = Spotlight("l")
    for act in (
        lambda: Settings(exposure=value),
        lambda: Parameter("size", float, 1.0, "Size.").check(value, "s"),
        lambda: PerspectiveLens().set_near_far(value, 10.0),
        lambda: Material("m", shininess=value),
        lambda: Material("m", alpha_cutoff=value),
        lambda: light.set_radius(value),
        lambda: light.set_exponent(value),
        lambda: light.set_cone(value, value),
        lambda: NodePath("p").set_x(value),
        lambda: build_plan(Scene(), size=(8, 8), time=value),
    ):
        with pytest.raises(FireflyError):
            act()


def test_no_colours_are_colours():
    assert as_colors("c", np.zeros((0, 3))).shape == (0, 3)
    assert len(PointLights("none", []).arrays) == 0

"""Wrap modes and filters of textures, emission textures, second texture coordinates: what the scene holds."""

import copy
import pickle
from itertools import product

import numpy as np
import pytest
from panda3d import core as panda

from firefly_sample.errors import SceneError
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.texture import Texture

WRAPS = ("repeat", "clamp", "mirror")
MINFILTERS = (
    "nearest",
    "linear",
    "nearest_mipmap_nearest",
    "linear_mipmap_nearest",
    "nearest_mipmap_linear",
    "linear_mipmap_linear",
)
MAGFILTERS = ("nearest", "linear")
CHOICES = {"wrap_u": WRAPS, "wrap_v": WRAPS, "minfilter": MINFILTERS, "magfilter": MAGFILTERS}
PIXELS = np.arange(16, dtype=np.uint8).reshape(2, 2, 4)
OTHER = {"wrap_u": "clamp", "wrap_v": "mirror", "minfilter": "nearest", "magfilter": "nearest"}
DUPLICATES = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
}


def from_file(**options):
    return Texture.from_file(lambda: PIXELS, (2, 2), None, "leaf", **options)


MAKERS = {"pixels": lambda **options: Texture(PIXELS, "leaf", **options), "file": from_file}
each_maker = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)


@each_maker
def test_a_texture_repeats_and_is_filtered_between_texels_and_levels(make):
    texture = make()
    assert texture.sampling == ("repeat", "repeat", "linear_mipmap_linear", "linear")
    assert texture.revision == 1


@each_maker
def test_every_choice_is_an_argument_and_a_setter_that_counts(make):
    for what, choices in CHOICES.items():
        for choice in choices:
            given, later = make(**{what: choice}), make()
            getattr(later, f"set_{what}")(choice)
            assert getattr(given, what) == getattr(later, what) == choice
            assert given.sampling == later.sampling
            assert (given.revision, later.revision) == (1, 2)


def test_the_names_are_panda3ds():
    states = panda.SamplerState
    assert all(hasattr(states, f"WM_{wrap}") for wrap in WRAPS)
    assert all(hasattr(states, f"FT_{name}") for name in MINFILTERS + MAGFILTERS)
    theirs = panda.Texture("leaf")
    for what in CHOICES:
        assert hasattr(theirs, f"set_{what}")
        assert hasattr(theirs, what)


@each_maker
def test_wrong_values_name_the_texture_and_change_nothing(make):
    texture = make()
    before = texture.sampling
    wrong = ("border", "LINEAR", "", None, 1, ["repeat"], np.array(["repeat", "clamp"]), {})
    for what, value in product(CHOICES, wrong):
        with pytest.raises(SceneError, match=f"^texture 'leaf': {what} must be '(nearest|repeat)'") as caught:
            getattr(texture, f"set_{what}")(value)
        assert "\n" not in str(caught.value)
        with pytest.raises(SceneError, match=f"texture 'leaf': {what} must be "):
            make(**{what: value})
    for value in MINFILTERS[2:]:
        with pytest.raises(SceneError, match="magfilter must be 'nearest' or 'linear', got"):
            texture.set_magfilter(value)
    assert texture.sampling == before
    assert texture.revision == 1


@each_maker
@pytest.mark.parametrize("duplicate", DUPLICATES.values(), ids=DUPLICATES)
def test_copies_sample_alike_and_apart(make, duplicate):
    texture = make(**OTHER)
    twin = duplicate(texture)
    assert twin.sampling == texture.sampling == tuple(OTHER.values())
    assert np.array_equal(twin.pixels, texture.pixels)
    assert twin.serial != texture.serial
    twin.set_wrap_u("mirror")
    assert texture.wrap_u == "clamp"


def test_two_textures_share_an_image():
    texture = Texture(PIXELS)
    twin = copy.copy(texture)
    twin.set_wrap_u("clamp")
    assert np.shares_memory(twin.pixels, texture.pixels)


def test_new_pixels_keep_the_sampling():
    texture = Texture(PIXELS, **OTHER)
    texture.set_pixels(PIXELS[:1])
    assert texture.sampling == tuple(OTHER.values())


def test_an_emission_texture_is_an_argument_of_a_material():
    plain, glowing = Material(), Material(emission_texture=Texture(PIXELS), emission_texcoord=1)
    assert (plain.emission_texture, plain.emission_texcoord) == (None, 0)
    assert (glowing.emission_texture.size, glowing.emission_texcoord) == ((2, 2), 1)
    for wrong in (2, -1, None, "0", 0.5):
        with pytest.raises(SceneError, match="material 'clay': emission_texcoord must be 0 or 1, got"):
            Material("clay", emission_texcoord=wrong)


@pytest.mark.parametrize("duplicate", DUPLICATES.values(), ids=DUPLICATES)
def test_copies_of_materials_keep_it(duplicate):
    twin = duplicate(Material(emission_texture=Texture(PIXELS), emission_texcoord=1))
    assert np.array_equal(twin.emission_texture.pixels, PIXELS)
    assert twin.emission_texcoord == 1


def test_second_texture_coordinates_are_checked_like_the_first():
    given = np.arange(6).reshape(3, 2)
    assert Geom(np.eye(3), [(0, 1, 2)]).texcoords_1 is None
    geom = Geom(np.eye(3), [(0, 1, 2)], texcoords_1=given)
    assert np.array_equal(geom.texcoords_1, given)
    assert not geom.texcoords.any()
    for duplicate in DUPLICATES.values():
        twin = duplicate(geom)
        assert np.array_equal(twin.texcoords_1, given)
        with pytest.raises(ValueError, match="read-only"):
            twin.texcoords_1[0] = 1
    for wrong, said in (
        (given[:2], "shape"),
        (np.ones((3, 3)), "shape"),
        (np.full((3, 2), np.nan), "finite"),
    ):
        with pytest.raises(SceneError, match=f"geom 'geom': texcoords_1 .*{said}"):
            Geom(np.eye(3), [(0, 1, 2)], texcoords_1=wrong)

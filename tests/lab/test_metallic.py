"""Metallic-roughness reflectance: integrals and values that are known."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.lab.reference.metallic import (
    ambient_reflectance,
    diffuse_color,
    distribution,
    fresnel,
    head_on_reflectance,
    reflected,
    smith,
    visibility,
    width,
)
from tests.lab.hemisphere import UP, energy, half_vectors, tilted

WHITE = np.ones(3)
ROUGHNESSES = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)
ANGLES = (0.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0)

shares = st.floats(0.0, 1.0)
colors = st.tuples(shares, shares, shares).map(np.array)
upwards = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.01, 1)).map(
    lambda v: np.array(v) / np.linalg.norm(v)
)


# --- the terms ---


@pytest.mark.parametrize("a", [width(1 / 32), 0.01, 0.1, 0.5, 1.0])
def test_microfacets_cover_the_surface_once(a):
    """The integral of D cos over the hemisphere is 1."""
    half, weights = half_vectors(float(a))
    facets = distribution(half[:, 2], half[:, 0] ** 2 + half[:, 1] ** 2, a)
    assert weights @ facets == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("angle", ANGLES[:-1])
@pytest.mark.parametrize("a", [0.04, 0.16, 0.5, 1.0])
def test_as_much_of_the_microfacets_is_seen_as_of_the_surface(a, angle):
    """Smith's masking: the facets in sight, each by its projected area, cover V.N (Heitz 2014, eq. 14)."""
    half, weights = half_vectors(a, 512, 512)
    eye = tilted(angle)
    facets = distribution(half[:, 2], half[:, 0] ** 2 + half[:, 1] ** 2, a) / half[:, 2]
    seen = smith(eye[2], a) * (weights * facets * np.maximum(half @ eye, 0.0)).sum()
    assert seen == pytest.approx(eye[2], rel=2e-4)


def test_masking_has_its_limits():
    cosines = np.linspace(0.01, 1.0, 50)
    assert smith(1.0, np.linspace(0.0, 1.0, 20)) == pytest.approx(np.ones(20), abs=1e-15)
    assert smith(cosines, 0.0) == pytest.approx(np.ones(50), abs=1e-15)
    assert smith(cosines, 1.0) == pytest.approx(2 * cosines / (1 + cosines), abs=1e-15)
    assert smith(0.0, 0.5) == 0.0
    assert (np.diff(smith(cosines, 0.3)) > 0).all()


@given(shares, shares, st.floats(1e-3, 1.0))
def test_visibility_is_the_masking_of_both_over_four_cosines(one, other, a):
    expected = smith(one, a) * smith(other, a)
    assert 4 * one * other * visibility(one, other, a) == pytest.approx(expected, rel=1e-12, abs=1e-300)
    assert np.isfinite(visibility(0.0, 0.0, a))


@given(st.integers(1, 10**9), st.integers(0, 20), st.integers(1, 2**20))
def test_the_distribution_keeps_its_digits_around_the_peak(numerator, exponent, code):
    """Against the form of glTF's text, in fractions: |N x H|^2 = s, so that (N.H)^2 = 1 - s."""
    s = Fraction(numerator, 10**9) / 2**exponent / 2
    a = Fraction(code, 2**20)
    exact = a**2 / ((1 - s) * (a**2 - 1) + 1) ** 2
    found = distribution(np.sqrt(float(1 - s)), float(s), float(a)) * np.pi
    assert found == pytest.approx(float(exact), rel=1e-14)


def test_no_microfacet_faces_down():
    assert distribution(np.array([-0.5, 0.0, -1.0]), np.array([0.75, 1.0, 0.0]), 0.3).tolist() == [0, 0, 0]


@given(colors, shares)
def test_fresnel_goes_from_head_on_to_all_light(f0, cosine):
    assert fresnel(1.0, f0) == pytest.approx(f0, abs=1e-15)
    assert fresnel(0.0, f0) == pytest.approx(WHITE, abs=1e-15)
    share = fresnel(cosine, f0)
    assert (share >= f0).all()
    assert (share <= 1.0 + 1e-15).all()
    assert share == pytest.approx(f0 + (1 - f0) * (1 - cosine) ** 5, abs=1e-15)
    assert (fresnel(-cosine, f0) == share).all()


# --- the whole ---


@given(colors, shares, shares)
def test_head_on_it_is_what_the_terms_are_by_hand(base, metallic, roughness):
    """L = V = N: D is 1/(pi a^2), G is 1, F is f0."""
    diffuse, glint = reflected(base, metallic, roughness, UP, UP, UP)
    f0, a = 0.04 * (1 - metallic) + metallic * base, max(roughness, 1 / 32) ** 2
    assert diffuse == pytest.approx((1 - f0) * (1 - metallic) * base, abs=1e-14)
    assert glint == pytest.approx(f0 / (4 * a * a), rel=1e-13)


@given(colors, shares, shares, upwards, upwards)
def test_light_and_eye_may_change_places(base, metallic, roughness, light, eye):
    there = reflected(base, metallic, roughness, UP, light, eye)
    back = reflected(base, metallic, roughness, UP, eye, light)
    for one, other in zip(there, back, strict=True):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-12)
        assert (one >= 0).all()


@given(colors, shares, shares, upwards, upwards, st.floats(-3, 3), st.floats(-3, 3))
def test_a_turned_surface_reflects_the_same(base, metallic, roughness, light, eye, heading, pitch):
    c, s, d, t = np.cos(heading), np.sin(heading), np.cos(pitch), np.sin(pitch)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, d, t], [0, -t, d]])
    turned = reflected(base, metallic, roughness, *(v @ turn for v in (UP, light, eye)))
    straight = reflected(base, metallic, roughness, UP, light, eye)
    for one, other in zip(turned, straight, strict=True):
        assert one == pytest.approx(other, rel=1e-8, abs=1e-11)


def test_opposite_light_and_eye_have_no_highlight():
    across = np.array([1.0, 0.0, 0.0])
    _, glint = reflected(WHITE, 1.0, 0.5, UP, across, -across)
    assert glint.tolist() == [0.0, 0.0, 0.0]


def test_below_the_least_roughness_it_is_that_one():
    light, eye = tilted(20.0), tilted(-21.0)
    least = reflected(WHITE, 0.5, 1 / 32, UP, light, eye)
    for one, other in zip(reflected(WHITE, 0.5, 0.0, UP, light, eye), least, strict=True):
        assert (one == other).all()


# --- energy ---


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_a_white_furnace_shows_no_more_light_on_metal_than_there_is(roughness, angle):
    diffuse, glint = energy(WHITE, 1.0, roughness, tilted(angle))
    assert not diffuse.any()
    assert (glint <= 1.0 + 1e-4).all()
    # light that would be reflected more than once is lost, the less the smoother
    assert (glint >= 1.0 - 3.0 * roughness).all()


@pytest.mark.parametrize("metallic", [0.0, 0.25, 0.5, 0.75])
@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_a_white_furnace_shows_up_to_what_the_formula_adds(roughness, metallic):
    """Without coupling, glTF's formula adds a highlight to a diffuse share of up to 1 - f0.

    Up to 30 degrees both together are no more than there is. Beyond, the highlight nears the light of a
    mirror, and the sum can only be bounded by that of both.
    """
    passed = (1 - head_on_reflectance(WHITE, metallic)) * diffuse_color(WHITE, metallic)
    for angle in ANGLES:
        diffuse, glint = energy(WHITE, metallic, roughness, tilted(angle))
        assert (glint <= 1.0 + 1e-4).all()
        assert (diffuse <= passed + 1e-12).all()
        assert angle > 30.0 or (diffuse + glint <= 1.0 + 1e-4).all()


@given(colors, shares)
def test_ambient_light_is_reflected_by_head_on_colours(base, metallic):
    share = ambient_reflectance(base, metallic)
    f0 = head_on_reflectance(base, metallic)
    assert (share >= f0).all()
    assert (share <= 1.0 + 1e-15).all()
    assert ambient_reflectance(base, 1.0) == pytest.approx(base, abs=1e-15)
    assert ambient_reflectance(base, 0.0) == pytest.approx(0.04 + 0.96 * base, abs=1e-15)


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_ambient_light_is_what_a_smooth_surface_reflects_head_on(metallic):
    base = np.array([0.9, 0.5, 0.1])
    exact = sum(energy(base, metallic, 0.05, UP))
    assert ambient_reflectance(base, metallic) == pytest.approx(exact, abs=1e-3)

"""Specular-glossiness surfaces as metallic-roughness ones: exact where both can say the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.scene.specular_glossiness import to_metallic_roughness

SHARE = st.floats(0.0, 1.0)
COLOR = st.tuples(SHARE, SHARE, SHARE)


def reflectances(made):
    """The diffuse colour and the reflectance head on, by the formulas of glTF 2.0, appendix B."""
    m = made.metallic[..., None]
    return made.base * (1.0 - m), 0.04 * (1.0 - m) + made.base * m


def wanted(diffuse, specular):
    """The same by the text of KHR_materials_pbrSpecularGlossiness."""
    specular = np.asarray(specular)
    return np.asarray(diffuse) * (1.0 - specular.max(axis=-1, keepdims=True)), specular


@given(COLOR, SHARE)
def test_a_dielectric_is_exact(diffuse, gloss):
    made = to_metallic_roughness(diffuse, [0.04] * 3, gloss)
    assert made.metallic == 0.0
    np.testing.assert_allclose(made.base, 0.96 * np.array(diffuse), rtol=1e-12, atol=1e-15)
    assert made.roughness == 1.0 - gloss
    assert made.error <= 1e-12


@given(COLOR)
def test_a_metal_is_exact(specular):
    made = to_metallic_roughness([0.0] * 3, specular, 1.0)
    np.testing.assert_allclose(reflectances(made)[1], specular, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(reflectances(made)[0], 0.0)
    if not (np.abs(np.array(specular) - 0.04) <= 1e-6).all():
        assert made.metallic == 1.0


@given(SHARE, st.floats(0.04, 1.0))
def test_grey_is_exact(diffuse, specular):
    made = to_metallic_roughness([diffuse] * 3, [specular] * 3, 0.5)
    np.testing.assert_allclose(reflectances(made), wanted([diffuse] * 3, [specular] * 3), rtol=0.0, atol=1e-9)


@given(st.floats(0.0, 0.039))
def test_a_matt_surface_below_the_reflectance_of_dielectrics_keeps_its_colour(specular):
    """Nothing in 0..1 makes f0 smaller than 0.04 if the surface is bright."""
    made = to_metallic_roughness([1.0] * 3, [specular] * 3, 0.5)
    assert made.metallic == 0.0
    assert made.error == pytest.approx(0.04 - specular, abs=1e-12)


@given(st.lists(st.tuples(COLOR, COLOR, SHARE), min_size=1, max_size=5))
def test_all_numbers_are_from_0_to_1_and_the_error_is_what_it_says(rows):
    diffuse, specular, gloss = (np.array(column) for column in zip(*rows, strict=True))
    made = to_metallic_roughness(diffuse, specular, gloss)
    for values in made[:3]:
        assert ((values >= 0.0) & (values <= 1.0)).all()
    off = [found - asked for found, asked in zip(reflectances(made), wanted(diffuse, specular), strict=True)]
    np.testing.assert_allclose(made.error, np.abs(off).max(axis=(0, -1)), atol=1e-12)
    alone = [to_metallic_roughness(*row) for row in rows]
    np.testing.assert_allclose(made.base, [each.base for each in alone], atol=1e-12)


def grid(steps, top=1.0):
    axis = np.linspace(0.0, top, steps)
    return np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)


GREYS = np.repeat(np.linspace(0.0, 1.0, 51)[:, None], 3, axis=1)


@pytest.mark.parametrize(
    ("speculars", "largest"), [(grid(5), 0.47), (GREYS, 0.26), (0.08 * GREYS, 0.046)], ids=str
)
def test_the_largest_error_is_what_the_module_says(speculars, largest):
    diffuse, specular = np.broadcast_arrays(grid(5)[:, None], speculars)
    assert to_metallic_roughness(diffuse, specular, 0.0).error.max() <= largest


def test_no_other_metalness_is_much_better():
    """A search over all metalness finds less squared error by at most a tenth, and by 1 % on the average."""
    diffuse, specular = np.random.default_rng(1).random((2, 2000, 3))
    made = to_metallic_roughness(diffuse, specular, 0.0)
    d, s = wanted(diffuse, specular)
    m = np.linspace(0.0, 1.0, 257)[:, None, None]
    n = 1.0 - m
    base = np.clip((n * d + m * (s - 0.04 * n)) / (n**2 + m**2), 0.0, 1.0)
    least = ((n * base - d) ** 2 + (0.04 * n + m * base - s) ** 2).sum(axis=-1).min(axis=0)
    found = sum(
        ((have - want) ** 2).sum(axis=-1) for have, want in zip(reflectances(made), (d, s), strict=True)
    )
    assert (found <= 1.1 * least + 1e-3).all()
    assert found.mean() <= 1.01 * least.mean()

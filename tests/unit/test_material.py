"""Materials: what they hold, what they refuse, and what a frame pays for them."""

import math

import numpy as np
import pytest
from panda3d import core as panda

from firefly_sample.errors import SceneError
from firefly_sample.scene.material import Material


def test_a_plain_material_reflects_and_nothing_else():
    """Shininess 0 is Panda3D's default; it has no colours at all until they are set."""
    material = Material()
    assert material.base_color.tolist() == [1, 1, 1, 1]
    assert material.ambient is None
    assert not material.emission.any()
    assert not material.specular.any()
    assert material.shininess == panda.Material("m").shininess == 0.0


def test_diffuse_is_the_base_color():
    material = Material("m", (0.1, 0.2, 0.3, 0.4))
    material.set_diffuse((0.5, 0.6, 0.7))
    assert material.base_color.tolist() == [0.5, 0.6, 0.7, 0.4]
    material.set_diffuse((0.5, 0.6, 0.7, 1.0))
    assert material.base_color.tolist() == [0.5, 0.6, 0.7, 1.0]


@pytest.mark.parametrize(
    ("what", "values"),
    [
        ("base_color", [(1, 1, 1), (1, 1, 1, 1.1), (-1, 0, 0, 1), "red", (math.nan, 0, 0, 1)]),
        ("ambient", [(1, 1), (0, 0, 1.5), (math.inf, 0, 0)]),
        ("emission", [(1, 1), (-1, 0, 0), (math.nan, 0, 0), (1, 1, 1e31)]),
        ("specular", [(1, 1, 1, 1), (0, 0, 1.5), None]),
        ("shininess", [-1, 1e7, math.nan, "very"]),
    ],
)
def test_wrong_values_name_the_material_and_change_nothing(what, values):
    material = Material("clay")
    before, revision = np.copy(getattr(material, what)), material.revision
    for value in values:
        with pytest.raises(SceneError, match=f"material 'clay': {what} must be"):
            getattr(material, f"set_{what}")(value)
        with pytest.raises(SceneError, match=f"material 'clay': {what} must be"):
            Material("clay", **{what: value})
    if what == "base_color":
        for value in ("red", (1, 1), (1, 1, 2), None, (1, 1, "x")):
            with pytest.raises(SceneError, match="material 'clay': base_color must be"):
                material.set_diffuse(value)
    assert np.array_equal(getattr(material, what), before)
    assert material.revision == revision


def test_every_setter_counts():
    material = Material()
    for name, value in (
        ("base_color", (1, 1, 1, 1)),
        ("diffuse", (1, 1, 1)),
        ("ambient", (1, 1, 1)),
        ("ambient", None),
        ("emission", (5, 5, 5)),
        ("specular", (1, 1, 1)),
        ("shininess", 1e6),
    ):
        before = material.revision
        getattr(material, f"set_{name}")(value)
        assert material.revision == before + 1

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


def test_what_only_one_model_has_is_refused_and_changes_nothing():
    metal = Material("gold", metallic=1.0, roughness=0.5)
    revision = metal.revision
    for setter, value in (("ambient", (0, 0, 0)), ("specular", (0.1, 0, 0)), ("shininess", 1)):
        with pytest.raises(SceneError, match="material 'gold': a metallic material has no ambient"):
            getattr(metal, f"set_{setter}")(value)
    assert (metal.ambient, metal.specular.any(), metal.shininess) == (None, False, 0)
    assert metal.revision == revision
    metal.set_metallic(0.25)
    phong = Material("clay", shininess=2.0)
    with pytest.raises(SceneError, match="leave these out, or metallic"):
        phong.set_metallic(1.0)
    assert phong.metallic is None
    phong.set_shininess(0)
    phong.set_metallic(1.0)
    assert phong.metallic == 1.0


@pytest.mark.parametrize(
    "what",
    ["texture", "emission_texture", "metallic_roughness_texture", "normal_texture", "occlusion_texture"],
)
def test_a_texture_is_a_texture(what):
    with pytest.raises(SceneError, match=f"material 'clay': {what} must be a Texture or None, got 'a.png'"):
        Material("clay", **{"metallic": 1.0, what: "a.png"})

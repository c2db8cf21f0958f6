"""The reference's formula of the look "pyrender" is that of the tests' own twin of pyrender's shader."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.lab.reference import metallic, pyrender
from firefly_sample.lab.reference.shading import cone_strength
from tests.interop.pyrender_twin import PYRENDER, Lamp, Lighting, Surface, radiance
from tests.lab.hemisphere import UP, tilted

shares = st.floats(0.0, 1.0)
colors = st.tuples(shares, shares, shares).map(np.array)
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.1)
directions = directions.map(lambda v: v / np.linalg.norm(v))


@given(colors, shares, shares, directions, directions, directions)
def test_it_is_the_twins(base, metalness, roughness, normal, to_light, to_eye):
    """Also where light and eye are behind the surface; where they are opposite, pyrender has no number."""
    if np.linalg.norm(to_light + to_eye) < 1e-3:
        return
    diffuse, glint = pyrender.reflected(base, metalness, roughness, normal, to_light, to_eye)
    found = (diffuse + glint) * pyrender.cosine_of_light(normal @ to_light)
    row = np.array([[0.0, 10.0, 0.0]]), normal[None], to_eye[None], base[None]
    numbers = np.array([metalness]), np.array([roughness])
    surface = Surface(*row, *numbers, np.zeros((1, 3)), np.ones((1, 3)), np.ones(1))
    lighting = Lighting([Lamp(np.full(3, np.pi), direction=-to_light)])
    (expected,) = radiance(surface, lighting, PYRENDER)
    # the shader's own distribution loses digits near its peak, up to 1e-16 / a^2
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-15)


@given(colors, shares, st.floats(0.3, 1.0))
def test_head_on_it_differs_from_gltf_by_what_is_added_to_four(base, metalness, roughness):
    theirs = pyrender.reflected(base, metalness, roughness, UP, UP, UP)
    ours = metallic.reflected(base, metalness, roughness, UP, UP, UP)
    assert theirs[0] == pytest.approx(0.96 * ours[0], rel=1e-12)
    assert theirs[1] == pytest.approx(4.0 / 4.001 * ours[1], rel=1e-12)


@pytest.mark.parametrize("roughness", [0.0, 0.03, 0.04])
def test_roughness_below_its_limit_counts_as_the_limit(roughness):
    light, eye = tilted(20.0), tilted(-21.0)
    least = pyrender.reflected(np.ones(3), 0.5, 0.04, UP, light, eye)
    for one, other in zip(pyrender.reflected(np.ones(3), 0.5, roughness, UP, light, eye), least, strict=True):
        assert (one == other).all()


@pytest.mark.parametrize(("inner", "outer"), [(0.1, 0.3), (0.3, 0.3), (0.0, 5e-4)])
def test_a_spotlights_edge_is_the_shaders(inner, outer):
    """pyrender: clamp(cos * scale - cos(outer) * scale)^2, and a scale of 1000 at most."""
    opened = np.linspace(0.0, 0.4, 1001)
    scale = 1.0 / max(0.001, outer - inner)
    expected = np.clip((1.0 - opened) * scale - (1.0 - outer) * scale, 0.0, 1.0) ** 2
    assert cone_strength(opened, inner, outer, 0.0, "pyrender") == pytest.approx(expected, abs=1e-12)

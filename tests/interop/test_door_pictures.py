"""The door's pictures against pyrender's own, with one sample in a pixel, and against formulas."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from pyrender import OrthographicCamera, RenderFlags

import firefly_sample.interop.pyrender as door
from firefly_sample.interop.pyrender.bridge import to_pyrender
from firefly_sample.losses import ConversionWarning
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.interop.door_cases import CASES, Case
from tests.interop.door_parts import backwards
from tests.interop.door_random import random_scene
from tests.interop.door_scenes import points
from tests.interop.oracle import LIT, SIZE, agreement, undo_perspective
from tests.interop.pyrender_twin import GLTF, PYRENDER, codes
from tests.interop.shading import lighting_of, seen
from tests.interop.test_pyrender_shading import SCENES

EVERY_CASE = pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
OTHER_FORMULAS = "one spotlight", "four spotlights", "four of each", "ambient light", "range", "mirrors"
"""Scenes of terms that glTF leaves open: edges of cones and ranges, ambient light, the least roughness."""


@pytest.fixture(scope="module")
def drawn():
    """``drawn(case, look)``: the colour and the depth of the door's picture of a case."""
    made = {look: door.OffscreenRenderer(*SIZE, look=look) for look in ("pyrender", "correct")}

    def draw(case, look="pyrender"):
        made[look].point_size = case.point_size
        with warnings.catch_warnings():
            if look == "correct":  # which is not all that pyrender draws
                warnings.simplefilter("ignore", ConversionWarning)
            return made[look].render(case.build(), case.flags)

    yield draw
    for each in made.values():
        each.delete()


@EVERY_CASE
def test_a_picture_is_pyrenders(draw_with_pyrender, drawn, case):
    """Each channel of each pixel is the same or one code away, on edges and in the background, too."""
    source = backwards(case.build()) if case.has_ties else case.build()
    theirs, their_depth = draw_with_pyrender(source, SIZE, case.flags, case.point_size)
    camera = source.main_camera_node.camera
    if isinstance(camera, OrthographicCamera):
        their_depth = undo_perspective(their_depth, camera.znear, camera.zfar)
    ours, depth = drawn(case)
    assert (ours.shape, ours.dtype, depth.dtype) == (theirs.shape, theirs.dtype, their_depth.dtype)
    found = agreement(np.where(depth > 0, depth, np.inf), their_depth)
    assert found
    assert found.covered > 0.005
    assert found.differing * depth.size <= 2  # float32 puts a pixel's centre on either side of an edge
    differences = np.abs(ours.astype(int) - theirs)
    assert differences[(depth > 0) == (their_depth > 0)].max() <= case.largest
    assert differences[(depth > 0) & (their_depth > 0)].mean() < 0.35  # blended surfaces: about 0.3


@pytest.mark.parametrize("flags", [LIT, RenderFlags.FLAT, RenderFlags.SKIP_CULL_FACES])
@pytest.mark.parametrize("seed", range(4))
def test_a_random_scene_is_pyrenders(draw_with_pyrender, drawn, seed, flags):
    """Float32 may show the other one of two surfaces that cross, and differs nowhere else."""
    case = Case(lambda: random_scene(seed), flags)
    theirs, their_depth = draw_with_pyrender(case.build(), SIZE, flags)
    ours, depth = drawn(case)
    assert ((depth > 0) != (their_depth > 0)).sum() <= 2
    differences = np.abs(ours.astype(int) - theirs).max(axis=-1)
    assert (differences > 1).sum() <= 5
    assert differences.mean() < 0.3


def test_the_pages_have_the_number_of_scenes_and_the_largest_difference():
    root, scenes = Path(__file__).parents[2], len({case.build for case in CASES})
    page, first_page = (
        " ".join(path.read_text().split()) for path in (root / "docs" / "pyrender.md", root / "README.md")
    )
    assert f"On the {scenes} scenes" in page
    assert f"On {scenes} scenes" in first_page
    assert max(case.largest for case in CASES if case.build is not points) == 1
    assert max(case.largest for case in CASES) == 7
    for text in (page, first_page):
        assert "by more than one code, but for lit points (up to seven codes)" in text


@EVERY_CASE
def test_gltfs_look_changes_colors_alone(drawn, case):
    assert (drawn(case, "correct")[1] == drawn(case)[1]).all()


@pytest.fixture(scope="module")
def seen_by_twin():
    """``seen_by_twin(name)``: a scene as pyrender's, and a function of terms: where it is seen, and codes."""
    with make_renderer(SIZE, Settings(normal_format="rgba32f")) as exact:

        def see(name):
            scene = SCENES[name]()
            frame = exact.render(scene, 0.0, ("position", "normal", "depth", "id"))

            def expected(terms):
                inside, surface = seen(scene, frame, "eye" in terms)
                return inside, codes(surface, lighting_of(scene), terms)

            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConversionWarning)
                return to_pyrender(scene, size=SIZE), expected

        yield see


@pytest.mark.parametrize(
    ("look", "name"),
    [("pyrender", name) for name in SCENES]
    + [("correct", name) for name in SCENES if name not in OTHER_FORMULAS],
)
def test_a_look_is_its_formula(seen_by_twin, look, name):
    """In float64, with all of pyrender's terms or all of glTF's."""
    source, expected = seen_by_twin(name)
    inside, wanted = expected(PYRENDER.keys() if look == "pyrender" else GLTF)
    with door.OffscreenRenderer(*SIZE, look=look) as drawing:
        differences = np.abs(drawing.render(source)[0][inside] - wanted)
    assert differences.max() <= 1
    assert differences.mean() < 0.05

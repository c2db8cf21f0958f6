"""Cameras whose projection is not one of pyrender's own three."""

from __future__ import annotations

import numpy as np
import pyrender
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from trimesh.transformations import translation_matrix

import firefly_sample.interop.pyrender as door
from firefly_sample.errors import SceneError
from firefly_sample.interop.pyrender.bridge import from_pyrender
from firefly_sample.interop.pyrender.projections import has_own_projection, lens_of_projection
from firefly_sample.losses import ConversionWarning
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from tests.interop.blocks import log_floats
from tests.interop.door_parts import EYE, add_lights, add_shapes, look
from tests.interop.oracle import LIT, SIZE, agreement
from tests.interop.own_cameras import Calibrated, Fixed, Shifted, WeakPerspective

TO_Z_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
WEAK = WeakPerspective((0.4, 0.5), (0.1, -0.2))


@pytest.fixture(scope="module")
def renderer():
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


def seen_by(camera, pose):
    made = pyrender.Scene(ambient_light=(0.1, 0.1, 0.1))
    made.add(camera, pose=pose, name="eye")
    return add_lights(add_shapes(made, look(roughness=0.4)), suns=2, lamps=2)


@pytest.mark.parametrize(
    ("camera", "pose"),
    [
        (WEAK, translation_matrix((0.0, 0.0, 0.5))),
        (Calibrated([(150, 0, 70), (0, 130, 75), (0, 0, 1)]), EYE),
        (Shifted(0.7), EYE),
    ],
    ids=["weak perspective", "calibrated", "shifted"],
)
def test_a_picture_is_pyrenders(renderer, draw_with_pyrender, camera, pose):
    made = seen_by(camera, pose)
    color, depth = renderer.render(made)
    their_color, their_depth = draw_with_pyrender(made, SIZE, LIT)
    both = (depth > 0) & (their_depth > 0)
    assert both.mean() > 0.1
    assert np.abs(color.astype(int) - their_color)[both].max() <= 1
    agreed = agreement(np.where(depth > 0, depth, np.inf), their_depth)
    assert agreed.stray == 0
    if camera is not WEAK:  # its depth is wrong in pyrender
        assert agreed


def test_the_depth_of_parallel_rays_is_above_0_also_behind_the_camera(renderer):
    """Boards a unit apart, on both sides of the camera, and the near plane at znear."""
    made = pyrender.Scene()
    made.add(WEAK)
    board = pyrender.Mesh.from_trimesh(trimesh.creation.box((1.0, 9.0, 0.0)))
    for x, z in ((-1.5, 0.75), (0.0, 0.0), (1.5, -0.5)):
        made.add(board, pose=translation_matrix((x, 0.0, z)))
    depth = renderer.render(made, pyrender.RenderFlags.DEPTH_ONLY)
    expected = [0.05 + 1.0 - z for z in (0.75, 0.0, -0.5)]
    np.testing.assert_allclose(np.unique(depth), [0.0, *expected], rtol=1e-6)
    made.main_camera_node.camera = pyrender.PerspectiveCamera(2.0)  # nothing of it stays
    np.testing.assert_allclose(renderer.render(made)[1].max(), 0.5, rtol=1e-6)


def test_a_change_of_the_matrix_shows(renderer):
    camera = WeakPerspective((0.4, 0.5), (0.0, 0.0))
    made = seen_by(camera, None)
    before = renderer.render(made)[0]
    camera.scale[:] = 0.2, 0.25
    after = renderer.render(made)[0]
    assert (after != before).any()
    assert (renderer.render(seen_by(WeakPerspective((0.2, 0.25), (0.0, 0.0)), None))[0] == after).all()


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([-1.0, 1.0, -1.0, 1.0]),
        np.eye(4),
        [(1, 0.1, 0, 0), (0, 1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1)],
        np.zeros((4, 4)),
        np.full((4, 4), np.nan),
        np.eye(3),
        -PerspectiveLens(50).get_projection_mat().T,
    ],
    ids=["mirrored", "turned round", "skewed", "zero", "not finite", "three rows", "behind"],
)
def test_what_no_lens_has_is_refused_by_name(renderer, matrix):
    made = seen_by(Fixed(matrix), EYE)
    with pytest.raises(SceneError, match="camera 'eye': no lens has the projection matrix of this Fixed"):
        renderer.render(made)


def test_a_camera_is_converted_for_a_size():
    made = seen_by(Shifted(0.7), EYE)
    lens = from_pyrender(made, size=SIZE).camera_node.lens
    expected = made.main_camera_node.camera.get_projection_matrix(*SIZE)
    np.testing.assert_allclose((TO_Z_UP @ lens.get_projection_mat()).T, expected, rtol=1e-12, atol=1e-15)
    with pytest.warns(ConversionWarning, match="Shifted are left out without the picture's size: 'eye'"):
        from_pyrender(made)


def test_only_matrices_of_others_are_read():
    assert not has_own_projection(pyrender.PerspectiveCamera(1.0))
    assert not has_own_projection(type("Named", (pyrender.IntrinsicsCamera,), {})(1.0, 1.0, 1.0, 1.0))
    assert has_own_projection(Shifted(1.0))
    replaced = pyrender.PerspectiveCamera(1.0)
    replaced.get_projection_matrix = lambda width, height: np.eye(4)
    assert has_own_projection(replaced)


@given(
    st.booleans(),
    st.tuples(log_floats(1e-3, 1e3), log_floats(1e-3, 1e3)),
    st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
    log_floats(1e-4, 1e4),
    st.one_of(st.just(np.inf), log_floats(1.01, 1e6)),
    log_floats(1e-3, 1e3),
)
def test_every_lens_is_found(perspective, scales, offsets, near, ratio, weight):
    """From its matrix times any weight; parallel rays may begin behind the camera."""
    width, height = SIZE
    fx, fy = 0.5 * scales[0] * width, 0.5 * scales[1] * height
    cx, cy = 0.5 * width * (1.0 + offsets[0]), 0.5 * height * (1.0 - offsets[1])
    kind, far = PerspectiveLens, near * ratio
    if not perspective:
        kind, near, far = OrthographicLens, -near, near * min(ratio, 1e6)
    lens = kind.from_intrinsics(fx, fy, cx, cy, *SIZE, near, far, pixel_center=0.5)
    found = lens_of_projection(Fixed(weight * (TO_Z_UP @ lens.get_projection_mat()).T), SIZE)
    assert type(found) is kind
    np.testing.assert_allclose(found.get_projection_mat(), lens.get_projection_mat(), rtol=1e-9, atol=1e-12)
    assert found.for_picture(*SIZE).shape.fits(*SIZE)

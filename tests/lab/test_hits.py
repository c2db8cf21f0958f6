"""Where pixels' rays meet triangles, and what is interpolated there: known to the last digits."""

import numpy as np
import pytest

from firefly_sample.errors import OutputError
from firefly_sample.lab.reference.rays import FARTHEST_OUT, RayCorners, intersect, pixel_rays
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from tests.lab.float64 import covering, plan_of
from tests.scenes import geom_node


def lens_of(kind):
    if kind == "orthographic":
        return OrthographicLens(film_size=(4, 3), near=1, far=100)
    if kind == "film offset":
        return PerspectiveLens(fov=60.0, near=1.0, far=100.0, film_size=(4, 3), film_offset=(1.0, -0.5))
    return PerspectiveLens(vfov=60.0, near=1.0, far=100.0)


CORNERS = np.array([(-60.0, 5.0, -40.0), (70.0, 30.0, -35.0), (3.0, 90.0, 120.0)])
"""Of a large and very tilted triangle around the view axis."""


def one_triangle(kind="perspective", corners=CORNERS, turn=(0.0, 0.0, 0.0), **options):
    """A triangle that (nearly) fills the view."""
    scene = Scene()
    given = {name: options.pop(name) for name in ("normals", "colors", "texcoords") if name in options}
    geom = Geom(corners, [(0, 1, 2)], **given)
    material = Material("paper", double_sided=True, **options)
    scene.root.attach_new_node(geom_node("triangle", geom, material)).set_hpr(*turn)
    scene.camera.set_hpr(*turn)
    scene.camera.node().lens = lens_of(kind)
    return scene


@pytest.mark.parametrize("kind", ["perspective", "orthographic", "film offset"])
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (70.0, -20.0, 130.0)])
def test_hits_lie_on_the_plane_and_on_the_ray(kind, turn):
    plan = plan_of(one_triangle(kind, turn=turn))
    normal = np.cross(CORNERS[1] - CORNERS[0], CORNERS[2] - CORNERS[0])
    place = see_surfaces(plan, covering(plan)).gbuffer.position
    lens, (width, height) = plan.view.lens, plan.view.size
    ndc = lens.ndc_from_view(place)
    assert ndc[..., 0] == pytest.approx(
        np.tile((np.arange(width) + 0.5) / width * 2 - 1, (height, 1)), abs=1e-13
    )
    assert ndc[..., 1] == pytest.approx(
        np.tile(1 - (np.arange(height)[:, None] + 0.5) / height * 2, width), abs=1e-13
    )
    ray = pixel_rays(plan.view)
    n_dot_d = ray.direction @ normal
    exact = ((CORNERS[0] - ray.origin) @ normal / n_dot_d).reshape(height, width)
    assert np.abs(place[..., 1] / exact - 1).max() <= 1e-12


@pytest.mark.parametrize("kind", ["perspective", "orthographic", "film offset"])
def test_what_is_linear_in_space_is_interpolated_with_perspective(kind):
    """Colours that are a linear function of the place must be that of the hit, not of the pixel."""
    scene = one_triangle(kind, colors=np.abs(CORNERS) / 200.0)
    plan = plan_of(scene)
    surfaces = see_surfaces(plan, covering(plan))
    place = surfaces.gbuffer.position
    corners = np.column_stack([CORNERS, np.ones(3)])
    shares = np.concatenate([place, np.ones((*place.shape[:2], 1))], axis=-1) @ np.linalg.pinv(corners)
    inside = (shares >= 0).all(axis=-1)
    assert inside.mean() > 0.5
    expected = np.clip(shares @ (np.abs(CORNERS) / 200.0), 0.0, 1.0)
    assert np.abs(surfaces.gbuffer.albedo - expected)[inside].max() <= 1e-12


def test_normals_go_through_the_cofactors_and_turn_to_the_eye():
    scene = one_triangle(normals=np.tile([0.0, 0.6, 0.8], (3, 1)))
    path = scene.root.find("triangle")
    path.set_scale(1.0, 2.0, -0.5)
    plan = plan_of(scene)
    gbuffer = see_surfaces(plan, covering(plan)).gbuffer
    expected = np.array([0.0, 0.6 / 2.0, 0.8 / -0.5])
    expected /= np.linalg.norm(expected)
    toward = np.sign(-gbuffer.position @ expected)[..., None]
    assert np.abs(gbuffer.normal - toward * expected).max() <= 1e-15
    assert len(np.unique(toward)) == 2


def test_edge_on_and_degenerate_triangles_stay_where_they_are():
    """A plane that holds the eye is met nowhere, or anywhere: the nearest point of the triangle stands in."""
    for corners in (
        [(0.0, 5.0, -1.0), (0.0, 5.0, 1.0), (0.0, 9.0, 0.0)],  # edge-on
        [(1e-13, 5.0, -1.0), (0.0, 5.0, 1.0), (0.0, 9.0, 0.0)],
        [(1.0, 5.0, 0.0), (1.0, 5.0, 0.0), (2.0, 6.0, 0.0)],  # a line
        [(1.0, 5.0, 1.0)] * 3,
    ):
        plan = plan_of(one_triangle(corners=np.array(corners)))
        gbuffer = see_surfaces(plan, covering(plan)).gbuffer
        for image in (gbuffer.position, gbuffer.normal, gbuffer.albedo):
            assert np.isfinite(image).all()
        assert np.array(corners)[:, 1].min() - 1e-9 <= gbuffer.position[..., 1].min()
        assert gbuffer.position[..., 1].max() <= np.array(corners)[:, 1].max() + 1e-9


def test_a_plane_is_followed_only_a_little_way_out_of_its_triangle():
    corners = np.array([[(0.0, 5.0, 0.0), (1.0, 5.0, 0.0), (0.0, 5.0, 1.0)]] * 3)
    across = np.array([0.2, -0.5 * FARTHEST_OUT, -2.0 * FARTHEST_OUT])
    rays = np.stack([across, np.zeros(3), np.full(3, 0.25)], axis=1)
    met = intersect(RayCorners.of(corners, rays, np.tile([0.0, 1.0, 0.0], (3, 1))))
    assert met.inside.tolist() == [True, False, False]
    assert met.on_ray.tolist() == [True, True, False]
    assert met.shares[:, 1] == pytest.approx([0.2, -0.5 * FARTHEST_OUT, 0.0], abs=1e-15)
    assert met.shares.sum(axis=1) == pytest.approx([1, 1, 1], abs=1e-15)
    # X right, Z up: these corners run counter-clockwise
    assert met.front.all()


def test_triangles_with_a_common_edge_agree_on_which_side_a_ray_is():
    rng = np.random.default_rng(3)
    a, b, c, d = rng.normal(size=(4, 20000, 3)) * 10.0 ** rng.uniform(-3, 3, (1, 20000, 1)) + (0, 5, 0)
    share = rng.uniform(size=(20000, 1))
    direction = a + share * (b - a)  # towards the edge, as well as it can be rounded
    direction = direction / direction[:, 1:2]
    sides = [
        RayCorners.of(np.stack(corners, axis=1), np.zeros(3), direction).areas()[:, 2]
        for corners in ((a, b, c), (b, a, d))
    ]
    assert (sides[0] == -sides[1]).all()


def test_a_visibility_of_another_plan_is_refused():
    plan = plan_of(one_triangle())
    for instance, triangle in ((1, 0), (0, 1), (0, -1)):
        with pytest.raises(OutputError, match=f"triangle {triangle} of instance {instance}"):
            see_surfaces(plan, covering(plan, instance, triangle))
    with pytest.raises(OutputError, match=r"visibility must have the plan's shape \(48, 64, 2\)"):
        see_surfaces(plan, covering(plan)[:-1])
    with pytest.raises(OutputError, match="albedo must have"):
        see_surfaces(plan, covering(plan), albedo=np.zeros((48, 64)))
